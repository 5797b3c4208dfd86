"""What workers of a cluster add and cost on this machine, and what that says of many machines, on paper.

    python benchmarks/cluster.py            measure (some minutes; wants a quiet machine), write json and page
    python benchmarks/cluster.py --page     write the page again from what was measured

Cars and snakes are trained by their default settings, evaluations out, one thread a process: in one process, with one
worker on one node, and with two. The three take turns. What is counted is collecting and learning (`seconds_collect`,
`seconds_learn` of metrics.jsonl), from the third iteration on. Needs the extra `cluster`.
"""

from __future__ import annotations

import contextlib
import json
import os
import platform
import statistics
import sys
import tempfile
import time
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

HERE = Path(__file__).resolve().parent
RESULTS = HERE / "cluster.json"
PAGE = HERE / "cluster.md"
ROUNDS, WARM_UP = 5, 2
ITERATIONS = {"cars": 14, "snakes": 8}
NODES = (1, 2, 10, 100, 1_000)
CORES = 16
"""Cores of a node on paper, a worker each."""
LINK = 1.25e9
"""Bytes a second into the learner's machine on paper: 10 gigabit."""


@dataclass(frozen=True)
class Measured:
    """One training, steady state."""

    iterations: int
    steps: int
    """Of all these iterations."""
    collect: float
    """Seconds that the training waited for what is collected."""
    learn: float
    """Seconds."""
    busy: float = 0.0
    """Seconds that workers collected, added up; 0 in one process."""
    bytes_in: float = 0.0
    """For each step."""
    bytes_out: float = 0.0
    """For each worker and iteration."""

    @property
    def rate(self) -> float:
        """Steps a second, collecting and learning."""
        return self.steps / (self.collect + self.learn)


@dataclass(frozen=True)
class Costs:
    """What one step costs, by which a cluster is worked out on paper."""

    collect: float
    """Seconds of a worker's core for a step."""
    take_in: float
    """Seconds of the learner's machine to take a step in: unpacked, laid beside the others."""
    learn: float
    """Seconds of the learner's machine to learn from a step."""
    bytes_in: float
    """That come with a step."""
    bytes_out: float
    """That go to a worker for an iteration."""
    steps: float
    """Steps of one worker in an iteration."""


@dataclass(frozen=True)
class OnPaper:
    """A cluster that nobody has measured."""

    nodes: int
    rate: float
    """Steps a second."""
    waits: float
    """Share of an iteration in which workers wait for the learner, 0 to 1."""
    link: float
    """Share of an iteration in which the learner's link is at work, 0 to 1."""
    memory: float
    """Bytes of one iteration's rollout in the learner's machine."""


def on_paper(costs: Costs, nodes: int, cores: int = CORES, link: float = LINK) -> OnPaper:
    """Return what a synchronous training does on so many nodes, each worker with as many steps as it had here.

    Workers collect at the same time; all that they send passes through one link, is taken in and learned from by one
    machine, and they wait for it. So an iteration lasts: a worker's collecting + bytes / link + taking in + learning.

    >>> costs = Costs(collect=1e-4, take_in=1e-6, learn=9e-6, bytes_in=0.0, bytes_out=0.0, steps=1000)
    >>> round(on_paper(costs, nodes=1, cores=1).rate), round(on_paper(costs, nodes=1000, cores=1).rate)
    (9091, 99010)
    """
    workers = nodes * cores
    steps = workers * costs.steps
    collect = costs.steps * costs.collect
    passing = (steps * costs.bytes_in + workers * costs.bytes_out) / link
    learner = steps * (costs.take_in + costs.learn)
    whole = collect + passing + learner
    return OnPaper(nodes, steps / whole, (passing + learner) / whole, passing / whole, steps * costs.bytes_in)


def breaks_at(costs: Costs, link: float = LINK) -> float:
    """Return how many workers there are when they wait as long as they collect; more than twice as many are idle.

    >>> breaks_at(Costs(collect=1e-4, take_in=1e-6, learn=9e-6, bytes_in=0.0, bytes_out=0.0, steps=1000))
    10.0
    """
    each = costs.take_in + costs.learn + (costs.bytes_in + costs.bytes_out / costs.steps) / link
    return round(costs.collect / each, 6)


def main(arguments: list[str]) -> int:
    if "--page" not in arguments:
        rounds = int(arguments[0]) if arguments else ROUNDS
        RESULTS.write_text(json.dumps(measure(rounds), indent=1) + "\n", encoding="utf-8")
    PAGE.write_text(page(json.loads(RESULTS.read_text(encoding="utf-8"))), encoding="utf-8")
    return 0


def measure(rounds: int) -> dict[str, Any]:
    load = [os.getloadavg()[0]]
    found: dict[str, Any] = {name: {"none": [], "1": [], "2": []} for name in ITERATIONS}
    for turn in range(rounds):
        for name, by in found.items():
            for workers, rows in by.items():
                one = trained(name, None if workers == "none" else workers)
                rows.append(asdict(one))
                load.append(os.getloadavg()[0])
                print(f"{turn + 1}/{rounds} {name}, workers: {workers}: {one.rate:,.0f} steps/s", flush=True)
    machine = {"processor": platform.machine(), "system": platform.system(), "cores": os.cpu_count()}
    told = {"machine": machine, "measured": time.strftime("%Y-%m-%d"), "load": [min(load), max(load)]}
    return {**told, "rounds": rounds, "worlds": found}


def trained(name: str, workers: str | None) -> Measured:
    """Train for some iterations and return what the later ones took."""
    from racecraft.cluster.spreading import spread_over
    from racecraft.training.callbacks import Silent
    from racecraft.training.worlds import train

    gatherers: list[Any] = []
    spread = spread_over(workers)

    @contextlib.contextmanager
    def watched(kind: str, planned: Any, experiment: Any, say: Any) -> Iterator[Any]:
        assert spread is not None
        with spread(kind, planned, experiment, say) as settled:
            gatherers.append(settled.gatherer)
            yield settled

    with tempfile.TemporaryDirectory() as place:
        run = Path(place) / "run"
        train(request_for(name, run), Silent(), lambda text: None, None if spread is None else watched)
        rows = [json.loads(line) for line in (run / "metrics.jsonl").read_text().splitlines()]
    rows = rows[: ITERATIONS[name]]
    later = rows[WARM_UP:]
    steps = later[-1]["steps"] - rows[WARM_UP - 1]["steps"]
    collect, learn = (sum(row[f"seconds_{phase}"] for row in later) for phase in ("collect", "learn"))
    if not gatherers:
        return Measured(len(later), steps, collect, learn)
    traffic = gatherers[0].collecting.traffic
    busy = traffic.busy_seconds * steps / traffic.steps
    asked = len(rows) * len(gatherers[0].crew.opened)
    return Measured(
        len(later), steps, collect, learn, busy, traffic.bytes_in / traffic.steps, traffic.bytes_out / asked
    )


def request_for(name: str, run: Path) -> Any:
    """Return a training by default settings, one thread, judged only at its end, and by little."""
    words = ("runtime.threads=1", "evaluation.every=1000", "evaluation.episodes=1")
    asked = {"run": run, "stops": (f"iterations={ITERATIONS[name]}",), "overrides": words}
    if name == "cars":
        from racecraft.training.deepracer.plan import RaceRequest

        return RaceRequest(**asked)
    from racecraft.envs.battlesnake.settings import GameSettings
    from racecraft.training.battlesnake.trainer import SnakeRequest

    return SnakeRequest(GameSettings(11, 11, 4, "standard", "standard"), **asked)


def costs_of(by: dict[str, list[dict[str, float]]]) -> Costs:
    """Return what a step costs, of the medians measured with one worker."""

    def middle(per_step: Any, workers: str = "1") -> float:
        return statistics.median(per_step(Measured(**row)) for row in by[workers])

    return Costs(
        collect=middle(lambda one: one.busy / one.steps),
        take_in=max(0.0, middle(lambda one: (one.collect - one.busy) / one.steps)),
        learn=middle(lambda one: one.learn / one.steps),
        bytes_in=middle(lambda one: one.bytes_in),
        bytes_out=middle(lambda one: one.bytes_out),
        steps=middle(lambda one: one.steps / one.iterations),
    )


def page(results: dict[str, Any]) -> str:
    """Return the page of what was measured, and of what it says on paper."""
    machine, load = results["machine"], results["load"]
    lines = [
        "# What a cluster does, measured and on paper",
        "",
        "<!-- Written by benchmarks/cluster.py from benchmarks/cluster.json. -->",
        "",
        f"Measured {results['measured']} on {machine['cores']} cores ({machine['system']}, {machine['processor']}), "
        f"{results['rounds']} rounds in turns; the machine's load was {load[0]:.1f} to {load[1]:.1f} meanwhile, and "
        f"above {machine['cores']} it had more to do than this.",
        "",
        "| world | in one process | one worker | two workers | one-node cluster over none | two workers over one, "
        "collecting | bytes a step | weights |",
        "|---|---|---|---|---|---|---|---|",
    ]
    for name, by in results["worlds"].items():
        every = {workers: [Measured(**row) for row in rows] for workers, rows in by.items()}
        rates = {workers: _spread([one.rate for one in rows], ",.0f") for workers, rows in every.items()}
        pairs = list(zip(every["none"], every["1"], every["2"], strict=True))
        extra = _spread([100 * (none.rate / one.rate - 1) for none, one, _ in pairs], "+.0f", " %")
        gain = _spread([(two.steps / two.collect) / (one.steps / one.collect) for _, one, two in pairs], ".2f", "×")
        some = every["2"][0]
        lines.append(
            f"| {name} | {rates['none']} | {rates['1']} | {rates['2']} | {extra} | {gain} | {some.bytes_in:,.0f} | "
            f"{some.bytes_out / 1e3:,.0f} kB |"
        )
    lines += [
        "",
        "Steps a second of collecting and learning: the median, and from the lowest to the highest. Ratios are of runs "
        "beside each other in time. Weights go to each worker once an iteration.",
        "",
        "## On paper",
        "",
        f"A node is {CORES} cores with a worker each, which has as many steps an iteration as the one worker above; "
        f"the learner's machine has a link of {LINK * 8 / 1e9:.0f} gigabit a second and learns as fast as this one. "
        "Bytes and times are medians of the runs with one worker; `on_paper` in `benchmarks/cluster.py` is all of it.",
        "",
    ]
    for name, by in results["worlds"].items():
        costs = costs_of(by)
        lines += [
            f"**{name}**: a step costs {costs.collect * 1e6:,.1f} µs of a worker's core, "
            f"{costs.take_in * 1e6:,.1f} µs to take in and {costs.learn * 1e6:,.1f} µs to learn from. Workers wait as "
            f"long as they collect when there are {breaks_at(costs):,.1f} of them.",
            "",
            "| nodes | workers | steps/s | workers wait | the link is at work | one rollout |",
            "|---|---|---|---|---|---|",
        ]
        for nodes in NODES:
            one = on_paper(costs, nodes)
            lines.append(
                f"| {nodes:,} | {nodes * CORES:,} | {one.rate:,.0f} | {one.waits:.0%} | {one.link:.0%} | "
                f"{one.memory / 2**20:,.0f} MiB |"
            )
        lines.append("")
    return "\n".join(lines)


def _spread(values: list[float], form: str, unit: str = "") -> str:
    low, middle, high = min(values), statistics.median(values), max(values)
    return f"{middle:{form}}{unit} ({low:{form}} – {high:{form}})"


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
