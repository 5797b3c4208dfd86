"""Everything that can be said of a reward function before a training. Begin with `check_reward`.

text        units, comparisons that never hold, imports
moments     200 situations: what raises, what is no number, which lines never run
tricks      what pays more than lapping
speed       whether fast or slow laps earn more
probes      signs that are turned
ablation    lines without effect, lines that drown others
"""

from __future__ import annotations

import io
import re
import time
import types
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from racecraft.contract.errors import RewardError, nearest
from racecraft.contract.message import figure
from racecraft.contract.world import Array
from racecraft.worlds.deepracer.driving.reward.ablation import Cut, ablate, ablation_findings
from racecraft.worlds.deepracer.driving.reward.branches import dead_branches
from racecraft.worlds.deepracer.driving.reward.findings import FAULT, NOTE, Finding
from racecraft.worlds.deepracer.driving.reward.paying import Failure, Pay, Payer
from racecraft.worlds.deepracer.driving.reward.probes import probe
from racecraft.worlds.deepracer.driving.reward.situations import made_up, situations
from racecraft.worlds.deepracer.driving.reward.speed import LAPPING, SpeedVerdict, judge_speed
from racecraft.worlds.deepracer.driving.reward.stock import read_stock
from racecraft.worlds.deepracer.driving.reward.tricks import LEAVING_AT_ONCE, Trick, try_tricks
from racecraft.worlds.deepracer.driving.reward.units import unit_slips
from racecraft.worlds.deepracer.env.reward_params import REWARD_PARAMETERS
from racecraft.worlds.deepracer.env.reward_process import RewardProcess, open_reward
from racecraft.worlds.deepracer.files.reward_analysis import NO_OBJECTS
from racecraft.worlds.deepracer.files.reward_source import RewardSource, read_reward_source
from racecraft.worlds.deepracer.tracks.track import Track

STRIDE = 3
"""Of a fast, a middling and a clumsy drive every third row is paid without each line in turn."""
TIMED_ROWS = 1500
VARIANT_SECONDS = 1.0
"""So long a reward without one of its lines may take for all moments."""


@dataclass(frozen=True, eq=False)
class RewardCheck:
    """What was found."""

    source: RewardSource
    findings: tuple[Finding, ...]
    """Faults first, then by line."""
    situations: int
    """How many moments it was called on."""
    lowest: float | None
    """Over the moments; None where none was paid."""
    highest: float | None
    microseconds: float
    """A call takes, the making of its dictionary aside."""
    tricks: tuple[Trick, ...]
    speed: SpeedVerdict | None
    """None where laps could not be paid."""
    cuts: tuple[Cut, ...]
    laps: tuple[tuple[str, float, float], ...] = ()
    """Of every lap of the stock its track, its time (s) and its summed reward."""

    @property
    def faults(self) -> int:
        """How many of the findings are faults."""
        return sum(finding.level == FAULT for finding in self.findings)

    @property
    def cost(self) -> str:
        """How long a call takes, with its unit."""
        return f"{self.microseconds:.1f} µs" if self.microseconds >= 0.05 else "less than 0.1 µs"

    def as_dictionary(self) -> dict[str, Any]:
        """Return it ready for JSON."""
        return {
            "file": str(self.source.path),
            "faults": self.faults,
            "findings": [finding.as_dictionary() for finding in self.findings],
            "situations": self.situations,
            "lowest": self.lowest,
            "highest": self.highest,
            "microseconds_a_call": round(self.microseconds, 2),
            "tricks": [
                {"name": one.name, "pays": one.pays, "lap_pays": one.lap_pays, "in_sum": one.is_sum,
                 "pays_more": one.pays_more} for one in self.tricks
            ],
            "speed": None if self.speed is None else self.speed.as_dictionary(),
            "laps": [{"track": track, "seconds": seconds, "pays": pays} for track, seconds, pays in self.laps],
        }  # fmt: skip


def check_reward(path: str | Path | RewardSource, for_race: bool = False) -> RewardCheck:
    """Check a reward function.

    Args:
        path: The racer's file, or what was read of it.
        for_race: Whether a reward by which slow laps earn more is a fault rather than a note.

    Raises:
        RewardFileError: The file cannot be loaded.
        RewardError: The function hangs or ends its process.
    """
    source = path if isinstance(path, RewardSource) else read_reward_source(path)
    process = open_reward(source, output=io.StringIO())
    try:
        return _Checking(source, process, for_race).result()
    finally:
        process.close()


class _Variants:
    """Pays changed sources in a process of their own, which a change may hang: it is then opened anew."""

    def __init__(self, source: RewardSource) -> None:
        self._source = source
        self._process: RewardProcess | None = None

    def __enter__(self) -> _Variants:
        return self

    def __exit__(self, *error: object) -> None:
        self._close()

    def compute_rewards(self, variant: RewardSource, track: Track, moments: Array) -> Array:
        """Return what a changed source pays.

        Raises:
            RewardFileError: It cannot be loaded.
            RewardError: It hangs or ends its process.
        """
        if self._process is None:
            self._process = open_reward(self._source, output=io.StringIO(), seconds=VARIANT_SECONDS)
        try:
            return Payer(self._process, self._process.variant(variant)).compute_rewards(track, moments).rewards
        except RewardError:
            self._close()
            raise

    def _close(self) -> None:
        if self._process is not None:
            self._process.close()
            self._process = None


class _Checking:
    """One check, step by step."""

    def __init__(self, source: RewardSource, process: RewardProcess, for_race: bool) -> None:
        self._source, self._process, self._for_race = source, process, for_race
        self._stock = read_stock()
        self._findings: list[Finding] = []

    def result(self) -> RewardCheck:
        self._text()
        paid, lines = self._moments()
        drives: list[Pay] = []
        if not np.isnan(paid).all():
            drives = [self._fresh().compute_rewards(drive.track, drive.reports) for drive in self._stock]
        microseconds = self._cost()
        is_drivable = bool(drives) and not any(pay.failures for pay in drives)
        for drive, pay in zip(self._stock, drives, strict=False):
            self._failures(pay.failures, lambda failure, drive=drive: f"{drive.title}, row {failure.row}")
        tricks: list[Trick] = []
        speed: SpeedVerdict | None = None
        cuts: list[Cut] = []
        laps: list[tuple[str, float, float]] = []
        if is_drivable:
            sums = [float(pay.rewards.sum()) for pay in drives]
            laps = [
                (drive.track.name, drive.seconds, total)
                for drive, total in zip(self._stock, sums, strict=True)
                if drive.is_lap
            ]
            speed = self._speed(laps)
            tricks = self._tricks(sums)
            self._findings += probe(self._fresh, self._stock)
            cuts = self._ablation(lines)
        self._unused(lines)
        self._constant(paid, drives)
        findings = sorted(set(self._findings), key=lambda one: (one.level != FAULT, one.line or 10**6, one.text))
        earned = paid[~np.isnan(paid)]
        lowest, highest = (float(earned.min()), float(earned.max())) if earned.size else (None, None)
        return RewardCheck(
            self._source, tuple(findings), len(paid), lowest, highest, microseconds, tuple(tricks), speed, tuple(cuts),
            tuple(laps),
        )  # fmt: skip

    def _fresh(self) -> Payer:
        return Payer(self._process)

    @property
    def _reads_objects(self) -> bool:
        return any(NO_OBJECTS in remark.text for remark in self._source.analysis.remarks)

    def _text(self) -> None:
        """Read the text alone."""
        tree = self._source.tree
        self._findings += [*unit_slips(tree), *dead_branches(tree)]
        for remark in self._source.analysis.remarks:
            level = FAULT if "never holds" in remark.text else NOTE
            self._findings.append(Finding(level, "text", remark.text, line=remark.line))

    def _moments(self) -> tuple[Array, frozenset[int]]:
        """Call it on every moment; return what it paid, and which lines ran."""
        paid: list[Array] = []
        lines: set[int] = set()
        for part in situations(self._stock):
            pay = self._fresh().compute_rewards(part.track, part.reports, is_traced=True, is_reversed=part.is_reversed)
            self._failures(pay.failures, lambda failure, part=part: part.titles[failure.row])
            paid.append(pay.rewards)
            lines |= pay.lines
        titles, dictionaries = zip(*made_up(), strict=True)
        pay = self._fresh().call(iter(dictionaries))
        self._failures(pay.failures, lambda failure: titles[failure.row])
        return np.concatenate([*paid, pay.rewards]), frozenset(lines)

    def _failures(self, failures: tuple[Failure, ...], title_of: Any) -> None:
        """Keep the first failure of every line and kind."""
        for failure in failures:
            if any(one.kind == "raises" and one.line == failure.line for one in self._findings):
                continue
            count = sum(other.line == failure.line for other in failures)
            more = f" and {count - 1} more" if count > 1 else ""
            self._findings.append(
                Finding(FAULT, "raises", f"reward_function {failure.message} ({title_of(failure)}{more})",
                        _remedy(failure), failure.line)
            )  # fmt: skip

    def _speed(self, laps: list[tuple[str, float, float]]) -> SpeedVerdict:
        verdict = judge_speed(laps)
        if verdict.teaches == LAPPING:
            level = FAULT if self._for_race else NOTE
            hint = "Pay for metres gained, or for the square of the speed; see `racecraft reward samples`."
            self._findings.append(Finding(level, "speed", verdict.sentence, hint))
        return verdict

    def _tricks(self, sums: list[float]) -> list[Trick]:
        tricks = try_tricks(self._fresh(), self._stock, sums)
        for trick in tricks:
            if not trick.pays_more:
                continue
            hint = "Pay for what brings the car forward."
            if trick.name == LEAVING_AT_ONCE and trick.lap_pays < 0.0:
                hint = (
                    "Every tick costs, so the shortest episode is the best: pay for metres, or make leaving cost more."
                )
            self._findings.append(
                Finding(FAULT, "trick", f"{trick.name} pays {figure(trick.pays)} {trick.unit}, and the best paid "
                        f"lap {figure(trick.lap_pays)}", hint)
            )  # fmt: skip
        return tricks

    def _ablation(self, lines: frozenset[int]) -> list[Cut]:
        track = self._stock[0].track
        laps = [drive for drive in self._stock if drive.track is track]
        rows = [laps[k].reports[::STRIDE] for k in (0, len(laps) // 2, -1)]
        edges = [part.reports for part in situations(self._stock) if part.track is track]
        moments = np.concatenate([*rows, *edges])
        once, again = (self._fresh().compute_rewards(track, moments).rewards for _ in range(2))
        if not np.array_equal(once, again, equal_nan=True):
            self._findings.append(Finding(NOTE, "random", "the same moments are paid differently a second time: the "
                                  "reward draws random numbers or reads a clock"))  # fmt: skip
            return []

        with _Variants(self._source) as variants:
            cuts = ablate(self._source, lines, lambda variant: variants.compute_rewards(variant, track, moments), once)
        self._findings += [
            one for one in ablation_findings(cuts, once) if not (self._reads_objects and one.kind == "no effect")
        ]
        return cuts

    def _unused(self, lines: frozenset[int]) -> None:
        """Name the lines that no moment reached, neighbours together; those about objects cannot be told."""
        if self._reads_objects:
            return
        never = sorted(set(_lines_of(self._source.code)) - lines)
        for first, last in _runs(never, self._source.text.splitlines()):
            where = f"line {first} never runs" if first == last else f"lines {first} to {last} never run"
            text = self._source.text.splitlines()[first - 1].strip()
            self._findings.append(
                Finding(NOTE, "never runs", f"{where} in any of the moments: `{text[:60]}`",
                        "Look at the condition in front of it.", first)
            )  # fmt: skip

    def _constant(self, paid: Array, drives: list[Pay]) -> None:
        values = np.concatenate([paid, *(pay.rewards for pay in drives)])
        values = values[np.isfinite(values)]
        if len(values) and values.min() == values.max():
            self._findings.append(
                Finding(NOTE, "constant", f"every moment is paid {values[0]:g}: the car learns only to go on",
                        "Pay more for what you want more of.")
            )  # fmt: skip

    def _cost(self) -> float:
        """Return what a call takes, µs: the fastest of four rounds, less the same with a function that does nothing."""
        nothing = replace(self._source, text="def reward_function(params):\n    return 0.0\n", modules={})
        track = self._stock[0].track
        rows = np.concatenate([drive.reports for drive in self._stock if drive.track is track])[:TIMED_ROWS]

        def seconds(payer: Payer) -> float:
            began = time.perf_counter()
            payer.compute_rewards(track, rows)
            return time.perf_counter() - began

        payers = self._fresh(), Payer(self._process, self._process.variant(nothing))
        mine, none = (min(times) for times in zip(*([seconds(p) for p in payers] for _ in range(4)), strict=True))
        return max(0.0, mine - none) / len(rows) * 1e6


def _lines_of(code: types.CodeType) -> Iterator[int]:
    """Yield the lines of the functions of a file, their `def` aside."""
    for inner in code.co_consts:
        if isinstance(inner, types.CodeType):
            if not inner.co_name.startswith("<") and inner.co_flags & 1:  # optimised: a function
                yield from (line for *_, line in inner.co_lines() if line is not None and line != inner.co_firstlineno)
            yield from _lines_of(inner)


def _runs(lines: list[int], text: list[str]) -> Iterator[tuple[int, int]]:
    """Yield first and last of lines that follow one another, blank lines and comments between them aside."""
    group: list[int] = []
    for line in lines:
        between = text[group[-1] : line - 1] if group else []
        if group and any(part.strip() and not part.strip().startswith("#") for part in between):
            yield group[0], group[-1]
            group = []
        group.append(line)
    if group:
        yield group[0], group[-1]


def _remedy(failure: Failure) -> str:
    """Return what to do about a moment that cannot be paid: a parameter's right name, or a guard."""
    missing = re.search(r"KeyError: '(\w+)'", failure.message)
    if missing and missing[1] not in REWARD_PARAMETERS:
        return f"There is no parameter '{missing[1]}'. {nearest(missing[1], REWARD_PARAMETERS)}"
    return "Guard the line against this moment."
