"""Ours beside other libraries, process against process: seconds until a world is solved.

    python benchmarks/peers.py [--worlds CartPole-v1,Pendulum-v1] [--seeds 5] [--minutes 10] [--keep]
                               [--rllib PYTHON] [--cleanrl PYTHON FOLDER]

Every run is a process of its own, from its start to its end, on one thread; who runs first changes from seed to seed.
Each learns with the settings its own house tuned: `racecraft gym train ID --algorithm NAME` as it begins, with what
`CONTESTS` sets for a world (MountainCar's are those of `sac_curves.py`; CartPole bears larger batches and steps than
Acrobot, for which `gym train`'s are a mean; they were chosen on seeds above 100), Stable-Baselines3 with its zoo's
(`peer_sb3.py`), RLlib with its tuned examples' (`peer_rllib.py`), CleanRL's single files as they begin
(`peer_cleanrl.py`; FOLDER is its repository). PYTHON is that of an environment of its own, and a world that a house
shows no settings for is left out. Ours draws no pictures of its run, for the others draw none.

All are judged alike: after so many steps 20 greedy episodes, and where Gymnasium itself says when a world is solved,
100 more to confirm it. Judging is in the seconds. Seconds of the processor are told beside those of the clock: other
work on the machine bends them less. A run that ended unsolved counts as endless.
"""

from __future__ import annotations

import argparse
import json
import os
import resource
import statistics
import subprocess
import sys
import tempfile
import time
from dataclasses import dataclass
from datetime import date
from pathlib import Path
from typing import Any

HERE = Path(__file__).resolve().parent
RESULTS, PAGE = HERE / "peers.json", HERE / "peers.md"
TITLE = "# Seconds until a world is solved, ours beside others"
BEGINS = """Whole processes on one thread, from start to end, in turns, each with the settings its own house tuned: ours
as `racecraft gym train` begins, two worlds with settings of their own (`CONTESTS` in `peers.py`), Stable-Baselines3
with its zoo's, RLlib with its tuned examples', CleanRL's single files as they begin. Who is judged as solved, and how,
stands in `peers.py`. A run that ended unsolved counts as endless."""
NEVER = float("inf")


@dataclass(frozen=True)
class Contest:
    """One world: what solves it, and how ours learns it."""

    goal: float
    """Mean return of greedy episodes."""
    algorithm: str
    settings: tuple[str, ...] = ()
    """What ours needs beside its defaults, `--set` by `--set`."""


CONTESTS = {
    "CartPole-v1": Contest(
        475.0, "ppo", ("ppo.batch_size=512", "ppo.learning_rate=8e-3", "ppo.clip=0.3", "ppo.gae_lambda=0.95")
    ),
    "Acrobot-v1": Contest(-100.0, "ppo"),
    "Pendulum-v1": Contest(-200.0, "sac"),
    "MountainCarContinuous-v0": Contest(90.0, "sac", ("sac.noise_correlation=0.95", "sac.gradient_steps_per_step=0.5")),
}
OURS, SB3, RLLIB, CLEANRL = "racecraft", "stable-baselines3", "rllib", "cleanrl"
SCRIPTS = {SB3: "peer_sb3.py", RLLIB: "peer_rllib.py", CLEANRL: "peer_cleanrl.py"}
WORLDS_OF = {
    OURS: tuple(CONTESTS),
    SB3: tuple(CONTESTS),
    RLLIB: ("CartPole-v1", "Pendulum-v1"),
    CLEANRL: ("CartPole-v1", "Acrobot-v1", "Pendulum-v1"),
}
"""Worlds that each house shows settings for."""


@dataclass(frozen=True)
class Peer:
    """Who races: its name, its Python, and what its script is told besides."""

    name: str
    python: str
    words: tuple[str, ...] = ()


def command(peer: Peer, world: str, seed: int, minutes: float, folder: str) -> list[str]:
    """Return what is typed for one run."""
    contest = CONTESTS[world]
    if peer.name == OURS:
        settings = [word for one in contest.settings for word in ("--set", one)]
        stops = ["--stop", f"score={contest.goal:g}", "--stop", f"minutes={minutes:g}"]
        words = ["gym", "train", world, "--algorithm", contest.algorithm, "--seed", str(seed)]
        told = ["--run", f"{folder}/run", "--no-pictures", "--json"]
        return [peer.python, "-m", "racecraft", *words, *stops, *settings, *told]
    script = str(HERE / SCRIPTS[peer.name])
    until = ["--goal", f"{contest.goal:g}", "--minutes", f"{minutes:g}"]
    return [peer.python, script, world, str(seed), *until, *peer.words]


def run(peer: Peer, world: str, seed: int, minutes: float) -> dict[str, Any]:
    """Run once; seconds are None where the world was not solved in time."""
    with tempfile.TemporaryDirectory() as folder:
        before, began = resource.getrusage(resource.RUSAGE_CHILDREN), time.perf_counter()
        environment = {**os.environ, "OMP_NUM_THREADS": "1", "MKL_NUM_THREADS": "1"}
        words = command(peer, world, seed, minutes, folder)
        done = subprocess.run(words, capture_output=True, text=True, env=environment)
        wall, after = time.perf_counter() - began, resource.getrusage(resource.RUSAGE_CHILDREN)
    if not done.stdout.strip():
        raise SystemExit(f"{peer.name} on {world}, seed {seed}, failed:\n{done.stderr}")
    told = json.loads(done.stdout.strip().splitlines()[-1])
    solved = str(told["stopped_by"]).startswith("score=") if peer.name == OURS else told["solved"]
    spent = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    return {
        "seconds": round(wall, 2) if solved else None,
        "processor_seconds": round(spent, 2) if solved else None,
        "steps": told["env_steps" if peer.name == OURS else "steps"],
    }


def race(
    peers: list[Peer], worlds: list[str], seeds: int, minutes: float
) -> dict[str, dict[str, list[dict[str, Any]]]]:
    """Run everybody on every world, seed by seed, in turns; say how it goes on standard error."""
    who = {world: [peer for peer in peers if world in WORLDS_OF[peer.name]] for world in worlds}
    found: dict[str, dict[str, list[dict[str, Any]]]]
    found = {world: {peer.name: [] for peer in who[world]} for world in worlds}
    for seed in range(1, seeds + 1):
        for world in worlds:
            for peer in who[world] if seed % 2 else reversed(who[world]):
                runs = found[world][peer.name]
                runs.append(run(peer, world, seed, minutes))
                print(f"{world}, seed {seed}, {peer.name}: {runs[-1]}", file=sys.stderr, flush=True)
    return found


def middle(runs: list[dict[str, Any]], name: str) -> float:
    """Return the median of a figure; a run that was not solved counts as endless."""
    return statistics.median(NEVER if one[name] is None else one[name] for one in runs)


def table(found: dict[str, dict[str, list[dict[str, Any]]]]) -> str:
    """Return the table as Markdown, medians with every seed beside them."""
    lines = [
        "| world | who | solved | seconds, median | processor seconds, median | over ours | seconds of each seed |",
        "|---|---|---|---|---|---|---|",
    ]
    for world, peers in found.items():
        ours = middle(peers[OURS], "processor_seconds")
        for peer, runs in peers.items():
            solved = sum(one["seconds"] is not None for one in runs)
            seconds, spent = middle(runs, "seconds"), middle(runs, "processor_seconds")
            over = "-" if peer == OURS else f"{spent / ours:.2f}×" if ours < NEVER else "?"
            each = ", ".join("not solved" if one["seconds"] is None else f"{one['seconds']:g}" for one in runs)
            lines.append(f"| {world} | {peer} | {solved} of {len(runs)} | {seconds:g} | {spent:g} | {over} | {each} |")
    return "\n".join(lines)


def kept(results: Path) -> dict[str, Any]:
    """Return what was kept of earlier races, world by world."""
    return json.loads(results.read_text("utf-8")) if results.exists() else {}


def keep(found: dict[str, dict[str, list[dict[str, Any]]]], load: float) -> None:
    """Keep these races beside those on other worlds, and write the page of all."""
    when = f"{date.today()}, {os.cpu_count()} cores, load at the beginning {load:.1f}"
    worlds = kept(RESULTS) | {world: {"when": when, "runs": runs} for world, runs in found.items()}
    RESULTS.write_text(json.dumps(worlds, indent=1) + "\n", encoding="utf-8")
    measured = [f"* {world}: {told['when']}" for world, told in worlds.items()]
    races = table({world: told["runs"] for world, told in worlds.items()})
    lines = [
        TITLE,
        "",
        f"<!-- Written by benchmarks/{Path(__file__).name}. -->",
        "",
        BEGINS,
        "",
        races,
        "",
        *measured,
        "",
    ]
    PAGE.write_text("\n".join(lines), encoding="utf-8")


def main() -> None:
    """Race, write the numbers, print the table."""
    options = argparse.ArgumentParser(description=__doc__.split("\n")[0] if __doc__ else "")
    options.add_argument("--worlds", default=",".join(CONTESTS), help="names with commas between")
    options.add_argument("--seeds", type=int, default=5)
    options.add_argument("--minutes", type=float, default=10.0, help="of each run; who needs longer has not solved it")
    options.add_argument(
        "--keep", action="store_true", help="write peers.json and peers.md, other worlds left as they are"
    )
    options.add_argument("--rllib", metavar="PYTHON", help="of an environment with ray[rllib]; RLlib races as well")
    options.add_argument("--cleanrl", nargs=2, metavar=("PYTHON", "FOLDER"), help="CleanRL's single files race as well")
    asked = options.parse_args()
    worlds = asked.worlds.split(",")
    if unknown := [world for world in worlds if world not in CONTESTS]:
        options.error(f"no contest on {', '.join(unknown)}; there are {', '.join(CONTESTS)}")
    peers = [Peer(OURS, sys.executable), Peer(SB3, sys.executable)]
    peers += [Peer(RLLIB, asked.rllib)] if asked.rllib else []
    peers += [Peer(CLEANRL, asked.cleanrl[0], ("--folder", asked.cleanrl[1]))] if asked.cleanrl else []
    load = os.getloadavg()[0]
    found = race(peers, worlds, asked.seeds, asked.minutes)
    if asked.keep:
        keep(found, load)
    print(table(found))


if __name__ == "__main__":
    main()
