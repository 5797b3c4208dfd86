"""What any learner with one network and one optimiser writes down, and how it goes on from there."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import torch
from torch import Tensor, nn

if TYPE_CHECKING:
    from racecraft.algorithms.learner import StateDict


def saved_state(network: nn.Module, optimiser: Any, generator: torch.Generator | None = None) -> StateDict:
    """Return weights, optimiser and chance as named tensors in groups (copies).

    Args:
        network: Its weights are the group "network".
        optimiser: Of this package; its moments are the group "optimiser".
        generator: What the learner draws from; None where all it draws hangs on counters of its own.
    """
    state = {"network": copied(network), "optimiser": optimiser.state_dict()}
    return state if generator is None else {**state, "generator": {"state": generator.get_state()}}


def restore_state(
    state: Mapping[str, Mapping[str, Tensor]],
    network: nn.Module,
    optimiser: Any,
    generator: torch.Generator | None = None,
) -> None:
    """Go on from what `saved_state` gave; groups other than "network" may be absent or empty (weights alone)."""
    network.load_state_dict(dict(state["network"]))
    if state.get("optimiser"):
        optimiser.load_state_dict(state["optimiser"])
    if generator is not None and "generator" in state:
        generator.set_state(state["generator"]["state"].cpu())


def copied(network: nn.Module) -> dict[str, Tensor]:
    """Return a network's weights and buffers by name, each a copy."""
    return {name: value.detach().clone() for name, value in network.state_dict().items()}
