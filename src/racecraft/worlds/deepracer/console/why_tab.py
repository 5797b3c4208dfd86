"""Where a run's car fails, from what `racecraft why` wrote into the run: sentences, a map, a card a place."""

from __future__ import annotations

import json
from typing import Any

import numpy as np

from racecraft.contract.errors import TrackError
from racecraft.formats.run_folder import RunFolder
from racecraft.worlds.deepracer.analysis.run_facts import track_of
from racecraft.worlds.deepracer.analysis.svg_lines import svg_path, svg_view
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
        "head": f"{number}: {facts['segment']}",
        "share": float(facts["share"]),
        "words": str(facts["words"]),
        "picture": "data:image/jpeg;base64," + str(facts["picture_jpeg"]),
        "cures": cures,
    }


def _map(track: Track, why: dict[str, Any]) -> dict[str, Any]:
    """Return road, paths and places as an SVG has them: metres, y downwards."""
    places = []
    for number, one in enumerate(why["places"], 1):
        ends = np.asarray(one["xy"], float).reshape(-1, 2)
        x, y = ends.mean(axis=0)
        places.append(
            {"number": number, "x": f"{x:.2f}", "y": f"{-y:.2f}", "radius": f"{0.16 + 0.5 * one['share']:.2f}"}
        )
    return {
        "view": svg_view(track, EDGE_M),
        "road": svg_path(track.outer, track.closed) + svg_path(track.inner, track.closed),
        "paths": [svg_path(np.asarray(path, float).reshape(-1, 2)) for path in why["paths"]],
        "ends": [(f"{x:.2f}", f"{-y:.2f}") for one in why["places"] for x, y in one["xy"]],
        "places": places,
    }
