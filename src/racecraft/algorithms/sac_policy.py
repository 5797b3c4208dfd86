"""The greedy policy of soft actor-critic. Begin with `SacPolicy`."""

from __future__ import annotations

from collections.abc import Mapping

import torch
from torch import Tensor

from racecraft.algorithms.distributions import SquashedGaussian
from racecraft.algorithms.explainable import Scores, as_floats, scores_of
from racecraft.algorithms.networks import Encoder
from racecraft.algorithms.twin_critics import SoftActorCritic
from racecraft.contract.world import Array


class SacPolicy:
    """The middle of what it would draw, every time; nothing privileged is asked. It follows its network."""

    def __init__(self, network: SoftActorCritic, kind: SquashedGaussian) -> None:
        self.network, self.kind = network, kind
        self.device = next(network.parameters()).device

    @torch.inference_mode()
    def act(self, observations: Mapping[str, Array], action_mask: Array | None = None) -> Array:
        """Return actions (R, *action shape)."""
        mean, _ = self.network.policy(self.tensors(observations))
        return self.kind.to_actions(mean).cpu().numpy()

    @torch.inference_mode()
    def sample(self, observations: Mapping[str, Array], action_mask: Array | None, generator: torch.Generator) -> Array:
        """Return actions (R, *action shape) drawn by their probability."""
        mean, log_std = self.network.policy(self.tensors(observations))
        raw, _ = self.kind.sample(mean, log_std, None, generator)
        return self.kind.to_actions(raw).cpu().numpy()

    def reset_state(self, rows: Array) -> None:
        """Nothing is remembered from tick to tick."""

    def tensors(self, observations: Mapping[str, Array]) -> dict[str, Tensor]:
        """Return what the policy reads, as tensors."""
        return {name: torch.from_numpy(observations[name]).to(self.device) for name in self.network.eyes.names}

    @property
    def encoder(self) -> Encoder:
        """The network from observations to features."""
        return self.network.eyes

    def inputs(self, observations: Mapping[str, Array]) -> dict[str, Tensor]:
        """Return what the network would be fed; see `Explainable`."""
        return as_floats(self.encoder, observations, self.device)

    def scores(self, fed: Mapping[str, Tensor]) -> Scores:
        """Return what it makes of what it is fed; see `Explainable`."""
        mean, log_std = self.network.policy(fed)
        return scores_of(self.kind, mean, log_std)
