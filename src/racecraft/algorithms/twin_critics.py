"""The networks of soft actor-critic: an actor over what is visible, and two critics side by side.

An observation is embedded as everywhere (`networks.Encoder`: convolutions for images, vectors as they are). What stands
between the eyes and the heads follows from what the world offers:

    vectors only    no eyes to learn: actor and critics are networks of their own, as in the paper
    images          one pair of eyes; the critics' error teaches them, the actor looks through them and does not
    + privileges    the critics read the true state instead and need no eyes; the actor's own loss teaches its eyes

Why the actor does not teach shared eyes: its gradient pulls features away from what the critics just learned to read,
and learning turns unstable (Yarats et al., "Improving sample efficiency in model-free reinforcement learning from
images", 2021). Why there is no slow copy of the eyes for the targets: the heads' is enough (Yarats et al., "Mastering
visual continuous control", 2021), and convolutions are where the time goes; each frame is looked at once.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from itertools import pairwise

import torch
from torch import Tensor, nn

from racecraft.algorithms.networks import (
    CRITIC_UNITS,
    HIDDEN_GAIN,
    POLICY_GAIN,
    Architecture,
    Encoder,
    dense,
    dense_stack,
    is_image,
)
from racecraft.contract.world import ArraySpec, ContinuousActions

LOG_STD_RANGE = (-20.0, 2.0)
"""Where the log standard deviation is held (facts: Coach `sac_head.py`; the paper's own code, too)."""


class TwinCritics(nn.Module):
    """Two critics of equal shape whose weights lie one behind the other: one product serves both.

    Args:
        width: F, features of what is seen.
        actions: A, how many numbers an action has.
        units: Dense layers.
        architecture: Non-linearity and start of the weights.
        generator: Chance for the first weights.
    """

    def __init__(
        self, width: int, actions: int, units: tuple[int, ...], architecture: Architecture, generator: torch.Generator
    ) -> None:
        super().__init__()
        self.weights, self.biases = nn.ParameterList(), nn.ParameterList()
        self.bend = torch.tanh_ if architecture.activation == "tanh" else torch.relu_
        sizes = (width + actions, *units, 1)
        for layer, (before, after) in enumerate(pairwise(sizes)):
            gain = 1.0 if layer == len(units) else HIDDEN_GAIN[architecture.activation]
            both = [dense(before, after, architecture, generator, gain) for _ in range(2)]
            self.weights.append(nn.Parameter(torch.stack([one.weight.detach().t() for one in both]).contiguous()))
            self.biases.append(nn.Parameter(torch.zeros(2, 1, after)))

    def forward(self, features: Tensor, actions: Tensor, frozen: bool = False) -> Tensor:
        """Return what both expect, (2, R), of features (R, F) and actions (R, A) in [-1, 1].

        With `frozen`, a gradient passes through to the actions, and no weight gets one.
        """
        flow = torch.cat([features, actions], dim=1).expand(2, -1, -1)
        last = len(self.weights) - 1
        for layer, (weight, bias) in enumerate(zip(self.weights, self.biases, strict=True)):
            if frozen:
                weight, bias = weight.detach(), bias.detach()
            flow = torch.baddbmm(bias, flow, weight)
            flow = flow if layer == last else self.bend(flow)
        return flow.squeeze(2)


class SoftActorCritic(nn.Module):
    """Actor and critics over named observations; see the head of this page for who sees what.

    Args:
        observations: What the world shows, by name.
        actions: What the world obeys.
        architecture: The network as a row of figures; its trunk is the actor's and the critics'.
        generator: Chance for the first weights; the global generator is not touched.
    """

    def __init__(
        self,
        observations: Mapping[str, ArraySpec],
        actions: ContinuousActions,
        architecture: Architecture,
        generator: torch.Generator,
    ) -> None:
        super().__init__()
        visible = {name: part for name, part in observations.items() if not part.privileged}
        vectors = {name: part for name, part in observations.items() if not is_image(part)}
        bare = replace(architecture, trunk_units=())
        count, units = math.prod(actions.shape), architecture.trunk_units

        self.eyes = Encoder(visible, bare, generator)
        self.actor = dense_stack(self.eyes.width, units, architecture, generator)
        width = units[-1] if units else self.eyes.width
        self.actor.append(dense(width, 2 * count, architecture, generator, POLICY_GAIN))

        self.critic_eyes: Encoder | None = None
        is_privileged = architecture.privileged_critic and any(part.privileged for part in vectors.values())
        if is_privileged:
            self.critic_eyes = Encoder(vectors, bare, generator)
            units = units if not any(map(is_image, visible.values())) else CRITIC_UNITS
        elif architecture.separate_networks:
            self.critic_eyes = Encoder(visible, bare, generator)
        self.critics = TwinCritics((self.critic_eyes or self.eyes).width, count, units, architecture, generator)

    def actor_parameters(self) -> list[nn.Parameter]:
        """Return what the actor's loss moves: its layers, and the eyes where the critics do not look through them."""
        own = [*self.actor.parameters()]
        return own if self.critic_eyes is None else [*self.eyes.parameters(), *own]

    def critic_parameters(self) -> list[nn.Parameter]:
        """Return what the critics' loss moves: their layers, and the eyes they look through."""
        return [*(self.critic_eyes or self.eyes).parameters(), *self.critics.parameters()]

    def features(self, observations: Mapping[str, Tensor]) -> tuple[Tensor, Tensor]:
        """Return features for the actor (R, F) and for the critics (R, G).

        No gradient comes back from the actor to shared ones.
        """
        seen = self.eyes(observations)
        return (seen.detach(), seen) if self.critic_eyes is None else (seen, self.critic_eyes(observations))

    def decide(self, features: Tensor) -> tuple[Tensor, Tensor]:
        """Return means (R, A) before the tanh, and log standard deviations (R, A)."""
        mean, log_std = self.actor(features).chunk(2, dim=1)
        return mean, log_std.clamp(*LOG_STD_RANGE)

    def policy(self, observations: Mapping[str, Tensor]) -> tuple[Tensor, Tensor]:
        """Return what `decide` does, from what is seen; needs no privileged observation."""
        return self.decide(self.eyes(observations))
