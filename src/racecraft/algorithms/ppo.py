"""Proximal policy optimisation with a clipped objective, on one page. Begin with `PpoLearner`.

Source: Schulman et al., "Proximal policy optimization algorithms", 2017. The details follow the AWS learner where the
settings ask for it (facts: Coach `clipped_ppo_agent.py`): advantages standardised over the rollout, the last minibatch
left out, no cut on the gradient, the value error without a half, probabilities with a floor, Adam as TensorFlow writes
it. What the world calls an end is the world's affair: an episode cut by the clock bootstraps, one that ended does not.

Results are bit-identical on the same machine, threads and versions: all chance is in generators that are saved.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import TYPE_CHECKING, Any, Self

import numpy as np
import torch
from torch import Tensor

from racecraft.algorithms.distributions import Categorical, distribution_for
from racecraft.algorithms.learner import ROLLOUT, Decision, DivergedError, StateDict
from racecraft.algorithms.network_learner import ActorCriticLearner
from racecraft.algorithms.networks import Architecture, NetworkConfig
from racecraft.algorithms.parallel_updates import one_by_one, run_in_parallel
from racecraft.algorithms.ppo_batch import Advantages, Minibatch
from racecraft.algorithms.ppo_config import PpoConfig as PpoConfig
from racecraft.algorithms.ppo_steps import GradientSteps
from racecraft.algorithms.returns import advantages, explained_variance
from racecraft.algorithms.rollout_batch import RolloutBatch
from racecraft.contract.errors import SettingError
from racecraft.contract.world import Array, ArraySpec, WorldSpec
from racecraft.settings.composition import Settings

if TYPE_CHECKING:
    from racecraft.algorithms.compiled_policy import CompiledPolicy

ROWS_AT_ONCE = 256
"""How many rows a critic that is asked later values at once."""
RAW_ACTION, LOG_PROB, VALUE = "raw_action", "log_prob", "value"
"""Columns: what was drawn, how likely it was, and what the critic expected."""

LINEAR = "linear"
SCHEDULE_ENDS = {"learning_rate": 1e-10, "clip": 0.1, "entropy_weight": 1e-5}
"""Where what falls in a straight line ends, as at ML-Agents (its `DecayedValue`s); what is below it stays."""

FIGURES = {
    "policy_loss": "Clipped surrogate, negated: falls when likelier actions were better than expected.",
    "value_loss": "Critic's error, before its weight: reward units squared (mse).",
    "entropy": "How undecided the policy is, in nats: log A at most for A choices.",
    "approx_kl": "How far the policy moved from the one that acted, in nats: mean of (ratio - 1) - log ratio, never "
    "negative.",
    "clip_fraction": "Share of transitions whose probability ratio left 1 +- clip, 0 to 1.",
    "grad_norm": "Euclidean norm of the gradient before it was cut; 0 where it is never cut (it is then not computed).",
    "explained_variance": "Share of the targets' variance the critic foresaw before the update: 1 all, 0 none, below 0 "
    "worse than none.",
    "mean_advantage": "Mean advantage before it was standardised, in reward units.",
    "transitions": "Transitions learned from in each epoch (active rows).",
    "minibatches": "Gradient steps taken.",
}
"""What an update tells: means over its minibatches, unless it says otherwise."""


class PpoLearner(ActorCriticLearner[PpoConfig]):
    """A policy with its critic, and how they improve.

    Args:
        spec: The world's promise; only its observations and actions are read.
        network: The network's settings, or a whole `Architecture`.
        config: The algorithm's settings.
        seed: Of the first weights, the order of minibatches and (unless `act` is given another) of exploration.
        device: "cpu" or "cuda".

    >>> from racecraft.contract.world import ArraySpec, DiscreteActions
    >>> seen = {"position": ArraySpec((2,), np.float32)}
    >>> learner = PpoLearner(WorldSpec("toy", 4, 1, seen, DiscreteActions(3)), NetworkConfig(), PpoConfig(), seed=1)
    >>> learner.act({"position": np.zeros((5, 2), np.float32)}).actions.shape
    (5,)
    """

    name = "ppo"
    experience = ROLLOUT
    figures = FIGURES
    supported_network_settings: tuple[str, ...] = ("normalise", "encoder", "policy")
    """Settings of `network` that are followed beside its layers."""

    def __init__(
        self,
        spec: WorldSpec,
        network: NetworkConfig | Architecture,
        config: PpoConfig,
        seed: int,
        device: str = "cpu",
    ) -> None:
        distribution = distribution_for(spec.actions, config.probability_floor, config.distribution)
        super().__init__(spec, network, config, seed, device, distribution)
        if self.network.log_std is not None:
            torch.nn.init.constant_(self.network.log_std, math.log(config.initial_std))
        self.now = config
        """The settings as the schedules have them by now."""
        self.steps = GradientSteps(self.network, distribution, config)
        self.optimiser, self.half, self.working = self.steps.optimiser, self.steps.half, self.steps.working
        self.values_later = self.network.critic_body is not None
        """Whether the critic, a network of its own, is asked once before an update and not at every tick, as at AWS;
        its weights are the same then."""
        self.explored = 0
        """Decisions drawn so far; the random share of e-greedy exploration falls with them."""
        self.columns = _columns(spec, self.values_later)

    @classmethod
    def build(cls, spec: WorldSpec, settings: Settings, seed: int) -> Self:
        """Return a learner with the settings' groups `network`, `ppo` and `runtime`.

        Raises:
            SettingError: One of them would have no say.
        """
        if settings.ppo.ratio_cap != PpoConfig.ratio_cap and not settings.ppo.asynchronous:
            raise SettingError(
                "ppo.ratio_cap is {ratio_cap:g} and ppo.asynchronous False, where no weights are old; "
                "expected ppo.asynchronous=true with it, or ppo.ratio_cap left out.",
                ratio_cap=settings.ppo.ratio_cap,
            )
        return super().build(spec, settings, seed)

    @property
    def policy_values(self) -> Mapping[str, Any]:
        """How the policy draws."""
        return {"distribution": self.config.distribution, "probability_floor": self.config.probability_floor}

    @property
    def learning_rate(self) -> float:
        """Adam's step size now."""
        return self.optimiser.learning_rate

    @property
    def epsilon(self) -> float:
        """Share of random choices now, with e-greedy exploration: from 1 in a straight line to the last one."""
        config = self.config
        return 1.0 + (config.epsilon_last - 1.0) * min(self.explored / config.epsilon_steps, 1.0)

    def anneal(self, done: float) -> None:
        """Follow the schedules: `done` is the share of the training that lies behind, 0 to 1."""
        config = self.config
        self.optimiser.learning_rate = _scheduled(config, "learning_rate", config.learning_rate_schedule, done)
        self.now = replace(
            config,
            clip=_scheduled(config, "clip", config.clip_schedule, done),
            entropy_weight=_scheduled(config, "entropy_weight", config.entropy_schedule, done),
        )

    @torch.inference_mode()
    def act(
        self,
        observations: Mapping[str, Array],
        action_mask: Array | None = None,
        *,
        generator: torch.Generator | None = None,
        rows: Array | None = None,
    ) -> Decision:
        """Decide for R rows, exploration in; see `Actor.act`."""
        params, columns = self._look(self._tensors(observations), rows)
        mask = self._mask(action_mask)
        log_std, kind, chance = self.network.log_std, self.distribution, generator or self.generator
        if self.config.exploration == "e-greedy" and isinstance(kind, Categorical):
            raw, log_prob = kind.sample_greedily(params, mask, self.epsilon, chance)
            self.explored += len(raw)
        else:
            raw, log_prob = kind.sample(params, log_std, mask, chance)
        columns |= {RAW_ACTION: raw.cpu().numpy(), LOG_PROB: log_prob.cpu().numpy()}
        return Decision(kind.to_actions(raw).cpu().numpy(), columns)

    def _look(self, seen: dict[str, Tensor], rows: Array | None) -> tuple[Tensor, dict[str, Array]]:
        """Return the policy's parameters (R, P), and the columns that come with them."""
        if self.values_later:
            return (self.policy.params(seen) if self.half is None else self.working.policy(seen)), {}
        params, value = self.working(seen)
        return params, {VALUE: value.cpu().numpy()}

    def compile_policy(self, name: str, frame: tuple[int, ...]) -> CompiledPolicy | None:
        """Return what `choose` goes by for compiled code; see `Compilable`."""
        return self.policy.compile_policy(name, frame)

    @torch.inference_mode()
    def values(self, observations: Mapping[str, Array]) -> Array:
        """Return what the critic expects from R rows, float32 (R,)."""
        return self.working.value(self._tensors(observations)).cpu().numpy()

    def update(self, experience: RolloutBatch) -> dict[str, float]:
        """Learn from a rollout: `epochs` passes over its active rows in shuffled minibatches; return `FIGURES`.

        Raises:
            DivergedError: A loss is no longer a number.
        """
        whole, rows, facts = self._prepare(experience)
        self.steps.look(whole.observations, rows)
        metrics = self.steps.run(self.minibatch_rows(rows), lambda picked: self._taken(whole, picked), self.now)
        figures = self.metrics(metrics, facts, len(rows))
        if self.architecture.normalise:  # not before: what acted and what learns read observations alike
            self.network.observe({name: values[rows] for name, values in whole.observations.items()})
        return figures

    def minibatch_rows(self, rows: Tensor) -> Iterator[Tensor]:
        """Yield the rows (int64) of one minibatch after the other, `epochs` times over."""
        for _ in range(self.config.epochs if len(rows) else 0):
            yield from self._minibatches(rows)

    def metrics(self, steps: list[Tensor], facts: tuple[float, float], transitions: int) -> dict[str, float]:
        """Return `FIGURES` of an update, from those of its steps.

        Raises:
            DivergedError: A loss is no longer a number.
        """
        means = torch.stack(steps).mean(dim=0).tolist() if steps else [0.0] * 6
        if not np.isfinite(means).all():
            raise DivergedError(
                "After {count} minibatches the losses are {means}; expected numbers. Lower ppo.learning_rate "
                "or the size of the rewards, and go on from the last checkpoint.",
                count=len(steps),
                means=means,
            )
        return dict(zip(FIGURES, [*means, *facts, transitions, len(steps)], strict=True))

    def state_dict(self) -> StateDict:
        """Return everything an exact continuation needs, as named tensors in three groups (copies)."""
        state = super().state_dict()
        if self.config.exploration == "e-greedy":
            state["exploration"] = {"decisions": torch.tensor(self.explored)}
        return state

    def load_state_dict(self, state: Mapping[str, Mapping[str, Tensor]]) -> None:
        """Go on from what `state_dict` gave; groups other than "network" may be absent (weights alone)."""
        super().load_state_dict(state)
        if self.half is not None:
            self.half.refresh()
        if "exploration" in state:
            self.explored = int(state["exploration"]["decisions"])

    def _prepare(self, batch: RolloutBatch) -> tuple[Minibatch, Tensor, tuple[float, float]]:
        """Return all rows laid end to end, the numbers of the active ones, and two facts for the record."""
        estimates = self.compute_advantages(batch)
        used = estimates.advantages[batch.active]
        facts = facts_of(estimates.values[batch.active], used, estimates.targets[batch.active])
        found = estimates.advantages
        if self.config.standardise == "rollout" and used.size > 1:
            found = (found - used.mean()) / (used.std() + 1e-8)
        whole = self.flatten(batch, replace(estimates, advantages=found))
        return whole, torch.from_numpy(np.flatnonzero(batch.active)).to(self.device), facts

    def compute_advantages(self, batch: RolloutBatch) -> Advantages:
        """Return how good every decision of a rollout was."""
        value = self._values_of(batch) if self.values_later else batch.columns[VALUE]
        return self._advantages(batch, value, batch.columns[LOG_PROB])

    def _advantages(
        self, batch: RolloutBatch, value: Array, log_prob: Array, weights: Array | None = None
    ) -> Advantages:
        """Return the advantages given each tick's value, log-probability and, off policy, weight, float32 (T, R)."""
        config = self.config
        advantage, targets = advantages(
            batch.reward, value, self._next_values(batch, value), batch.terminated, batch.truncated,
            config.discount, config.gae_lambda, None if batch.active.all() else batch.active, weights,
        )  # fmt: skip
        return Advantages(value, advantage, targets, log_prob, weights)

    def flatten(self, batch: RolloutBatch, estimates: Advantages) -> Minibatch:
        """Return all rows of a rollout laid end to end."""
        return Minibatch(
            observations=self.working.prepare(
                {name: self._flattened(array) for name, array in batch.observations.items()}
            ),
            raw_actions=self._flattened(batch.columns[RAW_ACTION]),
            log_prob=self._flattened(estimates.log_prob),
            advantages=self._flattened(estimates.advantages.astype(np.float32, copy=False)),
            targets=self._flattened(estimates.targets.astype(np.float32, copy=False)),
            action_mask=None if batch.action_mask is None else self._flattened(batch.action_mask),
            weights=None if estimates.weights is None else self._flattened(estimates.weights),
        )

    def _next_values(self, batch: RolloutBatch, value: Array) -> Array:
        """Return what followed each tick, float32 (T, R): the next row's value, the final observation's where cut."""
        following = np.concatenate([value[1:], self.values(batch.last_observations)[None]])
        if len(batch.final_index):
            following[batch.final_places] = self.values(batch.final_observations)
        return following

    def _values_of(self, batch: RolloutBatch) -> Array:
        """Return the critic's values of what was seen, float32 (T, R); zeros where a row is not active."""
        active = batch.active.reshape(-1)
        assert self.network.critic_body is not None, "a critic that is asked later has layers of its own"
        names = self.network.critic_body.names
        seen = {name: array.reshape(-1, *array.shape[2:]) for name in names for array in (batch.observations[name],)}
        found = np.zeros(len(active), np.float32)
        parts = np.array_split(np.flatnonzero(active), -(-int(active.sum()) // ROWS_AT_ONCE) or 1)

        def value(some: list[Array]) -> Iterator[None]:
            for rows in some:
                found[rows] = self.values({name: array[rows] for name, array in seen.items()}) if len(rows) else 0.0
                yield

        run_through = run_in_parallel if self.steps.learns_apart else one_by_one
        run_through(value(parts[::2]), value(parts[1::2]))
        return found.reshape(batch.active.shape)

    def _minibatches(self, rows: Tensor) -> Iterator[Tensor]:
        """Yield the rows in a new order, `batch_size` at a time."""
        size = self.config.batch_size
        if self.config.drop_remainder and len(rows) < size:
            size = 1 << (len(rows).bit_length() - 1)  # facts: markov `training_worker.py` lowers it to a power of two
        order = rows[torch.randperm(len(rows), generator=self.generator, device=self.device)]
        for picked in order.split(size):
            if len(picked) == size or not self.config.drop_remainder:
                yield picked

    def _taken(self, whole: Minibatch, picked: Tensor) -> Minibatch:
        """Return what a minibatch's rows hold."""
        return whole.take(picked)


def facts_of(values: Array, found: Array, targets: Array) -> tuple[float, float]:
    """Return explained variance and mean advantage of the active rows, (A,) each; noughts where there are none."""
    return (explained_variance(values, targets), float(found.mean())) if found.size else (0.0, 0.0)


def _scheduled(config: PpoConfig, name: str, schedule: str, done: float) -> float:
    """Return a setting as its schedule has it when a share of the training, 0 to 1, is done."""
    start: float = getattr(config, name)
    end = min(start, SCHEDULE_ENDS[name])
    return start + (end - start) * min(done, 1.0) if schedule == LINEAR else start


def _columns(spec: WorldSpec, values_later: bool) -> dict[str, ArraySpec]:
    """Return what `act` notes of each row."""
    noted = {
        RAW_ACTION: ArraySpec(spec.actions.shape, spec.actions.dtype, doc="what was drawn"),
        LOG_PROB: ArraySpec((), np.float32, doc="log-probability of what was drawn"),
    }
    return noted if values_later else {**noted, VALUE: ArraySpec((), np.float32, doc="what the critic expected")}
