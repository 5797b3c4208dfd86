"""First weights of a policy whose file does not hold all of it, such as the critic that no frozen graph has."""

from __future__ import annotations

from collections.abc import Container
from typing import Any

import numpy as np
import torch

from racecraft.algorithms.networks import ActorCritic, architecture_from
from racecraft.algorithms.policy_spec import PolicySpec
from racecraft.algorithms.twin_critics import SoftActorCritic
from racecraft.algorithms.weights import to_arrays
from racecraft.contract.world import Array

SEED = 0


def fresh_weights(spec: PolicySpec, besides: Container[str]) -> dict[str, Array]:
    """Return the weights that a policy begins with, but for those of the names that are there.

    Args:
        spec: A policy of `ppo` or `sac`.
        besides: Names of the weights that are known.
    """
    chance = torch.Generator().manual_seed(SEED)
    network_class: Any = SoftActorCritic if spec.algorithm == "sac" else ActorCritic
    network = network_class(spec.observations, spec.actions, architecture_from(spec.network), chance)
    fresh = to_arrays(dict(network.state_dict()))
    return {name: np.array(array) for name, array in fresh.items() if name not in besides}
