"""What a car can be told: the action table as arrays, in SI units."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from racecraft.contract.world import Array, DiscreteActions
from racecraft.envs.deepracer.vehicle import MAX_SPEED_MPS, MAX_STEERING_RAD, MIN_SPEED_MPS


@dataclass(frozen=True)
class ActionTable:
    """A discrete action space: choice a commands steering[a] (rad, positive left) and speed[a] (m/s)."""

    steering: tuple[float, ...]
    speed: tuple[float, ...]

    @classmethod
    def of(cls, actions: Sequence[tuple[float, float]]) -> ActionTable:
        """Return the table of (steering in rad, speed in m/s) pairs, in the order of their numbers."""
        return cls(tuple(float(steering) for steering, _ in actions), tuple(float(speed) for _, speed in actions))

    @property
    def spec(self) -> DiscreteActions:
        """The table as a world's action spec, each choice labelled in a racer's words.

        >>> ActionTable.of([(math.radians(30), 0.5)]).spec.labels
        ('left 30° at 0.5 m/s',)
        """
        labels = tuple(action_label(*pair) for pair in zip(self.steering, self.speed, strict=True))
        return DiscreteActions(len(self.steering), labels)

    def commands(self) -> tuple[Array, Array]:
        """Return what is sent to the car, clipped as the original clips: steering (A,) rad, speed (A,) m/s."""
        return (
            np.clip(self.steering, -MAX_STEERING_RAD, MAX_STEERING_RAD),
            np.clip(self.speed, MIN_SPEED_MPS, MAX_SPEED_MPS),
        )


def action_label(steering_rad: float, speed_mps: float) -> str:
    """Return an action in a racer's words.

    >>> action_label(0.0, 1.0)
    'straight at 1 m/s'
    """
    degrees = round(math.degrees(steering_rad), 3)
    where = f"{'left' if degrees > 0 else 'right'} {abs(degrees):g}°" if degrees else "straight"
    return f"{where} at {speed_mps:g} m/s"
