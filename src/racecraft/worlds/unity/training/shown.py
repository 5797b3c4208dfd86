"""ML-Agents' demonstrations as racecraft's. Begin with `read_demonstration_batch`."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from racecraft.algorithms.policy_spec import PolicySpec
from racecraft.contract.world import (
    Array,
    ArraySpec,
    ContinuousActions,
    DiscreteActions,
    HybridActions,
    MultiDiscreteActions,
    SingleActions,
)
from racecraft.formats.demonstrations import Demonstrations
from racecraft.worlds.unity.files.demonstrations import Demonstration, Transitions, read_demonstrations


def read_demonstration_batch(where: Path) -> Demonstrations:
    """Return what one file, or each of a folder in turn, shows.

    Raises:
        DemonstrationError: It cannot be used.
    """
    files = read_demonstrations(where)
    first, transitions = files[0], [one.transitions() for one in files]
    spec = PolicySpec("demo", _seen_in(first), _actions_of(first), has_action_mask=first.allowed is not None)
    masks = [_mask(one, len(part.reward)) for one, part in zip(files, transitions, strict=True)]
    return Demonstrations(
        observations={
            name: np.concatenate([part.observations[name] for part in transitions]) for name in first.observations
        },
        actions=np.concatenate([_done_in(part, spec.actions) for part in transitions]),
        reward=np.concatenate([part.reward for part in transitions]),
        episode=_episodes([part.terminated | part.truncated for part in transitions]),
        spec=spec.as_dictionary(),
        action_mask=np.concatenate(masks) if first.branches else None,
        source={"file": where.name, "behavior": first.behavior},
    )


def _seen_in(one: Demonstration) -> dict[str, ArraySpec]:
    return {name: ArraySpec(part.shape[1:], part.dtype.type) for name, part in one.observations.items()}


def _actions_of(one: Demonstration) -> SingleActions:
    """Return what is decided, as a Unity world promises it (`worlds/unity/env/actions.py`)."""
    numbers = ContinuousActions((-1.0,) * one.num_continuous, (1.0,) * one.num_continuous)
    if not one.branches:
        return numbers
    if one.num_continuous:
        return HybridActions(numbers, MultiDiscreteActions(one.branches))
    return DiscreteActions(one.branches[0]) if len(one.branches) == 1 else MultiDiscreteActions(one.branches)


def _done_in(part: Transitions, actions: object) -> Array:
    """Return what was done, (K, *action shape)."""
    numbers = part.continuous.clip(-1.0, 1.0)
    if isinstance(actions, ContinuousActions):
        return numbers
    if isinstance(actions, HybridActions):
        return np.concatenate([numbers, part.discrete.astype(np.float32)], axis=1)
    return part.discrete[:, 0] if isinstance(actions, DiscreteActions) else part.discrete


def _mask(one: Demonstration, ticks: int) -> Array:
    """Return what was allowed, bool (K, A); everything where the file is silent."""
    allowed = one.transitions().allowed
    return np.ones((ticks, sum(one.branches)), bool) if allowed is None else allowed


def _episodes(ends: list[Array]) -> Array:
    """Return which episode each tick belongs to, int32 (K,); a file ends its last one."""
    for part in ends:
        part[-1:] = True
    ended = np.concatenate(ends)
    return np.concatenate([[0], np.cumsum(ended)[:-1]]).astype(np.int32)
