"""Actions drawn by their probability instead of the likeliest ones. Begin with `sample_actions`."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Protocol, runtime_checkable

import numpy as np
import torch

from racecraft.contract.world import Array


@runtime_checkable
class Sampler(Protocol):
    """A policy that can draw."""

    def sample(self, observations: Mapping[str, Array], action_mask: Array | None, generator: torch.Generator) -> Array:
        """Return actions (R, *action shape) drawn by their probability; what it remembers moves on as in `act`."""
        ...


def sample_actions(
    policy: Sampler, observations: Mapping[str, Array], action_mask: Array | None, rng: np.random.Generator
) -> Array:
    """Return actions (R, *action shape) drawn by their probability.

    Args:
        policy: On the processor.
        observations: (R, …) by name.
        action_mask: bool (R, A), or None.
        rng: Every draw moves it on; the same generator gives the same actions again.
    """
    seed = int(rng.integers(np.iinfo(np.int64).max))
    return policy.sample(observations, action_mask, torch.Generator().manual_seed(seed))
