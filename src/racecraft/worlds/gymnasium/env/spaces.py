"""Gymnasium's spaces as arrays and actions of ours, and back. Begin with `parts_of` and `action_translation`.

Observations: Box (also a scalar), Discrete, MultiDiscrete, MultiBinary, and Dict and Tuple of them, however deep.
Choices are shown as one-hot. A picture with its channels first, (C, H, W), is shown with them last, as networks here
read pictures. Actions: the same kinds; numbers become one vector of numbers, choices one branch each.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from gymnasium import spaces

from racecraft.contract.errors import UserInputError
from racecraft.contract.world import (
    Array,
    ArraySpec,
    ContinuousActions,
    DiscreteActions,
    HybridActions,
    MultiDiscreteActions,
    SingleActions,
)

SOLE_NAME = "observation"
"""Name of the observation where the environment has only one and gives it none."""
MAX_CHANNELS = 4
"""A picture's first side, where it is no longer than this and shorter than the others, is its channels."""
Leaf = spaces.Box | spaces.Discrete | spaces.MultiDiscrete | spaces.MultiBinary


@dataclass(frozen=True)
class Part:
    """One box or choice of an observation space."""

    path: tuple[Any, ...]
    """Keys and places that lead to it."""
    space: Leaf

    def spec(self, what: str) -> ArraySpec:
        """Return how it is shown; `what` names it."""
        space = self.space
        if isinstance(space, spaces.Discrete):
            return ArraySpec((int(space.n),), np.float32, 0.0, 1.0, doc=f"{what}: one-hot of {space.n} states")
        if isinstance(space, spaces.MultiDiscrete):
            counts = space.nvec.reshape(-1)
            return ArraySpec((int(counts.sum()),), np.float32, 0.0, 1.0, doc=f"{what}: one-hot of each of {counts}")
        if isinstance(space, spaces.MultiBinary):
            return ArraySpec((int(np.prod(space.shape)),), np.float32, 0.0, 1.0, doc=f"{what}: {space}")
        # Doubles are shown as float32: networks read no more, and the storage is half.
        kind = np.dtype(np.float32) if space.dtype == np.float64 else np.dtype(space.dtype)
        low, high = float(np.min(space.low)), float(np.max(space.high))
        shape = (*space.shape[1:], space.shape[0]) if self.is_channel_first else space.shape or (1,)
        return ArraySpec(shape, kind, low, high, doc=f"{what}: {space}")

    @property
    def is_channel_first(self) -> bool:
        """Whether it is a picture (C, H, W)."""
        shape = self.space.shape or ()
        is_picture = isinstance(self.space, spaces.Box) and len(shape) == 3 and self.space.dtype == np.uint8
        return is_picture and shape[0] <= MAX_CHANNELS < min(shape[1:]) and shape[2] > MAX_CHANNELS

    def show(self, seen: Any, out: Array) -> None:
        """Write an observation's part into its array.

        Raises:
            LookupError, TypeError, ValueError: The observation does not fit its space.
        """
        for key in self.path:
            seen = seen[key]
        space = self.space
        if isinstance(space, spaces.Discrete):
            _show_choices(np.array([seen]), np.array([space.start]), np.array([space.n]), out)
        elif isinstance(space, spaces.MultiDiscrete):
            _show_choices(np.asarray(seen).reshape(-1), space.start.reshape(-1), space.nvec.reshape(-1), out)
        elif isinstance(space, spaces.MultiBinary):
            out[...] = np.asarray(seen).reshape(-1)
        elif self.is_channel_first:
            out[...] = np.moveaxis(seen, 0, -1)
        else:
            out[...] = seen


@dataclass(frozen=True)
class ActionTranslation:
    """How an action of ours is told to an environment."""

    actions: SingleActions
    to_environment: Callable[[Any], Any]
    """From one agent's action to what `step` takes."""


def parts_of(space: spaces.Space, name: str) -> dict[str, Part]:
    """Return the named boxes and choices that an observation space is made of.

    Raises:
        UserInputError: A space of another kind.
    """
    found = dict(_parts_within(space, (), name))
    return {SOLE_NAME if not path else "/".join(map(str, path)): part for path, part in found.items()}


def action_translation(space: spaces.Space, name: str) -> ActionTranslation:
    """Return the actions of a space and how they are told.

    Raises:
        UserInputError: A space of another kind.
    """
    if isinstance(space, spaces.Discrete):
        first = int(space.start)
        return ActionTranslation(DiscreteActions(int(space.n)), lambda action: int(action) + first)
    if isinstance(space, spaces.Box):
        kind = np.dtype(np.float32) if space.dtype == np.float64 else space.dtype
        low, high = (tuple(np.asarray(bound, float).reshape(-1).tolist()) for bound in (space.low, space.high))
        shape = space.shape
        return ActionTranslation(ContinuousActions(low, high), lambda action: np.array(action, kind).reshape(shape))
    leaves = [part.space for _, part in _parts_within(space, (), name, what="actions")]
    lows = [np.asarray(leaf.low, float).reshape(-1) for leaf in leaves if isinstance(leaf, spaces.Box)]
    highs = [np.asarray(leaf.high, float).reshape(-1) for leaf in leaves if isinstance(leaf, spaces.Box)]
    counts = tuple(int(count) for leaf in leaves for count in _counts(leaf))
    numbers = (
        ContinuousActions(tuple(np.concatenate(lows).tolist()), tuple(np.concatenate(highs).tolist())) if lows else None
    )
    actions: SingleActions
    if numbers is None:
        actions = MultiDiscreteActions(counts)
    else:
        actions = HybridActions(numbers, MultiDiscreteActions(counts)) if counts else numbers
    count = 0 if numbers is None else numbers.shape[0]

    def tell(action: Any) -> Any:
        flat = np.asarray(action)
        return _told(space, iter(flat[:count].tolist()), iter(flat[count:].tolist()))

    return ActionTranslation(actions, tell)


def _parts_within(
    space: spaces.Space, path: tuple[Any, ...], name: str, what: str = ""
) -> list[tuple[tuple[Any, ...], Part]]:
    if isinstance(space, Leaf):
        return [(path, Part(path, space))]
    if isinstance(space, spaces.Dict):
        inner: Any = space.spaces.items()
    elif isinstance(space, spaces.Tuple):
        inner = enumerate(space.spaces)
    else:
        raise UserInputError(
            "{name}: {what} are {space}; expected Box, Discrete, MultiDiscrete, MultiBinary, or Dict or Tuple of them. "
            "gymnasium.wrappers.FlattenObservation makes a Box of most other observations.",
            name=name,
            what=what or f"observations {'/'.join(map(str, path))}".strip(),
            space=space,
        )
    return [found for key, part in inner for found in _parts_within(part, (*path, key), name, what)]


def _counts(leaf: Leaf) -> list[int]:
    """Return the sizes of a leaf's choices; none of a box."""
    if isinstance(leaf, spaces.Discrete):
        return [int(leaf.n)]
    if isinstance(leaf, spaces.MultiDiscrete):
        return [int(count) for count in leaf.nvec.reshape(-1)]
    return [2] * int(np.prod(leaf.shape)) if isinstance(leaf, spaces.MultiBinary) else []


def _told(space: Any, numbers: Any, choices: Any) -> Any:
    """Take an action of a space off the numbers and the choices that are left."""
    if isinstance(space, spaces.Dict):
        return {key: _told(part, numbers, choices) for key, part in space.spaces.items()}
    if isinstance(space, spaces.Tuple):
        return tuple(_told(part, numbers, choices) for part in space.spaces)
    if isinstance(space, spaces.Discrete):
        return int(next(choices)) + int(space.start)
    size = int(np.prod(space.shape))
    if isinstance(space, spaces.Box):
        kind = np.float32 if space.dtype == np.float64 else space.dtype
        return np.array([next(numbers) for _ in range(size)], kind).reshape(space.shape)
    chosen = np.array([int(next(choices)) for _ in range(size)]).reshape(space.shape)
    return chosen.astype(space.dtype) + (space.start if isinstance(space, spaces.MultiDiscrete) else 0)


def _show_choices(values: Array, starts: Array, counts: Array, out: Array) -> None:
    if (values < starts).any():
        raise ValueError(f"{values.tolist()} is below {starts.tolist()}")
    if (values - starts >= counts).any():
        raise IndexError(f"{values.tolist()} is not below {(starts + counts).tolist()}")
    out[...] = 0.0
    out[np.concatenate([[0], np.cumsum(counts)[:-1]]) + values - starts] = 1.0
