"""What workers of a cluster add and cost on this machine, and what that says of many machines, on paper.

    python benchmarks/cluster.py            measure (some minutes; wants a quiet machine), write json and page
    python benchmarks/cluster.py --page     write the page again from what was measured

Cars and snakes are trained by their default settings, evaluations out, one thread a process: in one process, with one
worker on one node, with two that share its worlds, and with two that each have as many worlds as the one. All take
turns. What is counted is collecting and learning (`seconds_collect`, `seconds_learn` of metrics.jsonl), from the third
iteration on, and of collecting the processor time of the workers and of the process that waits for them, which tells
the same where others are at work on the machine. Neither knows of a neighbour beyond it: a rented core is often half
of one, and the same work takes longer while the other half is at work. So every round also asks what two processes
that have nothing to do with each other reach over one (`twice`), and iterations are told one by one, for whoever is
disturbed now and then has undisturbed ones, too. Needs the extra `cluster`.
"""

from __future__ import annotations

import contextlib
import json
import os
import platform
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterable, Iterator
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

HERE = Path(__file__).resolve().parent
RESULTS = HERE / "cluster.json"
PAGE = HERE / "cluster.md"
ROUNDS, WARM_UP = 5, 2
ITERATIONS = {"cars": 42, "snakes": 10}
HANDS = {"none": (None, 1), "1": ("1", 1), "2": ("2", 1), "2 of as many": ("2", 2)}
"""What is measured, by name: how many workers, and how many times the worlds of one process."""
NODES = (1, 2, 10, 100, 1_000)
CORES = 16
"""Cores of a node on paper, a worker each."""
LINK = 1.25e9
"""Bytes a second into the learner's machine on paper: 10 gigabit."""
QUICK = 4
"""The quickest one of so many iterations of a run are taken for undisturbed."""
COUNTING = """
import time
rates = []
for _ in range(40):
    began, total = time.perf_counter(), 0
    for number in range(1_500_000):
        total += number
    rates.append(1 / (time.perf_counter() - began))
print(sum(rates) / len(rates))
"""
"""Work that needs a core and hardly any memory: numbers are added up; prints how often a second."""


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
    processor: float = 0.0
    """Seconds of the processor that workers collected, added up."""
    here: float = 0.0
    """Seconds of the processor that it took the training's own thread to ask and to take in."""
    own: float = 0.0
    """Seconds of the processor that the training's own process took for everything, files and `here` among it."""
    workers: int = 1
    bytes_in: float = 0.0
    """For each step."""
    bytes_out: float = 0.0
    """For each worker and iteration."""
    collects: tuple[float, ...] = ()
    """Seconds of `collect`, iteration by iteration."""

    @property
    def rate(self) -> float:
        """Steps a second, collecting and learning."""
        return self.steps / (self.collect + self.learn)

    @property
    def rate_undisturbed(self) -> float:
        """Steps a second, collecting and learning, were every process's core its own: by processor time."""
        return self.steps / (self.processor / self.workers + self.own)

    @property
    def collecting(self) -> float:
        """Steps a second of collecting alone."""
        return self.steps / self.collect

    @property
    def collecting_undisturbed(self) -> float:
        """Steps a second of collecting alone, were every worker's core its own: by processor time."""
        return self.steps / (self.processor / self.workers + self.here)

    @property
    def collecting_quick(self) -> float:
        """Steps a second of collecting alone, by the clock, in the quickest iterations."""
        quick = sorted(self.collects)[: max(1, len(self.collects) // QUICK)]
        return self.steps / self.iterations * len(quick) / sum(quick)


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
    found: dict[str, Any] = {name: {hands: [] for hands in HANDS} for name in ITERATIONS}
    reached: list[float] = []
    for turn in range(rounds):
        reached.append(twice())
        print(f"{turn + 1}/{rounds} two processes over one: {reached[-1]:.2f}", flush=True)
        for name, by in found.items():
            for hands, rows in by.items():
                one = trained(name, *HANDS[hands])
                rows.append(asdict(one))
                load.append(os.getloadavg()[0])
                print(f"{turn + 1}/{rounds} {name}, workers: {hands}: {one.rate:,.0f} steps/s", flush=True)
    machine = {"processor": platform.machine(), "system": platform.system(), "cores": os.cpu_count()}
    told = {"machine": machine, "measured": time.strftime("%Y-%m-%d"), "load": [min(load), max(load)], "twice": reached}
    return {**told, "rounds": rounds, "worlds": found}


def twice() -> float:
    """Return how often as much work two processes do at the same time as one does, both the same, neither waiting."""

    def rate(processes: int) -> float:
        begun = [
            subprocess.Popen([sys.executable, "-c", COUNTING], stdout=subprocess.PIPE, text=True)
            for _ in range(processes)
        ]
        return sum(float(one.communicate()[0]) for one in begun)

    return rate(2) / rate(1)


def trained(name: str, workers: str | None, times: int) -> Measured:
    """Train for some iterations with so many times the worlds, and return what the later ones took."""
    from racecraft.cluster.distribute import distribute
    from racecraft.training.callbacks import NullCallback
    from racecraft.training.worlds import train

    gatherers: list[Any] = []
    spread = distribute(workers)

    @contextlib.contextmanager
    def watched(kind: str, planned: Any, experiment: Any, on_message: Any) -> Iterator[Any]:
        assert spread is not None
        with spread(kind, planned, experiment, on_message) as settled:
            gatherers.append(settled.gatherer)
            yield settled

    before: list[Any] = []
    worked: list[float] = []

    class Warm(NullCallback):
        def iteration(self, report: Any) -> None:
            """Keep what passed until the clock starts."""
            worked.append(time.process_time())
            if report.iteration == WARM_UP and gatherers:
                before.append(replace(gatherers[0].collecting.traffic))

    with tempfile.TemporaryDirectory() as place:
        run = Path(place) / "run"
        train(request_for(name, run, times), Warm(), lambda text: None, None if spread is None else watched)
        rows = [json.loads(line) for line in (run / "metrics.jsonl").read_text().splitlines()]
    rows = rows[: ITERATIONS[name]]
    later = rows[WARM_UP:]
    steps = later[-1]["steps"] - rows[WARM_UP - 1]["steps"]
    collects = tuple(row["seconds_collect"] for row in later)
    collect, learn = sum(collects), sum(row["seconds_learn"] for row in later)
    own = worked[ITERATIONS[name] - 1] - worked[WARM_UP - 1]
    if not gatherers:
        return Measured(len(later), steps, collect, learn, own=own, collects=collects)
    traffic, count = gatherers[0].collecting.traffic, len(gatherers[0].crew.opened)
    busy, processor, here = (
        getattr(traffic, of) - getattr(before[0], of) for of in ("busy_seconds", "processor_seconds", "here_seconds")
    )
    bytes_in, bytes_out = traffic.bytes_in / traffic.steps, traffic.bytes_out / (len(rows) * count)
    return Measured(len(later), steps, collect, learn, busy, processor, here, own, count, bytes_in, bytes_out, collects)


def request_for(name: str, run: Path, times: int = 1) -> Any:
    """Return a training by default settings, one thread, judged only at its end, and by little.

    Args:
        name: "cars" or "snakes".
        run: Where it lies.
        times: Of the default number of worlds, and of steps between two updates with them.
    """
    words: tuple[str, ...] = ("runtime.threads=1", "evaluation.every=1000", "evaluation.episodes=1")
    if times != 1:
        words += (f"rollout.num_worlds={times * _default_worlds(name, run)}",)
    asked = {"run": run, "stops": (f"iterations={ITERATIONS[name]}",), "overrides": words}
    if name == "cars":
        from racecraft.worlds.deepracer.training.plan import RaceRequest

        return RaceRequest(**asked)
    from racecraft.worlds.battlesnake.env.settings import GameSettings
    from racecraft.worlds.battlesnake.training.trainer import SnakeRequest

    return SnakeRequest(GameSettings(11, 11, 4, "standard", "standard"), **asked)


def _default_worlds(name: str, run: Path) -> int:
    from racecraft.training.worlds import plan

    return int(plan(request_for(name, run)).settings.rollout.num_worlds)


def costs_of(by: dict[str, list[dict[str, float]]]) -> Costs:
    """Return what a step costs, of the medians measured with one worker."""

    def middle(per_step: Any, workers: str = "1") -> float:
        return statistics.median(per_step(Measured(**row)) for row in by[workers])

    return Costs(
        collect=middle(lambda one: one.processor / one.steps),
        take_in=middle(lambda one: one.here / one.steps),
        learn=middle(lambda one: (one.own - one.here) / one.steps),
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
        "By the clock; and by the processor time of every process, each on a core of its own, which tells the same "
        "where others are at work on the machine. The median, and from the lowest to the highest; ratios are of runs "
        "beside each other in time.",
        "",
        "What this machine gives: two processes that only add up numbers and know nothing of each other did "
        f"{_spread(results['twice'], '.2f', '×')} of what one of them does by itself. Less than two times means that "
        "something else, here or beyond this machine, shares its cores.",
        "",
        "## Collecting and learning",
        "",
        "| world | steps/s | in one process | one worker | two sharing its worlds | two, each with as many | one-node "
        "cluster over none |",
        "|---|---|---|---|---|---|---|",
    ]
    every = {
        name: {hands: [Measured(**row) for row in rows] for hands, rows in by.items()}
        for name, by in results["worlds"].items()
    }
    for name, by in every.items():
        for clock, of in (("clock", "rate"), ("processor", "rate_undisturbed")):
            rates = " | ".join(_spread([getattr(one, of) for one in by[hands]], ",.0f") for hands in HANDS)
            pairs = [(getattr(none, of), getattr(one, of)) for none, one in zip(by["none"], by["1"], strict=True)]
            extra = _spread([100 * (none / one - 1) for none, one in pairs], "+.0f", " %")
            lines.append(f"| {name} | {clock} | {rates} | {extra} |")
    lines += [
        "",
        "## Collecting alone: two workers over one",
        "",
        "| world | two over one | sharing its worlds | each with as many | bytes a step | weights |",
        "|---|---|---|---|---|---|",
    ]
    told = (
        ("clock", "collecting"),
        (f"clock, the quickest {1 / QUICK:.0%} of iterations", "collecting_quick"),
        ("processor", "collecting_undisturbed"),
    )
    for name, by in every.items():
        some = by["2"][0]
        sent = f"{some.bytes_in:,.0f} | {some.bytes_out / 1e3:,.0f} kB"
        for clock, of in told:
            gains = [
                _spread([getattr(two, of) / getattr(one, of) for one, two in zip(by["1"], by[hands], strict=True)],
                        ".2f", "×")
                for hands in ("2", "2 of as many")
            ]  # fmt: skip
            lines.append(f"| {name} | {clock} | {' | '.join(gains)} | {sent} |")
    lines += [
        "",
        "Weights go to each worker once an iteration. Half the worlds are not half the work, for every tick costs "
        "something, however few worlds take part:",
        "",
        "| world | processor time a step: one worker | two sharing | two with as many | taken in: one | two sharing | "
        "two with as many | cores that a worker takes |",
        "|---|---|---|---|---|---|---|---|",
    ]
    for name, by in every.items():
        costs = [
            f"{1e6 * _middle(getattr(one, of) / one.steps for one in by[hands]):,.1f} µs"
            for of in ("processor", "here")
            for hands in list(HANDS)[1:]
        ]
        cores = _middle(one.processor / one.busy for hands in list(HANDS)[1:] for one in by[hands])
        lines.append(f"| {name} | {' | '.join(costs)} | {cores:.2f} |")
    lines += [
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


def _middle(values: Iterable[float]) -> float:
    return statistics.median(values)


def _spread(values: list[float], form: str, unit: str = "") -> str:
    low, middle, high = min(values), statistics.median(values), max(values)
    return f"{middle:{form}}{unit} ({low:{form}} – {high:{form}})"


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
