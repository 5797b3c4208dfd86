"""The greedy policy of an actor network: the likeliest action, every time. Begin with `ActorPolicy`."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import torch
from torch import Tensor

from racecraft.algorithms.distributions import GAUSSIAN, Categorical, Distribution, distribution_for
from racecraft.algorithms.explainable import Scores, as_floats, scores_of
from racecraft.algorithms.networks import (
    ActorCritic,
    Architecture,
    CustomEncoder,
    CustomPolicyNetwork,
    Encoder,
    OwnActorCritic,
    architecture_from,
)
from racecraft.algorithms.policy_spec import PolicySpec
from racecraft.algorithms.recurrent_network import NONE, RecurrentActorCritic
from racecraft.algorithms.recurrent_policy import RecurrentPolicy
from racecraft.contract.world import Array

if TYPE_CHECKING:
    from racecraft.algorithms.compiled_policy import CompiledPolicy


class ActorPolicy:
    """The likeliest action for what is seen; nothing privileged is asked. It follows its network, which may learn on.

    Args:
        network: Gives the parameters of the actions.
        distribution: What they mean.
    """

    def __init__(self, network: ActorCritic, distribution: Distribution) -> None:
        self.network, self.distribution = network, distribution
        self._any_weight = next(network.parameters())

    @torch.inference_mode()
    def act(self, observations: Mapping[str, Array], action_mask: Array | None = None) -> Array:
        """Return actions (R, *action shape)."""
        raw, _ = self.distribution.mode(self._params(observations), self.network.log_std, self._mask(action_mask))
        return self.distribution.to_actions(raw).cpu().numpy()

    @torch.inference_mode()
    def sample(self, observations: Mapping[str, Array], action_mask: Array | None, generator: torch.Generator) -> Array:
        """Return actions (R, *action shape) drawn by their probability."""
        params, mask = self._params(observations), self._mask(action_mask)
        raw, _ = self.distribution.sample(params, self.network.log_std, mask, generator)
        return self.distribution.to_actions(raw).cpu().numpy()

    @torch.inference_mode()
    def probabilities(self, observations: Mapping[str, Array], action_mask: Array | None = None) -> Array:
        """Return how likely each of A choices is, float32 (R, A); discrete actions only."""
        assert isinstance(self.distribution, Categorical), "only single choices have probabilities"
        return self.distribution.probabilities(self._params(observations), self._mask(action_mask)).cpu().numpy()

    @torch.inference_mode()
    def evaluate(self, observations: Mapping[str, Array], action_mask: Array | None = None) -> tuple[Array, Array]:
        """Return how likely each of A choices is, float32 (R, A), and what the critic expects, float32 (R,).

        Discrete actions only, and a critic that sees nothing privileged.
        """
        assert isinstance(self.distribution, Categorical), "only single choices have probabilities"
        names = self.network.policy_body.names
        device = self._device
        seen = {name: torch.from_numpy(observations[name]).to(device) for name in names}
        params, values = self.network(seen)
        chances = self.distribution.probabilities(params, self._mask(action_mask))
        return chances.cpu().numpy(), values.cpu().numpy()

    def reset_state(self, rows: Array) -> None:
        """Nothing is remembered from tick to tick."""

    def compile_policy(self, name: str, frame: tuple[int, ...]) -> CompiledPolicy | None:
        """Return its look at a frame for compiled code; see `Compilable`."""
        from racecraft.algorithms.compiled_policy import compile_policy  # brings Numba along

        return compile_policy(self.network, self.distribution, name, frame)

    @property
    def encoder(self) -> Encoder | CustomEncoder | CustomPolicyNetwork:
        """The network from observations to features."""
        return self.network.policy_body

    def inputs(self, observations: Mapping[str, Array]) -> dict[str, Tensor]:
        """Return what the network would be fed; see `Explainable`."""
        return as_floats(self.encoder, observations, self._device)

    def scores(self, fed: Mapping[str, Tensor]) -> Scores:
        """Return what it makes of what it is fed; see `Explainable`."""
        return scores_of(self.distribution, self.network.policy(fed), self.network.log_std)

    @property
    def _device(self) -> torch.device:
        return self._any_weight.device

    def params(self, seen: Mapping[str, Tensor]) -> Tensor:
        """Return the numbers (R, P) that a decision is drawn by."""
        return self.network.policy(seen)

    def _params(self, observations: Mapping[str, Array]) -> Tensor:
        names = self.network.policy_body.names
        return self.params({name: torch.from_numpy(observations[name]).to(self._device) for name in names})

    def _mask(self, action_mask: Array | None) -> Tensor | None:
        return None if action_mask is None else torch.from_numpy(action_mask).to(self._device)


def actor_critic_class(architecture: Architecture) -> type[ActorCritic]:
    """Return the class of an architecture's network: a user's own, with a memory or without."""
    if architecture.policy is not None:
        return OwnActorCritic
    return ActorCritic if architecture.memory == NONE else RecurrentActorCritic


def load_actor_policy(spec: PolicySpec, weights: Mapping[str, Tensor]) -> ActorPolicy | RecurrentPolicy:
    """Return the policy that a spec and its weights describe."""
    floor, numbers = spec.network.get("probability_floor", 0.0), spec.network.get("distribution", GAUSSIAN)
    architecture, chance = architecture_from(spec.network), torch.Generator().manual_seed(0)
    network = actor_critic_class(architecture)(spec.observations, spec.actions, architecture, chance)
    network.load_state_dict(dict(weights))
    distribution = distribution_for(spec.actions, floor, numbers)
    if isinstance(network, RecurrentActorCritic):
        return RecurrentPolicy(network, distribution)
    return ActorPolicy(network, distribution)
