"""From what a policy chooses to what a car is told: steering in rad, positive left, and speed in m/s.

Two kinds stand side by side behind the same two verbs: `ActionTable` for a discrete action space, where a choice is a
number, and `ActionBox` for a continuous one, where it is the command itself. `spec` is what the world promises its
policies; `commands` translates a whole tick's choices at once.

A command is kept as it was *chosen* and as it is *sent*: held within what the original sends to a car, whatever its
action space says (`clip_commands`). Reward functions and traces see what is sent; with fidelity aws what was chosen.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from racecraft.contract.errors import ContractError
from racecraft.contract.world import Array, ContinuousActions, DiscreteActions
from racecraft.worlds.deepracer.env.vehicle import MAX_SPEED_MPS, MAX_STEERING_RAD, MIN_SPEED_MPS
from racecraft.worlds.deepracer.files.model_metadata import ActionRanges, CarAction

NO_NUMBER = -1
"""The number of an action that is none of a table's."""
ROUNDINGS = 4
"""How many roundings in single precision a policy may need to reach the end of a range (centre + scale * 1 is two)."""


class Commands(NamedTuple):
    """What cars are told in one tick, steering in rad and speed in m/s along the last axis."""

    chosen: Array
    """float64 (N, M, 2), as the policy chose."""
    sent: Array
    """float64 (N, M, 2), as sent to the cars."""
    numbers: Array
    """int64 (N, M), the choice in its table; NO_NUMBER where actions are continuous."""


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

    @property
    def fastest(self) -> float:
        """The fastest command that is sent to a car, m/s."""
        return float(self._sent[:, 1].max())

    def commands(self, actions: Array) -> Commands:
        """Return what each choice tells its car.

        Args:
            actions: Whole numbers (N, M).

        Raises:
            ContractError: One of them is no choice of this table.
        """
        numbers = np.asarray(actions, np.int64)
        if numbers.size and (numbers.min() < 0 or numbers.max() >= len(self.steering)):
            raise ContractError(
                "actions {actions!r} are not from 0 to {count}, the choices of {self_value}",
                actions=actions,
                count=len(self.steering) - 1,
                self_value=self,
            )
        return Commands(self._chosen.take(numbers, axis=0), self._sent.take(numbers, axis=0), numbers)

    @cached_property
    def _chosen(self) -> Array:
        return np.column_stack([self.steering, self.speed]).astype(np.float64)

    @cached_property
    def _sent(self) -> Array:
        return clip_commands(self._chosen)


@dataclass(frozen=True)
class ActionBox:
    """A continuous action space: an action is (steering in rad, positive left; speed in m/s) within two ranges."""

    steering: tuple[float, float]
    """Lowest (rightmost) and highest angle, rad."""
    speed: tuple[float, float]
    """Lowest and highest speed, m/s."""

    @property
    def spec(self) -> ContinuousActions:
        """The ranges as a world's action spec.

        >>> ActionBox((-0.5, 0.5), (1.0, 4.0)).spec
        ContinuousActions(low=(-0.5, 1.0), high=(0.5, 4.0))
        """
        (right, left), (slow, fast) = self.steering, self.speed
        return ContinuousActions((right, slow), (left, fast))

    @property
    def fastest(self) -> float:
        """The fastest command that is sent to a car, m/s."""
        return min(max(self.speed[1], MIN_SPEED_MPS), MAX_SPEED_MPS)

    def commands(self, actions: Array) -> Commands:
        """Return what each action tells its car; one beyond the ranges is held to them, as the original does.

        Actions come in single precision. One that lies within its rounding of an end of its range is that end to the
        last digit, so that a reward function finds the 30 degrees that its file names.

        Args:
            actions: float32 (N, M, 2), steering in rad and speed in m/s.

        Raises:
            ContractError: One of them is not a number.
        """
        commands = np.asarray(actions, np.float32)
        if not np.isfinite(commands).all():
            raise ContractError(
                "actions {actions!r} are not all finite; expected steering in rad and speed in m/s", actions=actions
            )
        low, high = np.asarray(self.spec.low), np.asarray(self.spec.high)
        near = ROUNDINGS * np.finfo(np.float32).eps * (np.abs(low) + np.abs(high))
        chosen = np.where(commands <= low + near, low, np.where(commands >= high - near, high, commands))
        return Commands(chosen, clip_commands(chosen), np.full(commands.shape[:-1], NO_NUMBER, np.int64))


ActionSpace = ActionTable | ActionBox


@dataclass(frozen=True, eq=False)
class OwnActions:
    """Cars of which each has an action space of its own: an action is a choice's number and 0, or a pair in a range."""

    spaces: tuple[ActionSpace, ...]
    """The action spaces that there are."""
    whose: Array
    """(N, M) the number of each car's space."""

    @property
    def spec(self) -> ContinuousActions:
        """Two numbers, as they are handed on."""
        return ContinuousActions((-math.inf, -math.inf), (math.inf, math.inf))

    def commands(self, actions: Array) -> Commands:
        """Return what each car's own space makes of its action.

        Args:
            actions: float64 (N, M, 2).

        Raises:
            ContractError: A number is no choice of its car's table, or none at all.
        """
        commands = np.asarray(actions, np.float64)
        every = Commands(
            np.zeros(commands.shape), np.zeros(commands.shape), np.full(commands.shape[:-1], NO_NUMBER, np.int64)
        )
        for number, space in enumerate(self.spaces):
            own = self.whose == number
            part = space.commands(commands[own, 0] if isinstance(space, ActionTable) else commands[own])
            every.chosen[own], every.sent[own], every.numbers[own] = part.chosen, part.sent, part.numbers
        return every


def action_space(space: Sequence[CarAction] | ActionRanges) -> ActionSpace:
    """Return the action space that a `model_metadata.json` describes."""
    if isinstance(space, ActionRanges):
        return ActionBox((space.steering_low_rad, space.steering_high_rad), (space.speed_low_mps, space.speed_high_mps))
    return ActionTable.of([(action.steering_rad, action.speed_mps) for action in space])


def clip_commands(commands: Array) -> Array:
    """Hold commands (…, 2) to what the original sends: ±30 degrees and 0.1 to 4 m/s (`rollout_agent_ctrl.py`)."""
    return np.clip(commands, (-MAX_STEERING_RAD, MIN_SPEED_MPS), (MAX_STEERING_RAD, MAX_SPEED_MPS))


def action_label(steering_rad: float, speed_mps: float) -> str:
    """Return an action in a racer's words.

    >>> action_label(0.0, 1.0)
    'straight at 1 m/s'
    """
    degrees = round(math.degrees(steering_rad), 3)
    where = f"{'left' if degrees > 0 else 'right'} {abs(degrees):g}°" if degrees else "straight"
    return f"{where} at {speed_mps:g} m/s"
