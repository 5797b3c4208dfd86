"""What somebody showed, as tensors that fit a world. Begin with `read_shown`.

Cloning makes what was shown likelier (`behaviour_cloning.py`); GAIL rewards what cannot be told from it (`gail.py`).
Two kinds of file are read: recorded episodes of ours, and ML-Agents' `.demo` files, one or a folder of them.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import torch
from torch import Tensor

from racecraft.algorithms.policy_spec import PolicySpec
from racecraft.contract.errors import SettingError
from racecraft.contract.world import (
    Array,
    ArraySpec,
    ContinuousActions,
    DiscreteActions,
    HybridActions,
    MultiDiscreteActions,
    SingleActions,
    WorldSpec,
)
from racecraft.formats.demonstrations import Demonstrations, read_demonstrations
from racecraft.worlds.unity.files.demonstrations import SUFFIX, Demonstration, Transitions
from racecraft.worlds.unity.files.demonstrations import read_demonstrations as read_unity_demonstrations


@dataclass(frozen=True)
class Shown:
    """B recorded ticks, as tensors."""

    observations: dict[str, Tensor]
    actions: Tensor
    """(B, *action shape), as the world was told them."""
    action_mask: Tensor | None
    """bool (B, A), True where a choice was allowed."""

    def __len__(self) -> int:
        return len(self.actions)

    def take(self, rows: Tensor) -> Shown:
        """Return the chosen rows (int64 (B,))."""
        return Shown(
            {name: part[rows] for name, part in self.observations.items()},
            self.actions[rows],
            None if self.action_mask is None else self.action_mask[rows],
        )


def read_shown(path: str | Path) -> Demonstrations:
    """Return what a file of recorded episodes shows, or a `.demo` file, or a folder of those.

    Raises:
        CheckpointError: There is no such file, or it holds no demonstrations.
        DemonstrationError: A `.demo` file cannot be used.
    """
    where = Path(path)
    is_unity = where.suffix == SUFFIX or where.is_dir()
    return _from_unity(where) if is_unity else read_demonstrations(where)


def shown_tensors(
    shown: Demonstrations, spec: WorldSpec, names: Iterable[str], device: torch.device, asked_by: str
) -> Shown:
    """Return what was shown as tensors that fit a world.

    Args:
        shown: What was recorded.
        spec: The world that somebody will learn in.
        names: Observations that are wanted.
        device: Where the tensors shall lie.
        asked_by: The setting that names the file, for letters.

    Raises:
        SettingError: It was recorded in another world.
    """
    _require_same_world(spec, shown, asked_by)
    return Shown(
        {name: torch.from_numpy(shown.observations[name]).to(device) for name in names},
        torch.from_numpy(shown.actions).to(device),
        None if shown.action_mask is None else torch.from_numpy(shown.action_mask).to(device),
    )


def _from_unity(where: Path) -> Demonstrations:
    """Return one file, or a folder of them, behind each other."""
    files = read_unity_demonstrations(where)
    first, told = files[0], [one.transitions() for one in files]
    spec = PolicySpec("demo", _seen_in(first), _actions_of(first), has_action_mask=first.allowed is not None)
    masks = [_mask(one, len(part.reward)) for one, part in zip(files, told, strict=True)]
    return Demonstrations(
        observations={name: np.concatenate([part.observations[name] for part in told]) for name in first.observations},
        actions=np.concatenate([_done_in(part, spec.actions) for part in told]),
        reward=np.concatenate([part.reward for part in told]),
        episode=_episodes([part.terminated | part.truncated for part in told]),
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


def _require_same_world(spec: WorldSpec, shown: Demonstrations, asked_by: str) -> None:
    there = PolicySpec.from_dictionary(shown.spec)
    if there.actions != spec.actions:
        raise SettingError(
            f"{asked_by}: the recorded actions are {there.actions}, those of {spec.name} are {spec.actions}; "
            "expected the same. Record in this world."
        )
    for name, part in spec.observations.items():
        found = there.observations.get(name)
        if not part.privileged and (found is None or found.shape != part.shape or found.dtype != part.dtype):
            raise SettingError(
                f"{asked_by}: the observation '{name}' is {found or 'not recorded'}; {spec.name} shows {part}; "
                "expected the same. Record in this world."
            )
