"""What a trained car sees on its own track, in the size it was trained with and in that of a real car's camera."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from racecraft.contract.world import Array, allocate
from racecraft.formats.policy_layers import IMAGE
from racecraft.settings.overrides import with_values
from racecraft.worlds.deepracer.env.world import RaceWorld
from racecraft.worlds.deepracer.players.trained_car import TrainedCar

CARS, TICKS = 8, 24
SEED = 1


@dataclass(frozen=True)
class Frames:
    """The same R moments, seen twice: observations by name."""

    seen: Mapping[str, Array]
    """Images uint8 (R, H, W) or (R, H, W, C), as the policy was trained to see; a LiDAR's numbers (R, numbers)."""
    whole: Mapping[str, Array]
    """The same, with images of 120 rows and 160 columns, as a real car's camera shows them."""

    @property
    def count(self) -> int:
        """How many moments, R."""
        return len(next(iter(self.seen.values())))


def drive_for_frames(car: TrainedCar) -> Frames:
    """Let a car drive greedily from starts all round its track, and keep what it sees: R = 8 cars of 24 ticks."""
    full = with_values(car.settings, "camera", {"height": IMAGE[0], "width": IMAGE[1]})
    starts = np.arange(CARS) / CARS
    names = sorted(car.policy.spec.visible)
    worlds = [one.world(car.trained_on, CARS, list(starts)) for one in (car, replace(car, settings=full))]
    kept: tuple[list[dict[str, Array]], list[dict[str, Array]]] = ([], [])
    buffers = [allocate(world.spec) for world in worlds]
    for world, held in zip(worlds, buffers, strict=True):
        world.reset(held, seed=SEED)
    for _ in range(TICKS):
        for moments, held in zip(kept, buffers, strict=True):
            moments.append({name: held.observations[name][:, 0].copy() for name in names})
        actions = car.policy.act(kept[0][-1])
        for world, held in zip(worlds, buffers, strict=True):
            world.step(actions[:, None], held)
    _close(worlds)
    return Frames(*({name: np.concatenate([one[name] for one in moments]) for name in names} for moments in kept))


def _close(worlds: list[RaceWorld]) -> None:
    for world in worlds:
        world.close()
