"""The fastest laps of several runs on one map, for the page that compares models. Begin with `compared_laps`."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from racecraft.contract.world import Array
from racecraft.formats.run_folder import RunFolder
from racecraft.worlds.deepracer.analysis.logs.judged import fastest_evaluated_lap
from racecraft.worlds.deepracer.analysis.telemetry_map import line_path, moving_cars, road_map
from racecraft.worlds.deepracer.console.laps import timed_laps
from racecraft.worlds.deepracer.driving.telemetry.export import lap_names
from racecraft.worlds.deepracer.driving.telemetry.reference import Reference, of_lap
from racecraft.worlds.deepracer.driving.telemetry.timing import LapTiming
from racecraft.worlds.deepracer.tracks.track import Track

MAX_CARS = 6
"""As many colours can be told apart."""
NamedRuns = Sequence[tuple[str, str]]
"""Name and folder of each run."""


@dataclass(frozen=True, eq=False)
class DrivenLap:
    """A lap, where it was driven, and where it stems from."""

    lap: Reference
    track: Track
    source: str


def compared_laps(groups: Sequence[NamedRuns]) -> dict[str, Any]:
    """Return what `compared_laps.html` shows: a car a group or, of one group alone, a car a run.

    Laps of evaluations are compared where all cars have one: a training explores. `told` is None where no map can be
    drawn; `reason` is the sentence that says why.

    Args:
        groups: Seeds of one training each.

    Raises:
        UserInputError: A run cannot be read.
    """
    runs = list(groups[0]) if len(groups) == 1 else [_best_run(group) for group in groups]
    timings = [_timing(Path(run)) for _, run in runs[:MAX_CARS]]
    judged = all(_judged(timing).any() for timing in timings if timing)
    shown = [
        (number, name, fastest_lap(timing, judged) if timing else None)
        for number, ((name, _), timing) in enumerate(zip(runs, timings, strict=False), 1)
    ]
    driven = [(number, one) for number, _, one in shown if one is not None]
    if not driven:
        return _no_map("None of these models has a full lap yet, so there is none to show on the map.")
    if len({(one.track.hash(), one.track.is_reversed) for _, one in driven}) > 1:
        return _no_map("They drove in different directions, so their laps cannot be shown side by side on one map.")
    told = {**_on_map(driven), "rows": _rows(shown), "judged": judged, "left_out": len(runs) - len(shown)}
    return {"told": told, "reason": ""}


def fastest_lap(timing: LapTiming, judged: bool) -> DrivenLap:
    """Return the fastest lap of a run; with `judged` the fastest in its evaluations, of which it has one at least."""
    laps = timing.laps
    row = int(np.argmin(np.where(_judged(timing) | (not judged), laps.lap_seconds, np.inf)))
    return DrivenLap(of_lap(laps, row, ""), laps.track, lap_names(timing)[row])


def _timing(run: Path) -> LapTiming | None:
    found = timed_laps(run)
    return None if found is None else found[0]


def _judged(timing: LapTiming) -> Array:
    """Return which laps (L,) were driven in an evaluation."""
    return (timing.laps.about["phase"] != "training").to_numpy()


def _best_run(group: NamedRuns) -> tuple[str, str]:
    """Return the seed with the fastest evaluated lap; of equals the first."""
    if len(group) == 1:
        return group[0]

    def seconds(one: tuple[str, str]) -> float:
        return fastest_evaluated_lap(RunFolder(Path(one[1])).read_metrics()) or float("inf")

    return min(group, key=seconds)


def _on_map(driven: Sequence[tuple[int, DrivenLap]]) -> dict[str, Any]:
    """Return the road with the lines and the cars of laps."""
    track = driven[0][1].track
    words = f"{track.title or track.name}: the fastest lap of each model; the table beside it has their times"
    return {
        "map": road_map(track) | {"words": words},
        "cars": [{"number": number, "line": line_path(one.lap, track)} for number, one in driven],
        "ghosts": moving_cars([one.lap for _, one in driven], track),
    }


def _rows(shown: Sequence[tuple[int, str, DrivenLap | None]]) -> list[dict[str, Any]]:
    """Return a row a run, the fastest first; texts are "" where it has no full lap."""
    seconds = {number: float("inf") if one is None else one.lap.lap_seconds for number, _, one in shown}
    least = min(seconds.values())
    return [
        {
            "number": number,
            "name": name,
            "lap": "" if one is None else f"{seconds[number]:.2f} s",
            "gap": "" if one is None else f"{seconds[number] - least:+.2f} s",
            "source": "no full lap yet" if one is None else one.source,
        }
        for number, name, one in sorted(shown, key=lambda each: seconds[each[0]])
    ]


def _no_map(reason: str) -> dict[str, Any]:
    return {"told": None, "reason": reason}
