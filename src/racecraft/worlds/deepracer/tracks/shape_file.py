"""The catalogue's own form of a circuit's shape: smooth curves and the stations at which racers' waypoints lie on them.

A file is one JSON object, version 1. Metres throughout, to a tenth of a millimetre.

    format, version     "racecraft-track-shape", 1
    source, licence     where the circuit comes from
    closed              true for a loop; its last row repeats its first
    steps               K-1 distances from waypoint to waypoint along the centre line; they add up to the stations
    centre              a curve: `knots`, the rows at which its knots sit, and `points`, its control points [x, y]
    half_width          a curve of one number across the road, or instead of it
    inner, outer        a curve for each border
    inside              with half_width: "left" or "right", the side of the inner border

A curve is a cubic B-spline over the stations (`spline.py`). With `half_width` a border lies that far from each waypoint
and square to the chord between the waypoints before and after it. Rows are rounded to a micrometre after evaluation,
so that every machine has the same bits.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np

from racecraft.contract.errors import TrackError
from racecraft.worlds.deepracer.tracks.spline import curve_points

FORMAT, VERSION = "racecraft-track-shape", 1


def rows_from_record(record: dict[str, Any]) -> np.ndarray:
    """Return the rows (K, 6) of a shape: centre x, y, inner x, y, outer x, y in metres."""
    closed = record["closed"]
    stations = stations_of(record)
    centre = _evaluate(record["centre"], stations, closed)
    if "half_width" in record:
        half = _evaluate(record["half_width"], stations, closed)
        inner, outer = ribbon(centre, half[:, 0], closed, record["inside"])
    else:
        inner, outer = (_evaluate(record[side], stations, closed) for side in ("inner", "outer"))
    rows = np.hstack([centre, inner, outer]).round(6) + 0.0  # + 0.0: no negative zeros
    if closed:
        rows[-1] = rows[0]
    return rows


def stations_of(record: dict[str, Any]) -> np.ndarray:
    """Return the stations (K,) of the waypoints in metres from the start line."""
    return np.concatenate([[0.0], np.cumsum(record["steps"])]).round(4)


def ribbon(centre: np.ndarray, half_width: np.ndarray, closed: bool, inside: str) -> tuple[np.ndarray, np.ndarray]:
    """Return inner and outer border (K, 2) of a road `half_width` (K,) to either side of its waypoints."""
    if closed:
        around = np.concatenate([centre[-2:-1], centre, centre[1:2]])
    else:
        around = np.concatenate([centre[:1], centre, centre[-1:]])
    along = around[2:] - around[:-2]
    along /= np.hypot(along[:, 0], along[:, 1])[:, None]
    leftward = np.stack([-along[:, 1], along[:, 0]], axis=1) * half_width[:, None]
    left, right = centre + leftward, centre - leftward
    return (left, right) if inside == "left" else (right, left)


def read_shape(path: Path) -> np.ndarray:
    """Read a shape file and return its rows (K, 6).

    Raises:
        TrackError: The file is no shape file of a version known here, or damaged.
    """
    try:
        record = json.loads(path.read_text(encoding="utf-8"))
        if record["format"] != FORMAT or record["version"] != VERSION:
            raise TrackError(
                path, f"{record['format']} version {record['version']}", f"{FORMAT} version {VERSION}",
                "Use the racecraft that wrote it, or newer.",
            )  # fmt: skip
        return rows_from_record(record)
    except (OSError, ValueError, KeyError, TypeError, IndexError) as error:
        raise TrackError(path, f"not readable ({error!r})", f"a {FORMAT} file", "Install racecraft again.") from error


def shape_text(record: dict[str, Any]) -> str:
    """Return a shape as the text of its file: one key per line, so that a change shows where it is."""
    lines = [f" {json.dumps(key)}: {json.dumps(value, ensure_ascii=False)}" for key, value in record.items()]
    return "{\n" + ",\n".join(lines) + "\n}\n"


def _evaluate(curve: dict[str, Any], stations: np.ndarray, closed: bool) -> np.ndarray:
    control = np.asarray(curve["points"], dtype=np.float64).reshape(len(curve["points"]), -1)
    return curve_points(np.asarray(curve["knots"]), control, stations, closed)
