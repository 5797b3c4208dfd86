"""Proximal policy optimisation with a clipped objective, on one page. Begin with `PpoLearner`.

Source: Schulman et al., "Proximal policy optimization algorithms", 2017. The details follow the AWS learner where the
settings ask for it (facts: Coach `clipped_ppo_agent.py`): advantages standardised over the rollout, the last minibatch
left out, no cut on the gradient, the value error without a half, probabilities with a floor, Adam as TensorFlow writes
it. What the world calls an end is the world's affair: an episode cut by the clock bootstraps, one that ended does not.

Results are bit-identical on the same machine, threads and versions: all chance is in generators that are saved.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
import torch
from torch import Tensor
from torch.nn import functional

from racecraft.algorithms.adam import Adam
from racecraft.algorithms.distributions import Choices, Distribution, distribution_for
from racecraft.algorithms.half_precision import HalfTwin, settled
from racecraft.algorithms.networks import ActorCritic, Architecture, architecture_of
from racecraft.algorithms.returns import advantages, explained_variance, next_values
from racecraft.algorithms.rollout_batch import Experience
from racecraft.contract.errors import RacecraftError
from racecraft.contract.world import Array, WorldSpec
from racecraft.settings.groups import NetworkConfig, PpoConfig

StateDict = dict[str, dict[str, Tensor]]

ROWS_AT_ONCE = 256
"""How many rows a critic that is asked later values at once."""


class DivergedError(RacecraftError):
    """The losses are no longer numbers; the weights of this update are worth nothing."""


class Decision(NamedTuple):
    """What a policy decided for R rows."""

    actions: Array
    """What the world obeys, (R, *action shape), in the type of the world's action spec."""
    samples: Array
    """What was drawn: the same for discrete actions; float32 (R, A) in [-1, 1] units, not cut, for continuous ones."""
    log_prob: Array
    """float32 (R,): log-probability of the samples."""
    value: Array
    """float32 (R,): what the critic expects from here; zeros where the learner asks it later (`values_later`)."""


@dataclass(frozen=True)
class PpoLosses:
    """What one update came to: means over its minibatches, unless it says otherwise."""

    policy_loss: float
    """Clipped surrogate, negated: falls when likelier actions were better than expected."""
    value_loss: float
    """Critic's error, before its weight: reward units squared (mse)."""
    entropy: float
    """How undecided the policy is, in nats: log A at most for A choices."""
    approx_kl: float
    """How far the policy moved from the one that acted, in nats: mean of (ratio - 1) - log ratio, never negative."""
    clip_fraction: float
    """Share of transitions whose probability ratio left 1 +- clip, 0 to 1."""
    grad_norm: float
    """Euclidean norm of the gradient before it was cut; 0 where it is never cut (it is then not computed)."""
    explained_variance: float
    """Share of the targets' variance the critic foresaw before the update: 1 all, 0 none, below 0 worse than none."""
    mean_advantage: float
    """Mean advantage before it was standardised, in reward units."""
    transitions: int
    """Transitions learned from in each epoch (active rows)."""
    minibatches: int
    """Gradient steps taken."""


@dataclass
class Minibatch:
    """B transitions, as tensors on the learner's device."""

    observations: dict[str, Tensor]
    samples: Tensor
    log_prob: Tensor
    advantages: Tensor
    targets: Tensor
    action_mask: Tensor | None = None

    def take(self, rows: Tensor) -> Minibatch:
        """Return the chosen rows (int64 (B,))."""
        return Minibatch(
            observations={name: numbers.index_select(0, rows) for name, numbers in self.observations.items()},
            samples=self.samples.index_select(0, rows),
            log_prob=self.log_prob.index_select(0, rows),
            advantages=self.advantages.index_select(0, rows),
            targets=self.targets.index_select(0, rows),
            action_mask=None if self.action_mask is None else self.action_mask.index_select(0, rows),
        )


class PpoLearner:
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

    def __init__(
        self,
        spec: WorldSpec,
        network: NetworkConfig | Architecture,
        config: PpoConfig,
        seed: int,
        device: str = "cpu",
    ) -> None:
        self.spec, self.config, self.device = spec, config, torch.device(device)
        self.architecture = architecture_of(network) if isinstance(network, NetworkConfig) else network
        self.distribution: Distribution = distribution_for(spec.actions, config.probability_floor)
        chance = torch.Generator().manual_seed(seed)
        self.network = ActorCritic(spec.observations, spec.actions, self.architecture, chance).to(self.device)
        self.twin = HalfTwin(self.network) if settled(config.precision) == "bfloat16" else None
        self.working = self.network if self.twin is None else self.twin.network
        """What explores and learns: the network itself, or its twin of half the precision."""
        self.generator = torch.Generator(self.device).manual_seed(seed + 1)
        self.optimiser = Adam(self.network.parameters(), config.learning_rate, config.adam_epsilon, config.adam_form)
        self.values_later = self.network.critic_body is not None and self.architecture.separate_networks
        """Whether the critic, a network as large as the policy, is asked once before an update and not at every tick,
        as at AWS; its weights are the same then."""
        self.explored = 0
        """Decisions drawn so far; the random share of e-greedy exploration falls with them."""

    @property
    def learning_rate(self) -> float:
        """Adam's step size now; set it between updates to anneal it."""
        return self.optimiser.learning_rate

    @learning_rate.setter
    def learning_rate(self, rate: float) -> None:
        self.optimiser.learning_rate = rate

    @property
    def epsilon(self) -> float:
        """Share of random choices now, with e-greedy exploration: from 1 in a straight line to the last one."""
        config = self.config
        return 1.0 + (config.epsilon_last - 1.0) * min(self.explored / config.epsilon_steps, 1.0)

    @torch.inference_mode()
    def act(
        self,
        observations: Mapping[str, Array],
        action_mask: Array | None = None,
        greedy: bool = False,
        generator: torch.Generator | None = None,
    ) -> Decision:
        """Decide for R rows.

        Args:
            observations: Named arrays (R, ...); names the network does not know are ignored.
            action_mask: bool (R, A), True where an action is allowed, or None.
            greedy: Take the likeliest action instead of drawing one.
            generator: Chance to draw with; the learner's own by default.
        """
        if self.values_later:
            numbers = self.working.policy(self._tensors(observations))
            value = torch.zeros(len(numbers))
        else:
            numbers, value = self.working(self._tensors(observations))
        mask = None if action_mask is None else torch.from_numpy(action_mask).to(self.device)
        log_std, kind = self.network.log_std, self.distribution
        chance = generator or self.generator
        if greedy:
            samples, log_prob = kind.best(numbers, log_std, mask)
        elif self.config.exploration == "e-greedy" and isinstance(kind, Choices):
            samples, log_prob = kind.sample_greedily(numbers, mask, self.epsilon, chance)
            self.explored += len(samples)
        else:
            samples, log_prob = kind.sample(numbers, log_std, mask, chance)
        actions = kind.to_actions(samples)
        return Decision(actions.cpu().numpy(), samples.cpu().numpy(), log_prob.cpu().numpy(), value.cpu().numpy())

    @torch.inference_mode()
    def choose(self, observations: Mapping[str, Array], action_mask: Array | None = None) -> Array:
        """Return greedy actions (R, *action shape) without asking the critic: needs no privileged observation."""
        visible = {name: observations[name] for name in self.network.policy_body.names}
        numbers = self.network.policy(self._tensors(visible))
        mask = None if action_mask is None else torch.from_numpy(action_mask).to(self.device)
        samples, _ = self.distribution.best(numbers, self.network.log_std, mask)
        return self.distribution.to_actions(samples).cpu().numpy()

    @torch.inference_mode()
    def chances(self, observations: Mapping[str, Array], action_mask: Array | None = None) -> Array:
        """Return how likely the policy makes each of A choices, float32 (R, A); discrete actions only."""
        visible = {name: observations[name] for name in self.network.policy_body.names}
        numbers = self.network.policy(self._tensors(visible))
        mask = None if action_mask is None else torch.from_numpy(action_mask).to(self.device)
        assert isinstance(self.distribution, Choices)
        return self.distribution.chances(numbers, mask).cpu().numpy()

    @torch.inference_mode()
    def values(self, observations: Mapping[str, Array]) -> Array:
        """Return what the critic expects from R rows, float32 (R,)."""
        return self.working.value(self._tensors(observations)).cpu().numpy()

    def update(self, experience: Experience) -> PpoLosses:
        """Learn from a rollout: `epochs` passes over its active rows in shuffled minibatches.

        Raises:
            DivergedError: A loss is no longer a number.
        """
        whole, rows, facts = self._prepare(experience)
        figures = [
            self._step(whole.take(picked))
            for _ in range(self.config.epochs if len(rows) else 0)
            for picked in self._minibatches(rows)
        ]
        means = torch.stack(figures).mean(dim=0).tolist() if figures else [0.0] * 6
        if not np.isfinite(means).all():
            raise DivergedError(
                f"After {len(figures)} minibatches the losses are {means}; expected numbers. Lower ppo.learning_rate "
                "or the size of the rewards, and go on from the last checkpoint."
            )
        return PpoLosses(
            policy_loss=means[0],
            value_loss=means[1],
            entropy=means[2],
            approx_kl=means[3],
            clip_fraction=means[4],
            grad_norm=means[5],
            explained_variance=facts[0],
            mean_advantage=facts[1],
            transitions=len(rows),
            minibatches=len(figures),
        )

    def state_dict(self) -> StateDict:
        """Return everything an exact continuation needs, as named tensors in three groups (copies)."""
        state = {
            "network": {name: value.detach().clone() for name, value in self.network.state_dict().items()},
            "optimiser": self.optimiser.state_dict(),
            "generator": {"state": self.generator.get_state()},
        }
        if self.config.exploration == "e-greedy":
            state["exploration"] = {"decisions": torch.tensor(self.explored)}
        return state

    def load_state_dict(self, state: Mapping[str, Mapping[str, Tensor]]) -> None:
        """Go on from what `state_dict` gave; groups other than "network" may be absent (weights alone)."""
        self.network.load_state_dict(dict(state["network"]))
        if self.twin is not None:
            self.twin.refresh()
        if state.get("optimiser"):
            self.optimiser.load_state_dict(state["optimiser"])
        if "exploration" in state:
            self.explored = int(state["exploration"]["decisions"])
        if "generator" in state:
            self.generator.set_state(state["generator"]["state"].cpu())

    def _prepare(self, experience: Experience) -> tuple[Minibatch, Tensor, tuple[float, float]]:
        """Return all rows laid end to end, the numbers of the active ones, and two facts for the record."""
        config = self.config
        kept = replace(experience, value=self._values_of(experience)) if self.values_later else experience
        following = next_values(kept.value, kept.last_value, kept.final_value, kept.truncated)
        found, targets = advantages(
            kept.reward, kept.value, following, kept.terminated, kept.truncated,
            config.discount, config.gae_lambda, None if kept.active.all() else kept.active,
        )  # fmt: skip
        active = kept.active.reshape(-1)
        used = found.reshape(-1)[active]
        facts = (
            explained_variance(kept.value.reshape(-1)[active], targets.reshape(-1)[active]) if used.size else 0.0,
            float(used.mean()) if used.size else 0.0,
        )
        if config.standardise == "rollout" and used.size > 1:
            found = (found - used.mean()) / (used.std() + 1e-8)

        def laid(array: Array) -> Tensor:
            return torch.from_numpy(array.reshape(-1, *array.shape[2:])).to(self.device)

        whole = Minibatch(
            observations={name: laid(array) for name, array in kept.observations.items()},
            samples=laid(kept.samples),
            log_prob=laid(kept.log_prob),
            advantages=laid(found.astype(np.float32, copy=False)),
            targets=laid(targets.astype(np.float32, copy=False)),
            action_mask=None if kept.action_mask is None else laid(kept.action_mask),
        )
        return whole, torch.from_numpy(np.flatnonzero(active)).to(self.device), facts

    def _values_of(self, experience: Experience) -> Array:
        """Return the critic's values of what was seen, float32 (T, R); zeros where a row is not active."""
        active = experience.active.reshape(-1)
        seen = {name: array.reshape(-1, *array.shape[2:]) for name, array in experience.observations.items()}
        found = np.zeros(len(active), np.float32)
        for rows in np.array_split(np.flatnonzero(active), -(-int(active.sum()) // ROWS_AT_ONCE) or 1):
            found[rows] = self.values({name: array[rows] for name, array in seen.items()}) if len(rows) else 0.0
        return found.reshape(experience.active.shape)

    def _minibatches(self, rows: Tensor) -> Iterator[Tensor]:
        """Yield the rows in a new order, `batch_size` at a time."""
        size = self.config.batch_size
        if self.config.drop_remainder and len(rows) < size:
            size = 1 << (len(rows).bit_length() - 1)  # facts: markov `training_worker.py` lowers it to a power of two
        order = rows[torch.randperm(len(rows), generator=self.generator, device=self.device)]
        for picked in order.split(size):
            if len(picked) == size or not self.config.drop_remainder:
                yield picked

    def _step(self, batch: Minibatch) -> Tensor:
        """Take one gradient step and return its figures, in the order of `PpoLosses`."""
        loss, figures = ppo_loss(self.working, self.distribution, batch, self.config)
        self.working.zero_grad(set_to_none=True)
        loss.backward()
        if self.twin is not None:
            self.twin.hand_over()
        norm = torch.zeros((), device=self.device)
        if self.config.max_grad_norm is not None:
            norm = torch.nn.utils.clip_grad_norm_(self.network.parameters(), self.config.max_grad_norm)
        self.optimiser.step()
        if self.twin is not None:
            self.twin.refresh()
        return torch.cat([figures, norm.reshape(1)])

    def _tensors(self, observations: Mapping[str, Array]) -> dict[str, Tensor]:
        return {
            name: torch.from_numpy(observations[name]).to(self.device)
            for name in self.spec.observations
            if name in observations
        }


def ppo_loss(
    network: ActorCritic, distribution: Distribution, batch: Minibatch, config: PpoConfig
) -> tuple[Tensor, Tensor]:
    """Return the loss of a minibatch, and (5,) policy loss, value loss, entropy, approximate KL, clipped share."""
    numbers, value = network(batch.observations)
    log_prob, entropy = distribution.judge(numbers, network.log_std, batch.action_mask, batch.samples)

    advantage = batch.advantages
    if config.standardise == "minibatch" and len(advantage) > 1:
        advantage = (advantage - advantage.mean()) / (advantage.std() + 1e-8)

    log_ratio = log_prob - batch.log_prob
    ratio = log_ratio.exp()
    held = ratio.clamp(1.0 - config.clip, 1.0 + config.clip)
    policy_loss = -torch.min(ratio * advantage, held * advantage).mean()
    error = functional.huber_loss if config.value_loss == "huber" else functional.mse_loss
    value_loss = error(value, batch.targets)
    mean_entropy = entropy.mean()
    loss = policy_loss + config.value_weight * value_loss - config.entropy_weight * mean_entropy

    with torch.no_grad():
        approx_kl = (ratio - 1.0 - log_ratio).mean()
        clipped = ((ratio - 1.0).abs() > config.clip).float().mean()
        figures = torch.stack([policy_loss, value_loss, mean_entropy, approx_kl, clipped])
    return loss, figures
