"""The world in which a person drives a car: the one that the car is then trained in. Begin with `world_by_hand`."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from racecraft.worlds.deepracer.env.world import RaceWorld
from racecraft.worlds.deepracer.training.plan import RaceRequest, plan_car
from racecraft.worlds.deepracer.training.trainer import race_world

DRIVE_SECONDS = 1e6
"""A person drives on over the finish as long as they like, s of simulated time."""


def world_by_hand(folder: Path | None, track: str, reverse: bool = False) -> RaceWorld:
    """Return one car on a track; it sees and answers as in a training of the same folder with the preset `race`.

    Args:
        folder: The racer's folder; None: the default car that races.
        track: A name of the catalogue, or a waypoint file.
        reverse: Whether it is driven the other way round.

    Raises:
        UserInputError: A file cannot be used, or there is no such track.
    """
    turned = f"race.reverse={'true' if reverse else 'false'}"
    overrides = ("race.change_start=false", "race.practice_seconds=none", turned)
    planned = plan_car(RaceRequest(folder, track, preset="race", overrides=overrides))
    drives_on = DRIVE_SECONDS if planned.track.closed else None
    return race_world(planned, 1, None, np.zeros(1), drive_seconds=drives_on)
