"""What a trained policy decides by, open to gradients: the door for whatever explains it. Begin with `Explainable`.

A policy that acts hands out actions; one that is explained must also say what it was fed, as numbers that can be varied
a little, and what it made of them before it took the likeliest. Every policy that `load_policy` returns is transparent;
another (of an imported model) is, as soon as it has these three.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Protocol, runtime_checkable

import torch
from torch import Tensor, nn

from racecraft.algorithms.distributions import Distribution, SquashedGaussian, numbers_width
from racecraft.algorithms.networks import IMAGE_SCALE, CustomEncoder, CustomPolicyNetwork, Encoder
from racecraft.contract.world import Array, DiscreteActions, HybridActions, MultiDiscreteActions, SingleActions

MEMORY = "(memory)"
"""Name under which a recurrent policy's state is fed, beside the observations."""


@dataclass(frozen=True)
class Scores:
    """What a policy made of R rows, before it chose; every part can be derived by what was fed."""

    numbers: Tensor
    """(R, D): the middle of each number, -1 at its lowest bound and 1 at its highest; as it is without bounds."""
    deviations: Tensor
    """(R, D): how far each number is spread around its middle, in the same units, before any bending into bounds."""
    branches: tuple[Tensor, ...]
    """(R, A) for each choice there is: logits, or what each option is worth."""
    are_q_values: bool = False
    """Whether branches hold worths, in reward units, instead of logits."""


@runtime_checkable
class Explainable(Protocol):
    """A policy that shows what it decides by."""

    @property
    def encoder(self) -> nn.Module:
        """The network from observations to features: its convolutions are what can be looked through."""
        ...

    def inputs(self, observations: Mapping[str, Array]) -> dict[str, Tensor]:
        """Return what the network would be fed were this seen next, float32 (R, …) by name; nothing is remembered."""
        ...

    def scores(self, fed: Mapping[str, Tensor]) -> Scores:
        """Return what it makes of what it is fed."""
        ...


def as_floats(eyes: nn.Module, observations: Mapping[str, Array], device: torch.device) -> dict[str, Tensor]:
    """Return the observations that a network reads as float32 that give the same features.

    Pictures of bytes are scaled to [0, 1], as our networks do it themselves; a user's own network scales them its own
    way and is given 0 to 255.
    """
    scale = 1.0 if isinstance(eyes, CustomEncoder | CustomPolicyNetwork) else IMAGE_SCALE
    fed = {}
    for name in names_read(eyes):
        tensor = torch.from_numpy(observations[name]).to(device)
        fed[name] = tensor.float() * scale if tensor.dtype == torch.uint8 else tensor.float()
    return fed


def names_read(eyes: nn.Module) -> tuple[str, ...]:
    """Return the names of the observations that a network reads."""
    assert isinstance(eyes, Encoder | CustomEncoder | CustomPolicyNetwork)
    return eyes.names


def scores_of(distribution: Distribution, params: Tensor, log_std: Tensor | None) -> Scores:
    """Return the scores that lie in the parameters (R, P) of a distribution; `log_std` is (D,), (R, D) or None."""
    width = numbers_width(distribution.spec)
    middles, logits = params[:, :width], params[:, width:]
    kind = getattr(distribution, "numbers", distribution)
    numbers = torch.tanh(middles) if isinstance(kind, SquashedGaussian) else middles
    spread = torch.zeros_like(middles) if log_std is None else log_std.exp().expand_as(middles)
    return Scores(numbers, spread, tuple(logits.split(branch_sizes(distribution.spec), dim=1)))


def branch_sizes(actions: SingleActions) -> list[int]:
    """Return how many options each choice among the actions has.

    >>> branch_sizes(DiscreteActions(5)), branch_sizes(MultiDiscreteActions((3, 2)))
    ([5], [3, 2])
    """
    if isinstance(actions, DiscreteActions):
        return [actions.count]
    if isinstance(actions, HybridActions):
        return list(actions.discrete.counts)
    return list(actions.counts) if isinstance(actions, MultiDiscreteActions) else []
