"""REINFORCE, the oldest policy gradient, on one page to be read from top to bottom. Begin with `reinforce_loss`.

Source: Williams, "Simple statistical gradient-following algorithms for connectionist reinforcement learning", 1992.

Play whole episodes by the policy's own chance. Let G be what an action and all after it brought. Then

    the gradient of the expected return  =  the expectation of  G * gradient of log probability(action)

so one makes each action likelier in proportion to what followed it. That is all; there is no critic, no ratio, no
second pass: the episodes are learned from once, in one step, and new ones are played.

A *baseline* b, whatever it is as long as it does not hang on the action, may be taken from G: the expectation stays and
the noise shrinks. Three are here: `none` (Williams's bare form), `mean` (the mean of all G at hand) and `value` (a
critic that learns to foresee G from what is seen; it also says what would have come where the clock cut an episode).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor
from torch.nn.utils import clip_grad_norm_

from racecraft.algorithms.adam import Adam
from racecraft.algorithms.distributions import Distribution, distribution_for
from racecraft.algorithms.learner import EPISODES, Decision, DivergedError
from racecraft.algorithms.network_learner import ActorCriticLearner
from racecraft.algorithms.networks import ActorCritic, Architecture, NetworkConfig
from racecraft.algorithms.returns import episode_returns, explained_variance, rewards_to_go
from racecraft.algorithms.rollout_batch import RolloutBatch
from racecraft.contract.world import Array, ArraySpec, WorldSpec
from racecraft.settings.table import check_group, setting

ROWS_AT_ONCE = 4096
"""Transitions whose gradient is taken at once; the step is that of all of them."""
RAW_ACTION = "raw_action"
"""Column: what was drawn."""

FIGURES = {
    "policy_loss": "Mean of -(G - b) log probability: its gradient is what counts, its value says little.",
    "value_loss": "The baseline's error, before its weight: reward units squared; 0 without a critic.",
    "entropy": "How undecided the policy is, in nats: log A at most for A choices.",
    "grad_norm": "Euclidean norm of the gradient before it was cut.",
    "explained_variance": "Share of the variance of G that the critic foresaw: 1 all, 0 none; 0 without a critic.",
    "mean_return": "Mean plain sum of rewards of the episodes learned from.",
    "transitions": "Transitions learned from.",
    "whole_episodes": "Whole episodes learned from.",
}
"""What an update tells."""


@dataclass(frozen=True)
class ReinforceConfig:
    """REINFORCE: each action grows likelier by what followed it."""

    learning_rate: float = setting(1e-3, "Adam's step size.", low=1e-8, high=1.0)
    discount: float = setting(0.99, "Weight of the next tick's reward (gamma).", low=0.0, high=1.0)
    baseline: str = setting(
        "value",
        "What is taken from the return: nothing, the mean return at hand, or what a critic expected.",
        choices=("none", "mean", "value"),
    )
    scale_returns: bool = setting(
        True, "Divide what is left by its root mean square, so that the step does not hang on the rewards' unit."
    )
    entropy_weight: float = setting(0.0, "Weight of the entropy bonus.", low=0.0, high=1.0)
    value_weight: float = setting(0.5, "Weight of the critic's error.", low=0.0)
    max_grad_norm: float | None = setting(None, "Gradients are scaled down to this norm.", low=0.0)

    def __post_init__(self) -> None:
        check_group(self)


class ReinforceLearner(ActorCriticLearner[ReinforceConfig]):
    """A policy that learns from whole episodes, and its baseline.

    Args:
        spec: The world's promise; only its observations and actions are read.
        network: The network's settings, or a whole `Architecture`.
        config: The algorithm's settings.
        seed: Of the first weights and (unless `act` is given another generator) of exploration.
        device: "cpu" or "cuda".

    >>> from racecraft.contract.world import ArraySpec, DiscreteActions
    >>> seen = {"position": ArraySpec((2,), np.float32)}
    >>> world = WorldSpec("toy", 4, 1, seen, DiscreteActions(3))
    >>> ReinforceLearner(world, NetworkConfig(), ReinforceConfig(), seed=1).experience
    'episodes'
    """

    name = "reinforce"
    experience = EPISODES
    figures = FIGURES
    supported_network_settings = ("encoder",)
    """Settings of `network` that are followed beside its layers."""

    def __init__(
        self,
        spec: WorldSpec,
        network: NetworkConfig | Architecture,
        config: ReinforceConfig,
        seed: int,
        device: str = "cpu",
    ) -> None:
        super().__init__(spec, network, config, seed, device, distribution_for(spec.actions))
        self.optimiser = Adam(self.network.parameters(), config.learning_rate, 1e-8)
        self.columns = {RAW_ACTION: ArraySpec(spec.actions.shape, spec.actions.dtype, doc="what was drawn")}

    @torch.inference_mode()
    def act(
        self,
        observations: Mapping[str, Array],
        action_mask: Array | None = None,
        *,
        generator: torch.Generator | None = None,
        rows: Array | None = None,
    ) -> Decision:
        """Draw an action for each of R rows by its probability; see `Actor.act`."""
        params = self.network.policy(self._tensors(observations))
        chance = generator or self.generator
        raw, _ = self.distribution.sample(params, self.network.log_std, self._mask(action_mask), chance)
        return Decision(self.distribution.to_actions(raw).cpu().numpy(), {RAW_ACTION: raw.cpu().numpy()})

    def update(self, experience: RolloutBatch) -> dict[str, float]:
        """Take one step along the gradient of the whole episodes at hand; return `FIGURES`.

        Raises:
            DivergedError: A loss is no longer a number.
        """
        batch, config = experience, self.config
        critic = config.baseline == "value"
        value = self._values(batch.observations) if critic else np.zeros_like(batch.reward)
        returns = rewards_to_go(
            batch.reward, batch.terminated, batch.truncated, config.discount, self._after_the_cut(batch, value)
        )

        rows = np.flatnonzero(batch.active.reshape(-1))
        found = returns.reshape(-1)[rows]
        advantage = found - (value.reshape(-1)[rows] if critic else found.mean() if config.baseline == "mean" else 0.0)
        if config.scale_returns:
            advantage = advantage / (np.sqrt(np.mean(np.square(advantage))) + 1e-8)

        losses, norm = self._step(batch, rows, found, advantage.astype(np.float32)) if len(rows) else ([0.0] * 3, 0.0)
        count, mean = episode_returns(batch.reward, batch.terminated | batch.truncated, batch.active)
        metrics = [*losses, norm, explained_variance(value.reshape(-1)[rows], found) if critic and len(rows) else 0.0]
        if not np.isfinite([*losses, norm]).all():
            raise DivergedError(
                "the losses are {losses}, the gradient's norm is {norm}; expected numbers. Lower "
                "reinforce.learning_rate or the size of the rewards, and go on from the last checkpoint.",
                losses=losses,
                norm=norm,
            )
        episodes = int(count.sum())
        mean_return = float(np.nansum(mean * count) / max(episodes, 1))
        return dict(zip(FIGURES, [*metrics, mean_return, len(rows), episodes], strict=True))

    def _step(self, batch: RolloutBatch, rows: Array, returns: Array, advantage: Array) -> tuple[list[float], float]:
        """Step along the gradient of all rows, taken some at a time; return the three losses and the norm."""
        self.network.zero_grad(set_to_none=True)
        losses = torch.zeros(3, device=self.device)
        for begin in range(0, len(rows), ROWS_AT_ONCE):
            some = slice(begin, begin + ROWS_AT_ONCE)
            taken = rows[some]
            loss, parts = reinforce_loss(
                self.network,
                self.distribution,
                {name: self._flattened(array, taken) for name, array in batch.observations.items()},
                self._flattened(batch.columns[RAW_ACTION], taken),
                torch.from_numpy(advantage[some]).to(self.device),
                torch.from_numpy(returns[some]).to(self.device),
                None if batch.action_mask is None else self._flattened(batch.action_mask, taken),
                self.config,
            )
            share = len(taken) / len(rows)
            (loss * share).backward()
            losses += parts * share
        limit = float("inf") if self.config.max_grad_norm is None else self.config.max_grad_norm
        norm = clip_grad_norm_(self.network.parameters(), limit)
        self.optimiser.step()
        return losses.tolist(), float(norm)

    def _after_the_cut(self, batch: RolloutBatch, value: Array) -> Array | None:
        """Return what the critic expects behind each tick that the clock cut off, float32 (T, R); None: no critic."""
        if self.config.baseline != "value":
            return None
        following = np.zeros_like(value)
        if len(batch.final_index):
            last = {name: array[None] for name, array in batch.final_observations.items()}
            following[batch.final_places] = self._values(last)[0]
        return following

    @torch.inference_mode()
    def _values(self, observations: Mapping[str, Array]) -> Array:
        """Return what the critic expects, float32 (T, R), from observations (T, R, ...)."""
        ticks, rows = next(iter(observations.values())).shape[:2]
        flat = np.arange(ticks * rows)
        parts = [
            self.network.value({name: self._flattened(array, some) for name, array in observations.items()})
            .cpu()
            .numpy()
            for some in np.split(flat, range(ROWS_AT_ONCE, len(flat), ROWS_AT_ONCE))
        ]
        return np.concatenate(parts).reshape(ticks, rows)


def reinforce_loss(
    network: ActorCritic,
    distribution: Distribution,
    observations: Mapping[str, Tensor],
    raw_actions: Tensor,
    advantage: Tensor,
    returns: Tensor,
    action_mask: Tensor | None,
    config: ReinforceConfig,
) -> tuple[Tensor, Tensor]:
    """Return the loss of B transitions, and (3,) its parts: policy loss, value loss, entropy.

    Args:
        network: Policy and critic; the critic is asked with baseline `value` only.
        distribution: What the policy's parameters mean.
        observations: Named tensors (B, ...).
        raw_actions: What was drawn, (B, ...).
        advantage: float32 (B,), G - b: what followed, less what was expected. No gradient flows through it.
        returns: float32 (B,), G: what the critic shall foresee.
        action_mask: bool (B, A) or None.
        config: Weights, and which baseline.
    """
    critic = config.baseline == "value"
    params, value = network(observations) if critic else (network.policy(observations), returns)
    log_prob, entropy = distribution.log_prob_and_entropy(params, network.log_std, action_mask, raw_actions)

    policy_loss = -(advantage * log_prob).mean()
    value_loss = (value - returns).square().mean()
    mean_entropy = entropy.mean()
    loss = policy_loss - config.entropy_weight * mean_entropy
    if critic:
        loss = loss + config.value_weight * value_loss
    return loss, torch.stack([policy_loss, value_loss, mean_entropy]).detach()
