"""A drive in a race, beside another one's: where it loses time, both as ghosts on the map. Begin with `drive_page`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from racecraft.contract.errors import SettingError
from racecraft.contract.world import Array
from racecraft.worlds.deepracer.analysis.telemetry_page import telemetry_data
from racecraft.worlds.deepracer.driving.telemetry.laps import find_laps
from racecraft.worlds.deepracer.driving.telemetry.losses import compare_lap
from racecraft.worlds.deepracer.driving.telemetry.reference import of_best_zones, of_lap
from racecraft.worlds.deepracer.driving.telemetry.timing import LapTiming, time_laps
from racecraft.worlds.deepracer.league.replay import REPLAY
from racecraft.worlds.deepracer.logs import read
from racecraft.worlds.deepracer.tracks.catalogue import load_track

OWN = "own"
"""A lap is compared with the best corners of the same drive."""
CHOICES = 20
"""Other drives that can be chosen, the leader's first."""


def drive_page(
    rules: Mapping[str, Any], track: str, drives: Sequence[tuple[str, Path, int]], query: Mapping[str, str]
) -> dict[str, Any]:
    """Return what the page of a drive shows; `told` is None where it has no full lap.

    Args:
        rules: Of the race.
        track: Where it was driven.
        drives: Racer, folder and seat in the heat: of the drive itself, and of the others, the leader's first.
        query: `lap`, counted from 1, the fastest first; `against`: OWN, or the place of a drive among them, 0 for
            this one; `beside`: which of its laps, counted likewise.

    Raises:
        SettingError: There is no such lap or drive.
        UserInputError: A drive cannot be read.
    """
    reverse = bool(rules.get("reverse"))
    timing = _timing(car_folder(drives[0][1], drives[0][2]), track, reverse)
    others = drives[: CHOICES + 1]
    against = query.get("against", "1" if len(others) > 1 else OWN)
    choices = [
        (OWN, "the best corners of this drive"), ("0", "another lap of this drive"),
        *((str(k), racer) for k, (racer, *_) in enumerate(others[1:], start=1)),
    ]  # fmt: skip
    shown: dict[str, Any] = {
        "told": None, "lap": "1", "against": against, "beside": "1", "lap_choices": [], "against_choices": choices,
        "beside_choices": [],
    }  # fmt: skip
    if timing is None:
        return shown
    order = np.argsort(timing.laps.lap_seconds, kind="stable")
    lap = _number(query.get("lap", "1"), len(order))
    reference, beside, beside_choices = of_best_zones(timing), 1, []
    if against != OWN:
        racer, folder, seat = others[_number(against, len(others) - 1, 0)]
        other = _timing(car_folder(folder, seat), track, reverse)
        if other is None:
            raise SettingError("{racer} has driven no full lap; expected a drive with one.", racer=racer)
        fastest = np.argsort(other.laps.lap_seconds, kind="stable")
        beside_choices = _lap_choices(other, fastest)
        text = query.get("beside", "1")  # of the drive that was chosen before, it may have none here
        beside = int(text) if text in dict(beside_choices) else 1
        reference = of_lap(
            other.laps,
            int(fastest[beside - 1]),
            f"{racer}'s {'fastest lap' if beside == 1 else f'lap {beside} by time'}",
        )
    compared = compare_lap(timing, int(order[lap - 1]), reference)
    return {
        **shown, "told": telemetry_data(compared), "lap": str(lap), "lap_choices": _lap_choices(timing, order),
        "beside": str(beside), "beside_choices": beside_choices,
    }  # fmt: skip


def _lap_choices(timing: LapTiming, order: Array) -> list[tuple[str, str]]:
    """Return what choosing a lap says: the fastest first."""
    return [(str(k), f"{k}: {timing.laps.lap_seconds[row]:.3f} s") for k, row in enumerate(order, start=1)]


def car_folder(folder: Path, seat: int) -> str:
    """Return where a car's files are: of cars that met each other each has a folder."""
    return str(folder if (folder / REPLAY).is_file() else folder / f"car-{seat + 1}")


@lru_cache(maxsize=16)
def _timing(folder: str, track: str, reverse: bool) -> LapTiming | None:
    """Return the full laps of a drive with their times; None where there is none. A drive never changes."""
    circuit = load_track(track)
    laps = find_laps(read([Path(folder)]).require_ticks(), circuit.reversed() if reverse else circuit)
    return time_laps(laps) if len(laps) else None


def _number(text: str, count: int, low: int = 1) -> int:
    if not (text.isascii() and text.isdigit()) or not low <= int(text) <= count:
        raise SettingError("found {text!r}; expected a number from {low} to {count}.", text=text[:20], low=low,
                           count=count)  # fmt: skip
    return int(text)
