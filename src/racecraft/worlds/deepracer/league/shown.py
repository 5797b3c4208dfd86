"""A judged drive as a page shows it from above: `shown_road` is the track, `shown_drive` where each car was."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from racecraft.worlds.deepracer.league.replay import REPLAY, read_replay
from racecraft.worlds.deepracer.tracks.catalogue import load_track

DECIMALS = 3


def shown_road(track: str) -> dict[str, Any]:
    """Return the borders of a track as plain values: metres, x east, y north.

    Args:
        track: Its name or file.

    Raises:
        TrackError: There is no such track.
    """
    road = load_track(track)
    return {
        "inner": np.round(road.inner, DECIMALS).tolist(),
        "outer": np.round(road.outer, DECIMALS).tolist(),
        "closed": bool(road.closed),
    }


def shown_drive(folder: Path) -> dict[str, Any]:
    """Return a drive as plain values: metres, x east, y north; seconds.

    Args:
        folder: Of the drive.

    Raises:
        CheckpointError: Its files are missing or damaged.
    """
    places = [folder] if (folder / REPLAY).is_file() else sorted(folder.glob("car-*"), key=_number)
    cars, seconds = [], 1.0 / 15.0
    for place in places:
        columns, card = read_replay(place / REPLAY)
        seconds = 1.0 / float(card["ticks_per_second"])
        cars.append(
            {
                "x": _rounded(columns["front_x"]),
                "y": _rounded(columns["front_y"]),
                "lap_seconds": _rounded(columns["lap_seconds"]),
                "laps": np.ravel(columns["laps"]).astype(int).tolist(),
            }
        )
    return {"tick_seconds": seconds, "cars": cars}


def _rounded(column: np.ndarray) -> list[float]:
    found: list[float] = np.round(np.ravel(column).astype(float), DECIMALS).tolist()
    return found


def _number(place: Path) -> int:
    return int(place.name.rpartition("-")[2])
