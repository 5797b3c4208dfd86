"""The gradient of PPO's loss, written out, for small networks of dense layers. Begin with `ClosedForm`.

In a network of 64 x 64 units a minibatch is a fifth of a millisecond of arithmetic, and half of one more of autograd
noting every operation, asking each for its way back and laying new memory out. The way back through dense layers is
known: each line below is the derivative of a line of the way there, and gradients are written where the last ones lay.
The sums are taken in another order than autograd's: equal to some digits of float32, not to the bit.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import torch
from torch import Tensor, nn

from racecraft.algorithms.dense_layers import DenseLayers, dense_layers
from racecraft.algorithms.distributions import (
    FORBIDDEN_LOGIT,
    HALF_LOG_TAU,
    LOG_STD_RANGE,
    Categorical,
    DiagGaussian,
    Distribution,
)
from racecraft.algorithms.networks import ActorCritic, OwnActorCritic
from racecraft.algorithms.ppo_batch import Minibatch
from racecraft.algorithms.ppo_config import PpoConfig
from racecraft.algorithms.recurrent_network import RecurrentActorCritic

MAX_WEIGHTS = 100_000
"""Networks up to this size take the way that is written out; in larger ones arithmetic outweighs the bookkeeping."""


def closed_form_of(network: ActorCritic, distribution: Distribution) -> ClosedForm | None:
    """Return the written-out gradient of a network that there is one for, else None.

    There is one for small float32 networks on a processor that read one vector through dense layers, for policy and
    critic, and choose one of A without a floor or draw numbers that are not squashed.
    """
    if isinstance(network, OwnActorCritic | RecurrentActorCritic):
        return None
    size = sum(one.numel() for one in network.parameters())
    first = next(network.parameters())
    if size > MAX_WEIGHTS or first.device.type != "cpu" or first.dtype != torch.float32:
        return None
    draws = type(distribution) is DiagGaussian or (isinstance(distribution, Categorical) and distribution.floor == 0.0)
    policy, critic = dense_layers(network.policy_body), dense_layers(network.critic_body)
    if not draws or policy is None or (critic is None and network.critic_body is not None):
        return None
    return ClosedForm(network, policy, critic)


class ClosedForm:
    """How PPO's loss changes with the weights of a network; made by `closed_form_of`."""

    def __init__(self, network: ActorCritic, policy: DenseLayers, critic: DenseLayers | None) -> None:
        self.policy_head, self.value_head, self.log_std = network.policy_head, network.value_head, network.log_std
        self.body, self.critic = Body(policy), None if critic is None else Body(critic)

    @torch.no_grad()
    def find_gradients(self, batch: Minibatch, config: PpoConfig) -> Tensor:
        """Leave with the weights the gradients of a minibatch's loss; return its figures (5,), as `ppo_loss` does."""
        seen = self.body.forward(batch)
        weighed = seen if self.critic is None else self.critic.forward(batch)
        params = torch.addmm(self.policy_head.bias, seen[-1], self.policy_head.weight.t())
        value = torch.addmm(self.value_head.bias, weighed[-1], self.value_head.weight.t())
        if self.log_std is None:
            back, (policy_loss, *others) = way_back_of_choices(params, batch, config)
        else:
            back, (policy_loss, *others) = way_back_of_numbers(params, self.log_std, batch, config)
        back_of_value, value_loss = way_back_of_values(value.squeeze(1), batch, config)

        _leave(self.policy_head, back, seen[-1])
        _leave(self.value_head, back_of_value, weighed[-1])
        back_of_body, back_of_critic = back @ self.policy_head.weight, back_of_value * self.value_head.weight
        if self.critic is None:
            self.body.backward(seen, back_of_body.add_(back_of_critic))
        else:
            self.body.backward(seen, back_of_body)
            self.critic.backward(weighed, back_of_critic)
        return torch.stack([policy_loss, value_loss, *others])


class Body:
    """Dense layers over one vector, each with the same non-linearity behind it."""

    def __init__(self, layers: DenseLayers) -> None:
        self.name, self.vector, self.layers, self.is_tanh = layers

    def forward(self, batch: Minibatch) -> list[Tensor]:
        """Return what went into each layer, (B, width); the last is what came out."""
        passed: list[Tensor] = [self.vector(batch.observations[self.name])]
        for layer in self.layers:
            product = torch.addmm(layer.bias, passed[-1], layer.weight.t())
            passed.append(product.tanh_() if self.is_tanh else product.relu_())
        return passed

    def backward(self, passed: list[Tensor], back: Tensor) -> None:
        """Leave the gradients of the layers with them; `back` (B, width) is that of what came out."""
        for layer, (went_in, came_out) in zip(reversed(self.layers), reversed([*pairwise(passed)]), strict=True):
            if self.is_tanh:
                back = torch.ops.aten.tanh_backward(back, came_out)
            else:
                back = torch.ops.aten.threshold_backward(back, came_out, 0)
            _leave(layer, back, went_in)
            if went_in is not passed[0]:  # nobody asks how the loss changes with what is seen
                back = back @ layer.weight


@dataclass(frozen=True)
class Surrogate:
    """PPO's clipped objective of B decisions."""

    pull: Tensor
    """How the loss changes with each decision's log-probability, (B,)."""
    figures: tuple[Tensor, Tensor, Tensor]
    """Policy loss, approximate KL and clipped share."""


def surrogate(log_prob: Tensor, batch: Minibatch, config: PpoConfig) -> Surrogate:
    """Return the objective of decisions that are now so likely, (B,) in nats.

    Where the ratio times the advantage is the smaller, it moves; where it is held at the clip, nothing does.
    """
    advantage = batch.advantages
    if config.standardise == "minibatch" and len(advantage) > 1:
        advantage = (advantage - advantage.mean()) / (advantage.std() + 1e-8)
    log_ratio = log_prob - batch.log_prob
    ratio = log_ratio.exp()
    free = ratio * advantage
    held = ratio.clamp(1.0 - config.clip, 1.0 + config.clip) * advantage
    gain, moves = torch.minimum(free, held), free * (free <= held)
    if batch.weights is not None:
        gain, moves = batch.weights * gain, batch.weights * moves
    further = ratio - 1.0
    clipped = (further.abs() > config.clip).float().mean()
    return Surrogate(moves.div_(-len(moves)), (-gain.mean(), (further - log_ratio).mean(), clipped))


def way_back_of_choices(logits: Tensor, batch: Minibatch, config: PpoConfig) -> tuple[Tensor, tuple[Tensor, ...]]:
    """Return how the policy's loss changes with the logits, (B, A), and its loss, entropy, KL and clipped share.

    The log-probability of a choice changes with the logits by `onehot - p`, the entropy by `-p (log p + entropy)`.
    """
    if batch.action_mask is not None:
        logits = logits.masked_fill(~batch.action_mask, FORBIDDEN_LOGIT)
    log_p = torch.log_softmax(logits, dim=1)
    p = log_p.exp()
    chosen = batch.raw_actions.unsqueeze(1)
    found = surrogate(log_p.gather(1, chosen).squeeze(1), batch, config)
    pull = found.pull.unsqueeze(1)
    back = (p * -pull).scatter_add_(1, chosen, pull)
    entropy = -(p * log_p).sum(dim=1, keepdim=True)
    if config.entropy_weight:
        back.addcmul_(p, log_p + entropy, value=config.entropy_weight / len(p))
    loss, divergence, clipped = found.figures
    return back, (loss, entropy.mean(), divergence, clipped)


def way_back_of_numbers(
    mean: Tensor, log_std: Tensor, batch: Minibatch, config: PpoConfig
) -> tuple[Tensor, tuple[Tensor, ...]]:
    """Return how the policy's loss changes with the means, (B, A), and its loss, entropy, KL and clipped share.

    The gradient of `log_std` (A,) is left with it.
    """
    low, high = LOG_STD_RANGE
    std = log_std.clamp(low, high)
    away = (batch.raw_actions - mean) * torch.exp(-std)
    squared = away.square()
    found = surrogate((-0.5 * squared - std - HALF_LOG_TAU).sum(dim=1), batch, config)
    pull = found.pull.unsqueeze(1)
    free = (log_std >= low) & (log_std <= high)
    log_std.grad = ((pull * (squared - 1.0)).sum(dim=0) - config.entropy_weight) * free
    loss, divergence, clipped = found.figures
    return pull * away * torch.exp(-std), (loss, (std + 0.5 + HALF_LOG_TAU).sum(), divergence, clipped)


def way_back_of_values(value: Tensor, batch: Minibatch, config: PpoConfig) -> tuple[Tensor, Tensor]:
    """Return how the critic's weighted error changes with its values, (B, 1), and that error before its weight, ()."""
    away = value - batch.targets
    weight = config.value_weight / len(value)
    if config.value_loss == "huber":
        back, error = away.clamp(-1.0, 1.0) * weight, nn.functional.huber_loss(value, batch.targets)
    else:
        back, error = away * (2.0 * weight), away.square().mean()
    return back.unsqueeze(1), error


def _leave(layer: nn.Linear, back: Tensor, went_in: Tensor) -> None:
    """Leave a layer's gradients with it, of what came back (B, units) and what went in (B, width)."""
    weight, bias = layer.weight, layer.bias
    if weight.grad is None or bias.grad is None:
        weight.grad, bias.grad = torch.empty_like(weight), torch.empty_like(bias)
    torch.mm(back.t(), went_in, out=weight.grad)
    torch.sum(back, 0, out=bias.grad)
