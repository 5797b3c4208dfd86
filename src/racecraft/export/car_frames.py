"""What a trained car sees on its own track, in the size it was trained with and in that of a real car's camera."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from racecraft.contract.world import Array, allocate
from racecraft.envs.deepracer.world import CAMERA_NAME, RaceWorld
from racecraft.formats.aws.policy_layers import IMAGE
from racecraft.players.deepracer.trained_car import TrainedCar
from racecraft.settings.overrides import with_values

CARS, TICKS = 8, 24
SEED = 1


@dataclass(frozen=True)
class Frames:
    """The same moments, seen twice."""

    seen: Array
    """uint8 (R, H, W), as the policy was trained to see."""
    whole: Array
    """uint8 (R, 120, 160), as a real car's camera shows it."""


def drive_for_frames(car: TrainedCar) -> Frames:
    """Let a car drive greedily from starts all round its track, and keep what it sees: R = 8 cars of 24 ticks."""
    full = with_values(car.settings, "camera", {"height": IMAGE[0], "width": IMAGE[1]})
    starts = np.arange(CARS) / CARS
    worlds = [one.world(car.trained_on, CARS, list(starts)) for one in (car, replace(car, settings=full))]
    kept: tuple[list[Array], list[Array]] = ([], [])
    buffers = [allocate(world.spec) for world in worlds]
    for world, held in zip(worlds, buffers, strict=True):
        world.reset(held, seed=SEED)
    for _ in range(TICKS):
        for frames, held in zip(kept, buffers, strict=True):
            frames.append(held.observations[CAMERA_NAME][:, 0].copy())
        actions = car.policy.act({CAMERA_NAME: kept[0][-1]})
        for world, held in zip(worlds, buffers, strict=True):
            world.step(actions[:, None], held)
    _close(worlds)
    return Frames(*(np.concatenate(frames) for frames in kept))


def _close(worlds: list[RaceWorld]) -> None:
    for world in worlds:
        world.close()
