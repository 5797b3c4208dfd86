"""How catalogue files are made: smooth curves laid through a circuit's surveyed rows. Begin with `fit_shape`.

The curves keep the number of waypoints and their places: none is off by more than 5 mm, the mean of a line by no more
than 1 mm. Most circuits are a ribbon (a centre line and a width across it); the others get a curve for each border.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from racecraft.worlds.deepracer.tracks.shape_file import FORMAT, VERSION, ribbon, rows_from_record
from racecraft.worlds.deepracer.tracks.spline import lay_curve
from racecraft.worlds.deepracer.tracks.track import Track

FARTHEST_M = 0.005
"""No waypoint or border point may be farther from where it was surveyed."""
MEAN_M = 0.001
"""Largest mean distance along one line."""
SHARES = (0.95, 0.5, 0.25, 0.1)
"""Shares of the tolerance tried for the centre line; a ribbon's borders need a finer one."""


def fit_shape(track: Track, source: str, licence: str) -> dict[str, Any]:
    """Return the shape of a track as a catalogue record, within tolerance at every row.

    Args:
        track: The circuit as surveyed.
        source: Where its rows come from, for the file.
        licence: Under which licence.

    Raises:
        ValueError: No curve holds the tolerance.
    """
    for share in SHARES:
        record = _ribbon_record(track, source, licence, share)
        if record is not None and _holds(record, track):
            return record
    record = _curves_record(track, source, licence)
    if not _holds(record, track):
        raise ValueError(f"{track.name}: no curves found within {FARTHEST_M} m, mean {MEAN_M} m")
    return record


def misses(record: dict[str, Any], track: Track) -> np.ndarray:
    """Return how far each fitted point is from the surveyed one, (K, 3) m: centre, inner, outer."""
    difference = (rows_from_record(record) - track.rows).reshape(-1, 3, 2)
    return np.hypot(difference[..., 0], difference[..., 1])


def _holds(record: dict[str, Any], track: Track) -> bool:
    missed = misses(record, track)
    return bool(missed.max() <= FARTHEST_M and missed.mean(axis=0).max() <= MEAN_M)


def _ribbon_record(track: Track, source: str, licence: str, share: float) -> dict[str, Any] | None:
    half = np.hypot(*(track.outer - track.inner).T) / 2
    first, second = track.centre[0], track.centre[1]
    to_inner = track.inner[0] - first
    along = second - first
    inside = "left" if along[0] * to_inner[1] - along[1] * to_inner[0] > 0 else "right"
    inner, outer = ribbon(track.centre, half, track.closed, inside)
    if max(np.abs(inner - track.inner).max(), np.abs(outer - track.outer).max()) > FARTHEST_M:
        return None
    record = _header(track, source, licence)
    record["centre"] = _curve(track, track.centre, share)
    record["half_width"] = _curve(track, half[:, None], 0.5)
    record["inside"] = inside
    return record


def _curves_record(track: Track, source: str, licence: str) -> dict[str, Any]:
    record = _header(track, source, licence)
    for label, line in (("centre", track.centre), ("inner", track.inner), ("outer", track.outer)):
        record[label] = _curve(track, line, SHARES[0])
    return record


def _header(track: Track, source: str, licence: str) -> dict[str, Any]:
    return {
        "format": FORMAT, "version": VERSION, "source": source, "licence": licence, "closed": track.closed,
        "steps": np.diff(track.arc.round(4)).round(4).tolist(),
    }  # fmt: skip


def _curve(track: Track, points: np.ndarray, share: float) -> dict[str, Any]:
    rows, control = lay_curve(track.arc.round(4), points, track.closed, share * FARTHEST_M, share * MEAN_M)
    plain = control[:, 0].tolist() if control.shape[1] == 1 else control.tolist()
    return {"knots": rows.tolist(), "points": plain}
