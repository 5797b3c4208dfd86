"""What a car's run is judged by where nobody asks for more: laps, on one track or several."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from racecraft.contract.errors import SettingError
from racecraft.evaluation.evaluate_run import what_is_judged
from racecraft.formats.run_folder import RunFolder
from racecraft.worlds.deepracer.evaluation.by_track import STARTS, judge_named, told_of
from racecraft.worlds.deepracer.evaluation.laps import judge_laps
from racecraft.worlds.deepracer.players.trained_car import load_trained_car
from racecraft.worlds.deepracer.tracks.catalogue import load_track

LAPS = 3
"""Where nobody says."""


def judge_car(
    run: RunFolder,
    which: str,
    track: str | None = None,
    laps: int | None = None,
    tracks: Sequence[str] | None = None,
) -> dict[str, Any]:
    """Judge a car by laps on one track, or on several.

    Args:
        run: The car's run.
        which: Its checkpoint.
        track: A name or a file; None: the track that it was trained on.
        laps: On one track, from a standing start; of several tracks, on each from so many starts.
        tracks: Names, or one text with commas between them.

    Raises:
        SettingError: `track` and `tracks` were given.
    """
    car = load_trained_car(run.path, which)
    if tracks is not None:
        if track is not None:
            raise SettingError("`track` and `tracks` were given; expected all names in one of them.")
        names = tracks.split(",") if isinstance(tracks, str) else tracks
        return told_of(car, judge_named(car, names, laps or STARTS), laps or STARTS)
    circuit, laps = load_track(track) if track else car.trained_on, laps or LAPS
    world = car.world(circuit, num_cars=1, start_shares=[0.0], laps=laps)
    report = judge_laps(car.policy, world, laps)
    return what_is_judged(run, car.policy) | {"track": circuit.name, **report.as_dictionary()}
