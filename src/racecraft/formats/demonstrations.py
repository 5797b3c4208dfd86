"""What somebody did, tick after tick, for others to learn from: observations and actions in one safetensors file.

Begin with `Demonstrations`. The arrays of a file, K ticks one behind the other, episode after episode:

    observations/<name>   (K, ...)   what was seen before acting, in the world's own type
    actions               (K, ...)   what the world was told
    action_mask           bool (K, A), True where a choice was allowed; absent where the world has none
    reward                float32 (K,), what the tick brought
    episode               int32 (K,), which episode a tick belongs to, counted from 0, rising

The metadata says what the arrays mean (`spec`, as in a checkpoint's policy spec) and where they come from.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from racecraft.contract.errors import ContractError
from racecraft.contract.message import Message
from racecraft.contract.world import Array
from racecraft.formats.tensor_file import CheckpointError, read_tensors, write_tensors

KIND = "racecraft demonstration file"
SEEN = "observations/"


@dataclass(frozen=True)
class Demonstrations:
    """K ticks of whole episodes."""

    observations: Mapping[str, Array]
    """(K, ...) by name."""
    actions: Array
    """(K, *action shape)."""
    reward: Array
    """float32 (K,)."""
    episode: Array
    """int32 (K,), rising from 0."""
    spec: Mapping[str, Any]
    """What is seen and decided, as `PolicySpec.as_dictionary` tells it."""
    action_mask: Array | None = None
    """bool (K, A)."""
    source: Mapping[str, Any] = field(default_factory=dict)
    """Who showed it, in which world: plain values, for people."""

    def __len__(self) -> int:
        return len(self.actions)

    @property
    def num_episodes(self) -> int:
        """How many episodes there are."""
        return int(self.episode[-1]) + 1 if len(self) else 0

    @property
    def returns(self) -> Array:
        """What each episode's rewards sum to, float64 (E,)."""
        found: Array = np.bincount(self.episode, self.reward, self.num_episodes)
        return found


def write_demonstrations(path: str | Path, shown: Demonstrations) -> None:
    """Write a file, whole or not at all.

    Raises:
        ContractError: The arrays differ in length.
        OutputFileError: The file cannot be written.
    """
    arrays = {SEEN + name: array for name, array in shown.observations.items()}
    arrays |= {"actions": shown.actions, "reward": shown.reward, "episode": shown.episode}
    if shown.action_mask is not None:
        arrays["action_mask"] = shown.action_mask
    lengths = {name: len(array) for name, array in arrays.items()}
    if len(set(lengths.values())) > 1:
        raise ContractError(
            "demonstrations hold arrays of the lengths {lengths}; expected one length.", lengths=lengths
        )
    write_tensors(path, KIND, arrays, {"spec": dict(shown.spec), "source": dict(shown.source)})


def read_demonstrations(path: str | Path) -> Demonstrations:
    """Return what a file holds.

    Raises:
        CheckpointError: The file is missing, damaged, of another kind, or lacks an array.
    """
    path = Path(path)
    arrays, metadata = read_tensors(path, KIND)
    missing = [name for name in ("actions", "reward", "episode") if name not in arrays]
    if missing or "spec" not in metadata:
        raise CheckpointError(
            path,
            Message("it lacks {missing}", missing=", ".join(missing) or "its spec"),
            Message("what a {kind} holds", kind=KIND),
        )
    if len({len(array) for array in arrays.values()}) > 1 or not len(arrays["actions"]):
        lengths = {name: len(array) for name, array in arrays.items()}
        raise CheckpointError(
            path, Message("its arrays have the lengths {lengths}", lengths=lengths), "one length, 1 or more"
        )
    return Demonstrations(
        observations={name.removeprefix(SEEN): array for name, array in arrays.items() if name.startswith(SEEN)},
        actions=arrays["actions"],
        reward=arrays["reward"],
        episode=arrays["episode"],
        spec=metadata["spec"],
        action_mask=arrays.get("action_mask"),
        source=metadata.get("source", {}),
    )


def join_demonstrations(parts: Sequence[Demonstrations], source: Mapping[str, Any]) -> Demonstrations:
    """Return the episodes of several recordings, one behind the other.

    Args:
        parts: One or more, all of the same `spec`.
        source: Of the whole.

    Raises:
        ContractError: They are of different specs.
    """
    if any(part.spec != parts[0].spec for part in parts):
        raise ContractError("recordings of {count} different specs; expected one.", count=len(parts))
    masks = [part.action_mask for part in parts if part.action_mask is not None]
    offsets = np.cumsum([0, *(part.num_episodes for part in parts)])
    return Demonstrations(
        observations={
            name: np.concatenate([part.observations[name] for part in parts]) for name in parts[0].observations
        },
        actions=np.concatenate([part.actions for part in parts]),
        reward=np.concatenate([part.reward for part in parts]),
        episode=np.concatenate([part.episode + first for part, first in zip(parts, offsets, strict=False)]).astype(
            np.int32
        ),
        spec=parts[0].spec,
        action_mask=np.concatenate(masks) if masks else None,
        source=dict(source),
    )
