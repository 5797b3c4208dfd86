"""A world of cars from plain words, for `rc.make_world`."""

from __future__ import annotations

import math
from typing import Any

from racecraft.worlds.deepracer.env.actions import ActionTable
from racecraft.worlds.deepracer.env.world import RaceWorld
from racecraft.worlds.deepracer.files.model_metadata import default_model_metadata
from racecraft.worlds.deepracer.tracks.catalogue import load_track


def make_world(track: Any = "reinvent_base", actions: Any = None, **words: Any) -> RaceWorld:
    """Return cars on a track.

    Args:
        track: A name, a file or a `Track`.
        actions: Pairs of degrees (left positive) and m/s, or an action space; None: those of a new folder.
        words: As of `RaceWorld`.
    """
    if actions is None:
        pairs = [(one.steering_rad, one.speed_mps) for one in default_model_metadata().actions]
        actions = ActionTable.of(pairs)
    elif not hasattr(actions, "spec"):
        actions = ActionTable.of([(math.radians(degrees), speed) for degrees, speed in actions])
    return RaceWorld(load_track(track) if isinstance(track, str) else track, actions, **words)
