"""Where a run's car fails, from what `racecraft why` wrote into the run: sentences, a map, a card a place."""

from __future__ import annotations

import json
from typing import Any

import numpy as np

from racecraft.contract.errors import TrackError
from racecraft.contract.world import Array
from racecraft.formats.run_folder import RunFolder
from racecraft.worlds.deepracer.analysis.run_facts import track_of
from racecraft.worlds.deepracer.tracks.track import Track

FACTS, PAGE = "why.json", "why.html"
EDGE_M = 0.5


def why_data(run: RunFolder) -> dict[str, Any]:
    """Return what `why.html` shows; `why` is None where nobody asked yet.

    Raises:
        RunFolderError: The run cannot be read.
    """
    try:
        why = json.loads((run.path / FACTS).read_text(encoding="utf-8"))
        track = track_of(run.read_job())
        data = {
            "checkpoint": int(why["checkpoint"]),
            "findings": [str(one) for one in why["findings"]],
            "places": [_place(number, one) for number, one in enumerate(why["places"], 1)],
            "map": None if track is None else _map(track, why),
        }
    except (OSError, ValueError, KeyError, TypeError, TrackError):
        return {"why": None, "page": ""}
    return {"why": data, "page": PAGE if (run.path / PAGE).is_file() else ""}


def _place(number: int, facts: dict[str, Any]) -> dict[str, Any]:
    cures = [
        (
            f"{cure['seconds_before']:.1f} s", cure["waypoint"], cure["instead_of"], cure["action"],
            f"{cure['held_seconds']:.1f} s", f"{cure['saved']} of {cure['tried']}",
        )
        for cure in facts["cures"]
    ]  # fmt: skip
    return {
        "number": number,
        "head": f"{number}: segment {facts['segment']}",
        "share": float(facts["share"]),
        "words": str(facts["words"]),
        "picture": "data:image/jpeg;base64," + str(facts["picture_jpeg"]),
        "cures": cures,
    }


def _map(track: Track, why: dict[str, Any]) -> dict[str, Any]:
    """Return road, paths and places as an SVG has them: metres, y downwards."""
    x0, y0, x1, y1 = track.bounds
    places = []
    for number, one in enumerate(why["places"], 1):
        ends = np.asarray(one["xy"], float).reshape(-1, 2)
        x, y = ends.mean(axis=0)
        places.append(
            {"number": number, "x": f"{x:.2f}", "y": f"{-y:.2f}", "radius": f"{0.16 + 0.5 * one['share']:.2f}"}
        )
    return {
        "view": f"{x0 - EDGE_M:.2f} {-y1 - EDGE_M:.2f} {x1 - x0 + 2 * EDGE_M:.2f} {y1 - y0 + 2 * EDGE_M:.2f}",
        "road": _path(track.outer, track.closed) + _path(track.inner, track.closed),
        "paths": [_path(np.asarray(path, float).reshape(-1, 2), False) for path in why["paths"]],
        "ends": [(f"{x:.2f}", f"{-y:.2f}") for one in why["places"] for x, y in one["xy"]],
        "places": places,
    }


def _path(points: Array, closed: bool) -> str:
    path = "L".join(f"{x:.2f} {-y:.2f}" for x, y in points.tolist())
    return f"M{path}{'Z' if closed else ''}"
