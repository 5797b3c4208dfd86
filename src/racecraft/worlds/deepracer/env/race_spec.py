"""What a world of cars promises whoever acts in it, as a `WorldSpec`; the same on every track."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from racecraft.contract.world import ArraySpec, WorldSpec
from racecraft.worlds.deepracer.env import race
from racecraft.worlds.deepracer.env.actions import ActionSpace, OwnActions
from racecraft.worlds.deepracer.env.sensors import FRONT, FRONT_CAMERA, Sensors
from racecraft.worlds.deepracer.env.settings import CameraConfig
from racecraft.worlds.deepracer.env.vehicle import TICK_SECONDS

CAMERA_NAME = FRONT
CRITIC_NAME = "track_state"
"""What a critic is told while training: where the car truly stands."""


def world_spec(
    actions: ActionSpace | OwnActions,
    camera_config: CameraConfig,
    num_cars: int = 1,
    name: str = "DeepRacer",
    cars_per_world: int = 1,
    sensors: Sensors = FRONT_CAMERA,
    has_objects: bool = False,
) -> WorldSpec:
    """Return the promise of a race world."""
    critic_numbers = race.CRITIC_NUMBERS + (race.CRITIC_OBJECT_NUMBERS if has_objects else 0)
    return WorldSpec(
        name=name,
        num_worlds=num_cars,
        num_agents=cars_per_world,
        observations={
            **sensors.specs(camera_config.width, camera_config.height),
            CRITIC_NAME: ArraySpec(
                (critic_numbers,), np.float32, privileged=True, doc="Place, speed and the road ahead."
            ),
        },
        actions=actions.spec,
        tick_seconds=TICK_SECONDS,
    )


def with_objects_in_critic(spec: WorldSpec) -> WorldSpec:
    """Return a race world's promise with a critic that is told of objects, too."""
    critic = replace(spec.observations[CRITIC_NAME], shape=(race.CRITIC_NUMBERS + race.CRITIC_OBJECT_NUMBERS,))
    return replace(spec, observations={**spec.observations, CRITIC_NAME: critic})
