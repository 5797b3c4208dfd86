"""Ape-X on two Ray nodes, with and without a worker killed every 20 seconds: do they learn alike?

    python benchmarks/apex_kills.py            measure (some 15 minutes on two cores), write json and page
    python benchmarks/apex_kills.py --page     write the page again from what was measured

Each run is `racecraft gym train CartPole-v1 --algorithm apex` on a cluster of three nodes that this script makes: one
without cores, where the learner is, and two with a core each, where a worker carries half of the worlds. In the runs
with kills one of the two workers' processes gets SIGKILL every 20 seconds, in turns. What is compared is the greedy
policy's return at equal steps. Ape-X is not the same twice, for its learner works beside the worlds; so three seeds
each say how far apart runs are that nothing happened to. Needs the extra `cluster`.
"""

from __future__ import annotations

import contextlib
import json
import os
import platform
import signal
import statistics
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

HERE = Path(__file__).resolve().parent
RESULTS = HERE / "apex_kills.json"
PAGE = HERE / "apex-kills.md"
SEEDS = (1, 2, 3)
EVERY_SECONDS = 20.0
ITERATIONS, EVALUATED_EVERY = 80, 8
SETTINGS = (
    f"evaluation.every={EVALUATED_EVERY}", "evaluation.episodes=10", "rollout.num_worlds=8", "runtime.threads=1",
)  # fmt: skip
ARMS = {"undisturbed": False, "a worker killed every 20 s": True}
LATE = 4
"""So many evaluations at the end say what a run came to."""


def main(arguments: list[str]) -> int:
    if "--page" not in arguments:
        RESULTS.write_text(json.dumps(measure(), indent=1) + "\n", encoding="utf-8")
    PAGE.write_text(page(json.loads(RESULTS.read_text(encoding="utf-8"))), encoding="utf-8")
    return 0


def measure() -> dict[str, Any]:
    load, runs = [os.getloadavg()[0]], []
    for seed in SEEDS:
        for arm, killed in ARMS.items():
            one = trained(seed, killed)
            load.append(os.getloadavg()[0])
            runs.append({"arm": arm, "seed": seed, **one})
            print(f"seed {seed}, {arm}: {one['killed']} killed, {one['seconds']:.0f} s, {one['curve'][-1]}", flush=True)
    machine = {"processor": platform.machine(), "system": platform.system(), "cores": os.cpu_count()}
    return {"machine": machine, "measured": time.strftime("%Y-%m-%d"), "load": [min(load), max(load)], "runs": runs}


def trained(seed: int, killed: bool) -> dict[str, Any]:
    """Train once on two nodes; return its evaluations, [steps, return] each, and what happened to it."""
    from ray.cluster_utils import Cluster

    with tempfile.TemporaryDirectory() as place, contextlib.ExitStack() as doors:
        run = Path(place) / "run"
        cluster = Cluster(initialize_head=True, head_node_args={"num_cpus": 0, "include_dashboard": False})
        doors.callback(cluster.shutdown)
        for _ in range(2):
            cluster.add_node(num_cpus=1)
        settings = [word for one in SETTINGS for word in ("--set", one)]
        command = [
            sys.executable, "-m", "racecraft", "gym", "train", "CartPole-v1", "--algorithm", "apex",
            "--cluster", f"2@{cluster.address}", "--run", str(run), "--seed", str(seed),
            "--stop", f"iterations={ITERATIONS}", *settings,
        ]  # fmt: skip
        training = subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
        doors.callback(training.kill)
        ended, kills = threading.Event(), [0]
        if killed:
            killing = threading.Thread(target=kill_in_turns, args=(run / "metrics.jsonl", ended, kills))
            killing.start()
            doors.callback(killing.join)
        doors.callback(ended.set)
        said, _ = training.communicate()
        ended.set()
        if training.returncode:
            raise SystemExit(said)
        rows = [json.loads(line) for line in (run / "metrics.jsonl").read_text().splitlines()]
    curve = [[row["steps"], row["evaluation_score"]] for row in rows if row["evaluation_score"] is not None]
    return {"killed": kills[0], "replaced": said.count("was lost"), "seconds": rows[-1]["seconds"], "curve": curve}


def kill_in_turns(metrics: Path, ended: threading.Event, kills: list[int]) -> None:
    """From the first iteration on kill one of the workers every so often, the one that has lived longest."""
    while not metrics.exists() and not ended.wait(0.2):
        pass
    while not ended.wait(EVERY_SECONDS):
        if workers := sorted(workers_of(os.getpid())):
            with contextlib.suppress(ProcessLookupError):
                os.kill(workers[0][1], signal.SIGKILL)
                kills[0] += 1


def workers_of(pid: int) -> Iterator[tuple[int, int]]:
    """Yield (when it began, pid) of every process of Ray's that carries worlds and descends from a process."""
    told = {}
    for place in Path("/proc").glob("[0-9]*"):
        with contextlib.suppress(OSError):
            stat = (place / "stat").read_text().rpartition(")")[2].split()
            told[int(place.name)] = (int(stat[1]), int(stat[19]), (place / "cmdline").read_bytes())
    for one, (_, began, command) in told.items():
        ancestor = one
        while ancestor in told and ancestor != pid:
            ancestor = told[ancestor][0]
        if ancestor == pid and command.startswith(b"ray::Worker"):
            yield began, one


def late(run: dict[str, Any]) -> float:
    """Return what a run came to: the mean of its last evaluations.

    >>> late({"curve": [[0, 0.0], *([i, 10.0 * i] for i in range(1, LATE + 1))]})
    25.0
    """
    return statistics.mean(score for _, score in run["curve"][-LATE:])


def judged(undisturbed: list[float], killed: list[float]) -> str:
    """Say whether the runs with kills came to what seeds alone come to.

    >>> judged([10.0, 20.0, 30.0], [12.0, 25.0, 40.0])
    'within seeds'
    >>> judged([10.0, 20.0, 30.0], [1.0, 2.0, 12.0])
    'not within seeds'
    """
    middle = statistics.median(killed)
    return "within seeds" if min(undisturbed) <= middle <= max(undisturbed) else "not within seeds"


def page(results: dict[str, Any]) -> str:
    """Return the page of what was measured."""
    machine, load, runs = results["machine"], results["load"], results["runs"]
    by = {arm: [run for run in runs if run["arm"] == arm] for arm in ARMS}
    undisturbed, killed = by.values()
    verdict = judged([late(run) for run in undisturbed], [late(run) for run in killed])
    lines = [
        "# Ape-X on two nodes, with a worker killed every 20 seconds",
        "",
        "<!-- Written by benchmarks/apex_kills.py from benchmarks/apex_kills.json. -->",
        "",
        f"CartPole-v1, Ape-X on two Ray nodes of a core each and a learner beside them, {len(undisturbed)} seeds each; "
        f"measured {results['measured']} on {machine['cores']} cores ({machine['system']}, {machine['processor']}) at "
        f"a load of {load[0]:.1f} to {load[1]:.1f}. The greedy policy's mean return over 10 episodes at equal steps: "
        "the median of the seeds, and from the lowest to the highest.",
        "",
        "| steps | " + " | ".join(ARMS) + " |",
        "|---|" + "---|" * len(ARMS),
    ]
    for index, (steps, _) in enumerate(undisturbed[0]["curve"]):
        cells = [spread([run["curve"][index][1] for run in of]) for of in by.values()]
        lines.append(f"| {steps:,} | {' | '.join(cells)} |")
    mean_cells = [spread([late(run) for run in of]) for of in by.values()]
    lines += [
        f"| mean of the last {LATE} | {' | '.join(mean_cells)} |",
        "",
        f"The median of the runs with kills, by the mean of their last {LATE} evaluations, lies **{verdict}**: "
        f"{'between' if verdict == 'within seeds' else 'outside'} the lowest and the highest of the runs without.",
        "",
        "| seed | " + " | ".join(f"{arm}: killed, replaced, seconds, came to" for arm in ARMS) + " |",
        "|---|" + "---|" * len(ARMS),
    ]
    for runs_of_seed in zip(*by.values(), strict=True):
        cells = [f"{one['killed']}, {one['replaced']}, {one['seconds']:.0f}, {late(one):.0f}" for one in runs_of_seed]
        lines.append(f"| {runs_of_seed[0]['seed']} | {' | '.join(cells)} |")
    return "\n".join(lines) + "\n"


def spread(values: list[float]) -> str:
    return f"{statistics.median(values):.0f} ({min(values):.0f} – {max(values):.0f})"


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
