"""Tracks that are never trained on, only judged on. Begin with `held_out_tracks`."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from racecraft.contract.errors import SettingError
from racecraft.worlds.deepracer.tracks.catalogue import load_track, names, summary
from racecraft.worlds.deepracer.tracks.track import Track
from racecraft.worlds.deepracer.training.groups import track_names

ALIKE = 0.005
"""Two circuits are the same road where the measures of their centre lines differ by less than this share."""


def held_out_tracks(asked: Sequence[str]) -> tuple[Track, ...]:
    """Return the tracks to be judged on, each once.

    Args:
        asked: Names or files, comma lists of them.

    Raises:
        TrackError: One cannot be used; of a wrong name the nearest is told.
        SettingError: The whole catalogue is asked for: nothing would be left to train on.
    """
    found = track_names(asked)
    if len(found) >= len(names()):
        raise SettingError("--hold-out all leaves no track to train on; expected some names. `racecraft tracks list`.")
    return tuple({track.name: track for track in map(load_track, found)}.values())


def require_apart(trained: Sequence[Track], held_out: Sequence[Track]) -> tuple[str, ...]:
    """Refuse a held-out track that is trained on; return what is worth saying of others that are much like one.

    Raises:
        SettingError: It would be judged on what it has seen.
    """
    seen = {track.name: track for track in trained}
    for track in held_out:
        if track.name in seen or any(track.hash() == one.hash() for one in trained):
            raise SettingError(
                "--hold-out {name}: cars are trained on it too; expected a track that none of them sees. Leave "
                "it out of one of the two.",
                name=track.name,
            )
    pairs = ((one, next((name for name, other in seen.items() if are_alike(one, other)), None)) for one in held_out)
    alike = [f"{track.name} is the road of {name}" for track, name in pairs if name is not None]
    words = "another way round, or otherwise painted: what is learned there helps here"
    return (f"held out and yet known: {'; '.join(alike)}, {words}",) if alike else ()


def as_dictionary(track: Track) -> dict[str, Any]:
    """Return what job.json says of a track that is judged on only."""
    return {"track": track.name, "hash": track.hash()}


def twins_of(held_out: Sequence[Track]) -> list[str]:
    """Return the catalogue's names of the same roads, the other way round or otherwise painted, and their own."""
    lengths = [track.length for track in held_out]
    near = [name for name in names() if any(abs(summary(name).length / one - 1.0) < 0.02 for one in lengths)]
    return [name for name in near if any(are_alike(load_track(name), track) for track in held_out)]


def are_alike(one: Track, other: Track) -> bool:
    """Tell whether two circuits are the same road: by measures that neither direction, place nor paint changes."""
    return bool(np.allclose(_measures(one), _measures(other), rtol=ALIKE, atol=1e-6))


def _measures(track: Track) -> tuple[float, float, float]:
    """Return length, root of the area enclosed, and mean distance from the middle of a centre line, all in m."""
    line = np.asarray(track.centre, float)
    ends = np.roll(line, -1, axis=0)
    steps = np.hypot(*(ends - line).T)
    middles = (line + ends) / 2.0
    middle = np.average(middles, axis=0, weights=steps)
    area = abs(float(np.sum(line[:, 0] * ends[:, 1] - ends[:, 0] * line[:, 1]))) / 2.0
    away = float(np.average(np.hypot(*(middles - middle).T), weights=steps))
    return track.length, area**0.5, away
