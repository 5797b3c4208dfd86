"""The greedy policy of a recurrent network: it carries a state for every row it plays. Begin with `RecurrentPolicy`."""

from __future__ import annotations

from collections.abc import Mapping

import torch
from torch import Tensor

from racecraft.algorithms.distributions import Categorical, Distribution
from racecraft.algorithms.explainable import MEMORY, Scores, as_floats, scores_of
from racecraft.algorithms.networks import CustomEncoder, CustomPolicyNetwork, Encoder
from racecraft.algorithms.recurrent_network import RecurrentActorCritic, RowStates
from racecraft.contract.world import Array


class RecurrentPolicy:
    """The likeliest action for what is seen and was seen; nothing privileged is asked. It follows its network.

    Args:
        network: Gives the parameters of the actions, and the next state.
        distribution: What the parameters mean.
    """

    def __init__(self, network: RecurrentActorCritic, distribution: Distribution) -> None:
        self.network, self.distribution = network, distribution
        self.states = RowStates(network.state_width, self._device)

    @torch.inference_mode()
    def act(self, observations: Mapping[str, Array], action_mask: Array | None = None) -> Array:
        """Return actions (R, *action shape); every row moves on by a tick."""
        params, states = self._params(observations)
        self.states.keep(None, states)
        raw, _ = self.distribution.mode(params, self.network.log_std, self._mask(action_mask))
        return self.distribution.to_actions(raw).cpu().numpy()

    @torch.inference_mode()
    def sample(self, observations: Mapping[str, Array], action_mask: Array | None, generator: torch.Generator) -> Array:
        """Return actions (R, *action shape) drawn by their probability; every row moves on by a tick."""
        params, states = self._params(observations)
        self.states.keep(None, states)
        raw, _ = self.distribution.sample(params, self.network.log_std, self._mask(action_mask), generator)
        return self.distribution.to_actions(raw).cpu().numpy()

    @torch.inference_mode()
    def probabilities(self, observations: Mapping[str, Array], action_mask: Array | None = None) -> Array:
        """Return how likely each of A choices is, float32 (R, A), were this seen next; nothing is remembered."""
        assert isinstance(self.distribution, Categorical), "only single choices have probabilities"
        params, _ = self._params(observations)
        return self.distribution.probabilities(params, self._mask(action_mask)).cpu().numpy()

    def reset_state(self, rows: Array) -> None:
        """Begin anew for the rows whose episode ended."""
        self.states.reset_state(rows)

    @property
    def encoder(self) -> Encoder | CustomEncoder | CustomPolicyNetwork:
        """The network from observations to features."""
        return self.network.policy_body

    def inputs(self, observations: Mapping[str, Array]) -> dict[str, Tensor]:
        """Return what the network would be fed, its state under `MEMORY`; see `Explainable`."""
        fed = as_floats(self.encoder, observations, self._device)
        states = self.states.of(None, len(next(iter(fed.values()))))
        return fed | {MEMORY: states.clone()}  # a copy from outside inference mode, through which gradients may pass

    def scores(self, fed: Mapping[str, Tensor]) -> Scores:
        """Return what it makes of what it is fed; see `Explainable`."""
        params, _ = self.network.policy_carry(fed, fed[MEMORY])
        return scores_of(self.distribution, params, self.network.log_std)

    @property
    def _device(self) -> torch.device:
        return next(self.network.parameters()).device

    def _params(self, observations: Mapping[str, Array]) -> tuple[Tensor, Tensor]:
        names = self.network.policy_body.names
        seen = {name: torch.from_numpy(observations[name]).to(self._device) for name in names}
        return self.network.policy_carry(seen, self.states.of(None, len(next(iter(seen.values())))))

    def _mask(self, action_mask: Array | None) -> Tensor | None:
        return None if action_mask is None else torch.from_numpy(action_mask).to(self._device)
