"""The racer's own expectations of a reward, as small cases in a TOML file. Begin with `run_cases`.

    track = "reinvent_base"

    [[case]]
    name = "the centre line pays more than the border"
    here = { share = 0.1, offset_m = 0.0, speed_mps = 2.0 }
    more_than = { share = 0.1, offset_m = 0.3, speed_mps = 2.0 }

    [[case]]
    name = "beside the road pays next to nothing"
    here = { offset_m = 0.8 }
    at_most = 0.01

A place is a share of the lap, an offset from the centre line (m, left positive), a heading against the road's (degrees,
left positive), a commanded speed (m/s) and steering (degrees, left positive), and `ticks` since the start.
"""

from __future__ import annotations

import tomllib
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any

import numpy as np

from racecraft.contract.errors import InputFileError, nearest
from racecraft.contract.message import Message
from racecraft.contract.world import Array
from racecraft.formats.user_file import read_user_file
from racecraft.worlds.deepracer.driving.reward.paying import Payer
from racecraft.worlds.deepracer.driving.reward.poses import one_tick_behind, place_on_road, reports_of
from racecraft.worlds.deepracer.env.vehicle import TICK_SECONDS
from racecraft.worlds.deepracer.tracks.catalogue import load_track
from racecraft.worlds.deepracer.tracks.track import Track

CASES = "reward_test.toml"
"""Name of the file beside a reward function."""
KIND = "a TOML file with [[case]] tables"
EXPECTATIONS = ("pays", "at_least", "at_most", "more_than", "less_than")
TOLERANCE = 1e-9
MAX_BYTES = 1 << 20


@dataclass(frozen=True)
class Situation:
    """Where a car is and what it is told."""

    share: float = 0.1
    """Of the lap, 0 to 1."""
    offset_m: float = 0.0
    """From the centre line, left positive."""
    heading_degrees: float = 0.0
    """Against the direction of the road, left positive."""
    speed_mps: float = 1.0
    steering_degrees: float = 0.0
    """Left positive."""
    ticks: float = 30.0
    """Since the start; the tick before is paid first, so that rewards that keep state can be tried."""

    def rows(self, track: Track) -> Array:
        """Return the tick before and this one, TICK_REPORT (2,)."""
        now = place_on_road(
            track, [self.share * track.length], [self.offset_m], [np.radians(self.heading_degrees)],
            np.radians(self.steering_degrees), self.speed_mps,
        )  # fmt: skip
        rows = np.concatenate([reports_of(track, one, laps=False) for one in (one_tick_behind(now), now)])
        rows["steps"] = (self.ticks - 1.0, self.ticks)
        rows["time"] = rows["steps"] * TICK_SECONDS
        return rows


@dataclass(frozen=True)
class Case:
    """One expectation."""

    name: str
    here: Situation
    expectation: str
    """One of EXPECTATIONS."""
    bound: float | Situation


@dataclass(frozen=True)
class Result:
    """What came of a case."""

    case: Case
    passed: bool
    text: str
    """What was paid and what was expected."""


def read_cases(path: Path) -> tuple[Track, list[Case]]:
    """Read a file of cases.

    Raises:
        InputFileError: It is no such file, or a case has an unknown key or not exactly one expectation.
        TrackError: There is no track of that name.
    """
    data = read_user_file(path, InputFileError, KIND, "`racecraft reward test --help` shows one.", MAX_BYTES)
    try:
        table = tomllib.loads(data.decode("utf-8"))
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise InputFileError(path, Message("no TOML ({error})", error=error), KIND) from None
    unknown = [key for key in table if key not in ("track", "case")]
    cases = table.get("case", [])
    if unknown or not isinstance(cases, list) or not cases:
        found = Message("an unknown key `{key}`", key=unknown[0]) if unknown else "no [[case]]"
        raise InputFileError(path, found, KIND)
    return load_track(str(table.get("track", "reinvent_base"))), [_case(path, one) for one in cases]


def run_cases(path: Path, payer: Payer) -> list[Result]:
    """Pay the places of every case, and compare.

    Raises:
        InputFileError: The file cannot be used; see `read_cases`.
        RewardError: The reward function hangs or ends its process.
    """
    track, cases = read_cases(path)
    return [_run(case, track, payer) for case in cases]


def _case(path: Path, table: Any) -> Case:
    name = str(table.get("name", "a case without a name")) if isinstance(table, dict) else ""
    if not isinstance(table, dict):
        raise InputFileError(path, Message("a case that is {found!r}", found=table), KIND)
    expectations = [key for key in table if key in EXPECTATIONS]
    for key in table:
        if key not in ("name", "here", *EXPECTATIONS):
            expected = Message("name, here and one of {names}", names=", ".join(EXPECTATIONS))
            hint = nearest(key, ("here", *EXPECTATIONS))
            raise InputFileError(path, Message("an unknown key `{key}`", key=key), expected, hint, key=name)
    if len(expectations) != 1:
        found = Message("{count} expectations", count=len(expectations))
        raise InputFileError(path, found, Message("exactly one of {names}", names=", ".join(EXPECTATIONS)), key=name)
    bound = table[expectations[0]]
    if expectations[0] in ("more_than", "less_than"):
        bound = _place(path, name, bound)
    elif isinstance(bound, bool) or not isinstance(bound, int | float):
        raise InputFileError(
            path, Message("`{key} = {found!r}`", key=expectations[0], found=bound), "a number", key=name
        )
    return Case(name, _place(path, name, table.get("here", {})), expectations[0], bound)


def _place(path: Path, name: str, table: Any) -> Situation:
    known = [field.name for field in fields(Situation)]
    if not isinstance(table, dict):
        found = Message("a place that is {found!r}", found=table)
        raise InputFileError(path, found, Message("a table such as {example}", example="{ share = 0.1 }"), key=name)
    for key, value in table.items():
        if key not in known:
            expected = Message("some of {names}", names=", ".join(known))
            found = Message("an unknown key `{key}` of a place", key=key)
            raise InputFileError(path, found, expected, nearest(key, known), key=name)
        if isinstance(value, bool) or not isinstance(value, int | float) or not np.isfinite(value):
            raise InputFileError(path, Message("`{key} = {found!r}`", key=key, found=value), "a number", key=name)
    return Situation(**{key: float(value) for key, value in table.items()})


def _run(case: Case, track: Track, payer: Payer) -> Result:
    paid = _paid(case.here, track, payer)
    if isinstance(case.bound, Situation):
        other = _paid(case.bound, track, payer)
        words = {"more_than": "more than", "less_than": "less than"}[case.expectation]
        passed = paid > other if case.expectation == "more_than" else paid < other
        return Result(case, bool(passed), f"pays {paid:.6g}; expected {words} {other:.6g}, which the other place pays")
    passed = {
        "pays": abs(paid - case.bound) <= TOLERANCE * max(1.0, abs(case.bound)),
        "at_least": paid >= case.bound, "at_most": paid <= case.bound,
    }[case.expectation]  # fmt: skip
    words = {"pays": "exactly", "at_least": "at least", "at_most": "at most"}[case.expectation]
    return Result(case, bool(passed), f"pays {paid:.6g}; expected {words} {case.bound:g}")


def _paid(place: Situation, track: Track, payer: Payer) -> float:
    """Return what a place pays; NaN, which meets no expectation, where the function failed."""
    return float(payer.compute_rewards(track, place.rows(track)).rewards[1])
