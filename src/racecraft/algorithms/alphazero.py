"""Learning by search, on one page: a policy follows what a search with it would choose, its critic who won.

Sources: Silver et al., "Mastering the game of Go without human knowledge", 2017; Anthony et al., "Thinking fast and
slow with deep learning and tree search", 2017. The search is the world's: beside what is seen it shows `SEARCHED`, how
often a search that asked this policy walked each choice. So this page knows no game, and learns wherever a world brings
a search along.

What differs from the source: several agents may choose at once, each by its own counts; a rollout is learned from while
it is fresh and no replay is kept; critics foresee discounted rewards, as PPO's do, so that the weights of a PPO run are
a fit beginning (`--from RUN`).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
import torch
from torch import Tensor
from torch.nn.utils import clip_grad_norm_

from racecraft.algorithms.adam import Adam
from racecraft.algorithms.distributions import distribution_for
from racecraft.algorithms.learner import ROLLOUT, Decision, DivergedError
from racecraft.algorithms.network_learner import ActorCriticLearner
from racecraft.algorithms.networks import ActorCritic, Architecture, NetworkConfig
from racecraft.algorithms.returns import advantages, explained_variance
from racecraft.algorithms.rollout_batch import RolloutBatch
from racecraft.contract.errors import SettingError
from racecraft.contract.world import Array, WorldSpec
from racecraft.settings.table import check_group, setting

SEARCHED = "searched"
"""Observation of a world that brings a search along, float32 (A,): share of the walks that each choice had; zeros where
nothing was searched."""
ROWS_AT_ONCE = 1024
"""How many rows the critic values at once before an update."""

FIGURES = {
    "policy_loss": "Cross entropy between what was searched and the policy, in nats.",
    "value_loss": "Critic's squared error, before its weight, in reward units squared.",
    "search_entropy": "How undecided the searches were, in nats: the least that policy_loss can be.",
    "agreement": "Share of the rows in which the policy would choose what was walked most, 0 to 1.",
    "grad_norm": "Euclidean norm of the gradient before it was cut.",
    "explained_variance": "Share of the targets' variance the critic foresaw before the update: 1 all, 0 none.",
    "transitions": "Transitions learned from in each epoch.",
    "minibatches": "Gradient steps taken.",
}
"""What an update tells: means over its minibatches, unless it says otherwise."""

Symmetry = Callable[[Mapping[str, Tensor]], dict[str, Tensor]]
"""Turns named rows, `SEARCHED` and `action_mask` among them, into rows that the world would treat alike."""


@dataclass(frozen=True)
class AlphaZeroConfig:
    """Learning by search: the policy follows a search that asks it, the critic what came of the games."""

    learning_rate: float = setting(3e-4, "Adam's step size.", low=1e-8, high=1.0)
    discount: float = setting(0.995, "Weight of the next tick's value (gamma).", low=0.0, high=1.0)
    outcome_lambda: float = setting(
        0.97, "How far the critic learns from what came of a game, 1, or from its own hopes on the way, 0.",
        low=0.0, high=1.0,
    )  # fmt: skip
    epochs: int = setting(3, "Passes over each rollout.", low=1, high=100)
    batch_size: int = setting(512, "Transitions in one minibatch.", low=1)
    value_weight: float = setting(1.0, "Weight of the value loss.", low=0.0)
    max_grad_norm: float | None = setting(1.0, "Gradients are scaled down to this norm.", low=0.0)
    temperature: float = setting(
        0.4, "How evenly choices are drawn while training: 1 as often as they were walked, 0 the most walked.",
        low=0.0, high=10.0,
    )  # fmt: skip

    def __post_init__(self) -> None:
        check_group(self)


class AlphaZeroLearner(ActorCriticLearner[AlphaZeroConfig]):
    """A policy with its critic that learns from a search.

    Args:
        spec: The world's promise, `SEARCHED` among its observations; the network does not see it.
        network: The network's settings, or a whole `Architecture`.
        config: The algorithm's settings.
        seed: Of the first weights, the order of minibatches and exploration.
        device: "cpu" or "cuda".

    Raises:
        SettingError: The world brings no search along.
    """

    name = "alphazero"
    experience = ROLLOUT
    figures = FIGURES
    supported_network_settings = ("encoder",)
    """Settings of `network` that are followed beside its layers."""

    def __init__(
        self,
        spec: WorldSpec,
        network: NetworkConfig | Architecture,
        config: AlphaZeroConfig,
        seed: int,
        device: str = "cpu",
    ) -> None:
        if SEARCHED not in spec.observations:
            raise SettingError(
                "--algorithm alphazero learns from a search, and {name} brings none along; expected "
                "`racecraft snakes train`. Use ppo.",
                name=spec.name,
            )
        seen = {name: part for name, part in spec.observations.items() if name != SEARCHED}
        spec = replace(spec, observations=seen)
        super().__init__(spec, network, config, seed, device, distribution_for(spec.actions))
        self.optimiser = Adam(self.network.parameters(), config.learning_rate, 1e-8)
        self.symmetries: Sequence[Symmetry] = ()
        """Each minibatch is seen through one of these, or as it is; whoever knows the world gives them."""

    def act(
        self,
        observations: Mapping[str, Array],
        action_mask: Array | None = None,
        *,
        generator: torch.Generator | None = None,
        rows: Array | None = None,
    ) -> Decision:
        """Draw choices from what was searched; rows for which nothing was searched do what the policy would."""
        walked = torch.from_numpy(observations[SEARCHED])
        is_searched = walked.sum(dim=1) > 0
        choices = torch.from_numpy(self.policy.act(observations, action_mask)).long()
        if is_searched.any():
            likely = walked[is_searched]
            likely = likely / likely.amax(dim=1, keepdim=True)
            if self.config.temperature > 0.0:
                likely = likely ** (1.0 / self.config.temperature)
                drawn = torch.multinomial(likely.to(self.device), 1, generator=generator or self.generator)
                choices[is_searched] = drawn.squeeze(1).cpu()
            else:
                choices[is_searched] = likely.argmax(dim=1)
        return Decision(choices.numpy(), {})

    def update(self, experience: RolloutBatch) -> dict[str, float]:
        """Learn from a rollout: `epochs` passes over its searched rows in shuffled minibatches; return `FIGURES`.

        Raises:
            DivergedError: A loss is no longer a number.
        """
        whole, rows, foreseen = self._prepare(experience)
        losses = [
            self._step({name: array[picked] for name, array in whole.items()})
            for _ in range(self.config.epochs if len(rows) else 0)
            for picked in rows[torch.randperm(len(rows), generator=self.generator, device=self.device)].split(
                self.config.batch_size
            )
        ]
        means = torch.stack(losses).mean(dim=0).tolist() if losses else [0.0] * 5
        if not np.isfinite(means).all():
            raise DivergedError(
                "After {count} minibatches the losses are {means}; expected numbers. Lower "
                "alphazero.learning_rate, and go on from the last checkpoint.",
                count=len(losses),
                means=means,
            )
        return dict(zip(FIGURES, [*means, foreseen, len(rows), len(losses)], strict=True))

    def _prepare(self, batch: RolloutBatch) -> tuple[dict[str, Tensor], Tensor, float]:
        """Return all rows end to end with their targets, the numbers of the searched ones, and what was foreseen."""
        value = self._values(batch.observations, batch.active)
        following = np.concatenate([value[1:], self._values(batch.last_observations, batch.last_active)[None]])
        if len(batch.final_index):
            everybody = np.ones(len(batch.final_index), bool)
            following[batch.final_places] = self._values(batch.final_observations, everybody)
        _, targets = advantages(
            batch.reward, value, following, batch.terminated, batch.truncated, self.config.discount,
            self.config.outcome_lambda, None if batch.active.all() else batch.active,
        )  # fmt: skip

        whole = {name: self._flattened(array) for name, array in batch.observations.items()}
        whole["targets"] = self._flattened(targets.astype(np.float32, copy=False))
        if batch.action_mask is not None:
            whole["action_mask"] = self._flattened(batch.action_mask)
        learned = (batch.active & (batch.observations[SEARCHED].sum(axis=-1) > 0)).ravel()
        rows, foreseen = np.flatnonzero(learned), 0.0
        if len(rows):
            foreseen = explained_variance(value.ravel()[rows], targets.ravel()[rows])
        return whole, torch.from_numpy(rows).to(self.device), foreseen

    @torch.inference_mode()
    def _values(self, observations: Mapping[str, Array], which: Array) -> Array:
        """Return what the critic expects of the rows marked in `which`, float32 of its shape; 0 elsewhere."""
        numbers = np.flatnonzero(which)
        found = np.zeros(which.size, np.float32)
        seen = {name: observations[name].reshape(-1, *observations[name].shape[which.ndim :])
                for name in self.network.policy_body.names}  # fmt: skip
        for start in range(0, len(numbers), ROWS_AT_ONCE):
            rows = numbers[start : start + ROWS_AT_ONCE]
            tensors = {name: self._tensor(array[rows]) for name, array in seen.items()}
            found[rows] = self.network.value(tensors).cpu().numpy()
        return found.reshape(which.shape)

    def _step(self, batch: dict[str, Tensor]) -> Tensor:
        """Take one gradient step and return its figures, in the order of `FIGURES`."""
        turn = int(torch.randint(len(self.symmetries) + 1, (1,), generator=self.generator, device=self.device))
        if turn:
            batch = self.symmetries[turn - 1](batch)
        loss, figures = alphazero_loss(self.network, batch, self.config.value_weight)
        self.network.zero_grad()
        loss.backward()
        limit = self.config.max_grad_norm
        norm = clip_grad_norm_(self.network.parameters(), float("inf") if limit is None else limit)
        self.optimiser.step()
        return torch.cat([figures, norm.detach().reshape(1)])


def alphazero_loss(network: ActorCritic, batch: Mapping[str, Tensor], value_weight: float) -> tuple[Tensor, Tensor]:
    """Return the loss of a minibatch and the first four of `FIGURES`.

    Args:
        network: Policy and critic.
        batch: Observations by name (B, ...), `SEARCHED` (B, A), `targets` (B,) and, where the world has one,
            `action_mask` (B, A).
        value_weight: Weight of the critic's squared error.
    """
    logits, values = network(batch)
    if "action_mask" in batch:
        logits = logits.masked_fill(~batch["action_mask"], -1e9)
    log_p = torch.log_softmax(logits, dim=1)
    searched = batch[SEARCHED]
    policy_loss = -(searched * log_p).sum(dim=1).mean()
    value_loss = (values - batch["targets"]).square().mean()
    with torch.no_grad():
        entropy = -(searched * searched.clamp_min(1e-12).log()).sum(dim=1).mean()
        agreement = (log_p.argmax(dim=1) == searched.argmax(dim=1)).float().mean()
        figures = torch.stack([policy_loss, value_loss, entropy, agreement])
    return policy_loss + value_weight * value_loss, figures
