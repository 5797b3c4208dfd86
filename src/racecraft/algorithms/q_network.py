"""From named observations to what each choice is worth, and the policy that takes the best. Begin with `QNetwork`."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import torch
from torch import Tensor, nn

from racecraft.algorithms.explainable import Scores, as_floats
from racecraft.algorithms.networks import (
    HIDDEN_GAIN,
    Architecture,
    Encoder,
    activation,
    architecture_from,
    dense,
)
from racecraft.algorithms.policy_spec import PolicySpec
from racecraft.contract.world import Array, ArraySpec, DiscreteActions

FORBIDDEN_VALUE = -1e9
"""What a masked choice is worth: less than any other."""
HEAD_GAIN = 0.01
"""Gain of the last layer's orthogonal start: at first everything is worth almost nothing."""


class QNetwork(nn.Module):
    """What each of A choices is worth: the discounted sum of rewards from there on.

    Args:
        observations: What the world shows, by name; privileged ones are not read.
        actions: The choices.
        architecture: The body as a row of figures.
        dueling: Whether what a moment is worth and what each choice adds to it are told apart, each by a stream with a
            layer of its own in place of the trunk's last (Wang et al., "Dueling network architectures for deep
            reinforcement learning", 2016).
        generator: Chance for the first weights; the global generator is not touched.
    """

    def __init__(
        self,
        observations: Mapping[str, ArraySpec],
        actions: DiscreteActions,
        architecture: Architecture,
        dueling: bool,
        generator: torch.Generator,
    ) -> None:
        super().__init__()
        visible = {name: part for name, part in observations.items() if not part.privileged}
        self.count = actions.count
        units = architecture.trunk_units
        streams = units[-1:] if dueling else ()
        body = replace(architecture, trunk_units=units[:-1] if streams else units)
        self.body = Encoder(visible, body, generator)

        def head(width: int) -> nn.Sequential:
            hidden: list[nn.Module] = []
            before = self.body.width
            for size in streams:
                gain = HIDDEN_GAIN[architecture.activation]
                hidden += [dense(before, size, architecture, generator, gain), activation(architecture)]
                before = size
            return nn.Sequential(*hidden, dense(before, width, architecture, generator, HEAD_GAIN))

        self.choices = head(actions.count)
        self.moment = head(1) if dueling else None

    def forward(self, observations: Mapping[str, Tensor]) -> Tensor:
        """Return what each choice is worth, (R, A), in reward units."""
        features = self.body(observations).float()
        worth: Tensor = self.choices(features)
        if self.moment is None:
            return worth
        moment: Tensor = self.moment(features)
        return moment + worth - worth.mean(dim=1, keepdim=True)


def allowed_only(worth: Tensor, mask: Tensor | None) -> Tensor:
    """Return worths with the forbidden choices (mask False) worth less than any other."""
    return worth if mask is None else worth.masked_fill(~mask, FORBIDDEN_VALUE)


class QPolicy:
    """The choice that is worth most, every time. It follows its network, which may learn on."""

    def __init__(self, network: QNetwork) -> None:
        self.network = network

    @torch.inference_mode()
    def act(self, observations: Mapping[str, Array], action_mask: Array | None = None) -> Array:
        """Return the best allowed choice of each row, int64 (R,)."""
        worth, mask = self._worth(observations), _tensor(action_mask, self._device)
        return allowed_only(worth, mask).argmax(dim=1).cpu().numpy()

    @torch.inference_mode()
    def values(self, observations: Mapping[str, Array]) -> Array:
        """Return what each choice is worth, float32 (R, A), in reward units."""
        return self._worth(observations).cpu().numpy()

    def probabilities(self, observations: Mapping[str, Array], action_mask: Array | None = None) -> Array:
        """Return how likely each choice is, float32 (R, A): 1 for the best and 0 for all others.

        The policy takes the best every time; a softmax of worths would tell of a policy that nobody plays. What the
        choices are worth, `values` tells.
        """
        best = self.act(observations, action_mask)
        return np.eye(self.network.count, dtype=np.float32)[best]

    def sample(self, observations: Mapping[str, Array], action_mask: Array | None, generator: torch.Generator) -> Array:
        """Return the best allowed choice of each row, int64 (R,): it is the only probable one."""
        return self.act(observations, action_mask)

    def reset_state(self, rows: Array) -> None:
        """Nothing is remembered from tick to tick."""

    @property
    def encoder(self) -> Encoder:
        """The network from observations to features."""
        return self.network.body

    def inputs(self, observations: Mapping[str, Array]) -> dict[str, Tensor]:
        """Return what the network would be fed; see `Explainable`."""
        return as_floats(self.encoder, observations, self._device)

    def scores(self, fed: Mapping[str, Tensor]) -> Scores:
        """Return what each choice is worth; see `Explainable`."""
        worth: Tensor = self.network(fed)
        none = worth[:, :0]
        return Scores(none, none, (worth,), are_q_values=True)

    @property
    def _device(self) -> torch.device:
        return next(self.network.parameters()).device

    def _worth(self, observations: Mapping[str, Array]) -> Tensor:
        names = self.network.body.names
        worth: Tensor = self.network({name: torch.from_numpy(observations[name]).to(self._device) for name in names})
        return worth


def load_q_policy(spec: PolicySpec, weights: Mapping[str, Tensor]) -> QPolicy:
    """Return the policy that a spec and its weights describe."""
    assert isinstance(spec.actions, DiscreteActions), "values are told of single choices"
    architecture, dueling = architecture_from(spec.network), bool(spec.network.get("dueling", False))
    network = QNetwork(spec.observations, spec.actions, architecture, dueling, torch.Generator().manual_seed(0))
    network.load_state_dict(dict(weights))
    return QPolicy(network)


def _tensor(array: Array | None, device: torch.device) -> Tensor | None:
    return None if array is None else torch.from_numpy(array).to(device)
