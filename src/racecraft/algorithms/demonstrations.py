"""What somebody showed, as tensors that fit a world. Begin with `read_demonstration_batch`.

Cloning makes what was shown likelier (`behaviour_cloning.py`); GAIL rewards what cannot be told from it (`gail.py`).
Recorded episodes of ours are read, and the demonstrations of other programs that a world can read (`WorldKind`).
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import torch
from torch import Tensor

from racecraft.algorithms.policy_spec import PolicySpec
from racecraft.algorithms.stacking import joined, stacked_specs
from racecraft.contract.errors import SettingError
from racecraft.contract.kinds import kinds
from racecraft.contract.world import (
    WorldSpec,
)
from racecraft.formats.demonstrations import Demonstrations, read_demonstrations

MAX_STACK = 16
"""Largest network.stack_size that recordings of single observations are stacked for."""


@dataclass(frozen=True)
class DemonstrationBatch:
    """B recorded ticks, as tensors."""

    observations: dict[str, Tensor]
    actions: Tensor
    """(B, *action shape), as the world was told them."""
    action_mask: Tensor | None
    """bool (B, A), True where a choice was allowed."""

    def __len__(self) -> int:
        return len(self.actions)

    def take(self, rows: Tensor) -> DemonstrationBatch:
        """Return the chosen rows (int64 (B,))."""
        return DemonstrationBatch(
            {name: part[rows] for name, part in self.observations.items()},
            self.actions[rows],
            None if self.action_mask is None else self.action_mask[rows],
        )


def read_demonstration_batch(path: str | Path) -> Demonstrations:
    """Return what a file of recorded episodes shows, or of a file, or a folder of files, that a world reads.

    Raises:
        CheckpointError: There is no such file, or it holds no demonstrations.
        UserInputError: A world cannot read it, or a folder holds none.
    """
    where = Path(path)
    readers = {kind.demonstration_suffix: kind for kind in kinds() if kind.demonstration_suffix}
    for suffix, kind in readers.items():
        if where.suffix == suffix or any(where.glob(f"*{suffix}")):
            demonstrations: Demonstrations = kind.piece("demonstrations")(where)
            return demonstrations
    if where.is_dir():
        raise SettingError(
            "{where}: holds no demonstrations; expected files that end in {readers}.",
            where=where,
            readers=" or ".join(readers),
        )
    return read_demonstrations(where)


def demonstration_tensors(
    demonstrations: Demonstrations, spec: WorldSpec, names: Iterable[str], device: torch.device, asked_by: str
) -> DemonstrationBatch:
    """Return what was shown as tensors that fit a world.

    Args:
        demonstrations: What was recorded.
        spec: The world that somebody will learn in.
        names: Observations that are wanted.
        device: Where the tensors shall lie.
        asked_by: The setting that names the file, for letters.

    Raises:
        SettingError: It was recorded in another world.
    """
    demonstrations = _as_stacked_in(spec, _as_named_in(spec, demonstrations))
    _require_same_world(spec, demonstrations, asked_by)
    return DemonstrationBatch(
        {name: torch.from_numpy(demonstrations.observations[name]).to(device) for name in names},
        torch.from_numpy(demonstrations.actions).to(device),
        None if demonstrations.action_mask is None else torch.from_numpy(demonstrations.action_mask).to(device),
    )


def _as_named_in(spec: WorldSpec, demonstrations: Demonstrations) -> Demonstrations:
    """Return what was shown by the world's names, where the recorder knew none (`obs_0`, `obs_1`, …).

    They are matched in order where the shapes agree, else each to the only observation of its shape.
    """
    there = PolicySpec.from_dictionary(demonstrations.spec).observations
    wanted = {name: part for name, part in spec.observations.items() if not part.privileged}
    if list(there) != [f"obs_{number}" for number in range(len(there))] or len(there) != len(wanted):
        return demonstrations
    shapes = [part.shape for part in wanted.values()]
    if [part.shape for part in there.values()] == shapes:
        names = dict(zip(there, wanted, strict=True))
    elif len(set(shapes)) == len(shapes) and {part.shape for part in there.values()} == set(shapes):
        by_shape = {part.shape: name for name, part in wanted.items()}
        names = {name: by_shape[part.shape] for name, part in there.items()}
    else:
        return demonstrations
    observations = {names[name]: part for name, part in demonstrations.observations.items()}
    stored_spec = {
        **demonstrations.spec,
        "observations": {names[name]: part for name, part in demonstrations.spec["observations"].items()},
    }
    return replace(demonstrations, observations=observations, spec=stored_spec)


def _as_stacked_in(spec: WorldSpec, demonstrations: Demonstrations) -> Demonstrations:
    """Return single observations as the stacks that a policy sees (network.stack_size), within each episode.

    Before an episode has shown so many, its first one stands in for those that are missing.
    """
    single = PolicySpec.from_dictionary(demonstrations.spec)
    there = {name: part for name, part in single.observations.items() if not part.privileged}
    wanted = {name: part.shape for name, part in spec.observations.items() if not part.privileged}
    for size in range(2, MAX_STACK + 1):
        stacks = stacked_specs(there, size)
        if {name: part.shape for name, part in stacks.items()} == wanted:
            break
    else:
        return demonstrations
    back = np.arange(len(demonstrations))[:, None] - np.arange(size)[::-1]
    rows = np.maximum(back, np.searchsorted(demonstrations.episode, demonstrations.episode)[:, None])
    observations = {name: joined(demonstrations.observations[name][rows], there[name]) for name in there}
    stored_spec = replace(single, observations=stacks).as_dictionary()
    return replace(demonstrations, observations=observations, spec=stored_spec)


def _require_same_world(spec: WorldSpec, demonstrations: Demonstrations, asked_by: str) -> None:
    there = PolicySpec.from_dictionary(demonstrations.spec)
    if there.actions != spec.actions:
        raise SettingError(
            "{asked_by}: the recorded actions are {actions}, those of {name} are {actions_2}; "
            "expected the same. Record in this world.",
            asked_by=asked_by,
            actions=there.actions,
            name=spec.name,
            actions_2=spec.actions,
        )
    for name, part in spec.observations.items():
        found = there.observations.get(name)
        if not part.privileged and (found is None or found.shape != part.shape or found.dtype != part.dtype):
            raise SettingError(
                "{asked_by}: the observation '{name}' is {found}; {name_2} shows {part}; "
                "expected the same. Record in this world.",
                asked_by=asked_by,
                name=name,
                found=found or "not recorded",
                name_2=spec.name,
                part=part,
            )
