"""PPO's clipped objective and the critic's error. Begin with `ppo_loss`.

Source: Schulman et al., "Proximal policy optimization algorithms", 2017, equations 7 and 9.
"""

from __future__ import annotations

import torch
from torch import Tensor
from torch.nn import functional

from racecraft.algorithms.distributions import Distribution
from racecraft.algorithms.networks import ActorCritic
from racecraft.algorithms.ppo_batch import Minibatch
from racecraft.algorithms.ppo_config import PpoConfig
from racecraft.algorithms.recurrent_network import RecurrentActorCritic


def ppo_loss(
    network: ActorCritic, distribution: Distribution, batch: Minibatch, config: PpoConfig
) -> tuple[Tensor, Tensor]:
    """Return the loss of a minibatch, and (5,) policy loss, value loss, entropy, approximate KL, clipped share."""
    if batch.sequences is None:
        params, value = network(batch.observations)
    else:
        assert isinstance(network, RecurrentActorCritic), "only a memory asks for sequences"
        params, value = network.run(batch.observations, batch.sequences)
    objective, (policy_loss, *others) = policy_objective(params, network.log_std, distribution, batch, config)
    value_loss = value_error(value, batch, config)
    return objective + config.value_weight * value_loss, torch.stack([policy_loss, value_loss.detach(), *others])


def policy_objective(
    params: Tensor, log_std: Tensor | None, distribution: Distribution, batch: Minibatch, config: PpoConfig
) -> tuple[Tensor, Tensor]:
    """Return what the policy lessens, and (4,) policy loss, entropy, approximate KL, clipped share.

    Args:
        params: What the policy says of the minibatch, (B, P).
        log_std: How widely it draws numbers, if it draws any.
        distribution: How it draws.
        batch: What was decided, and how good it was.
        config: The settings.
    """
    log_prob, entropy = distribution.log_prob_and_entropy(params, log_std, batch.action_mask, batch.raw_actions)
    advantage = batch.advantages
    if config.standardise == "minibatch" and len(advantage) > 1:
        advantage = (advantage - advantage.mean()) / (advantage.std() + 1e-8)

    log_ratio = log_prob - batch.log_prob
    ratio = log_ratio.exp()
    held = ratio.clamp(1.0 - config.clip, 1.0 + config.clip)
    gain = torch.min(ratio * advantage, held * advantage)
    policy_loss = -(gain if batch.weights is None else batch.weights * gain).mean()
    mean_entropy = entropy.mean()

    with torch.no_grad():
        approx_kl = (ratio - 1.0 - log_ratio).mean()
        clipped = ((ratio - 1.0).abs() > config.clip).float().mean()
        figures = torch.stack([policy_loss, mean_entropy, approx_kl, clipped])
    return policy_loss - config.entropy_weight * mean_entropy, figures


def value_error(value: Tensor, batch: Minibatch, config: PpoConfig) -> Tensor:
    """Return the critic's mean error, (), before its weight: `value` (B,) is what it expects."""
    error = functional.huber_loss if config.value_loss == "huber" else functional.mse_loss
    return error(value, batch.targets)
