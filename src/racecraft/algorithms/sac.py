"""Soft actor-critic, on one page: be rewarded for reward, and for staying undecided. Begin with `SacLearner`.

Sources: Haarnoja et al., "Soft actor-critic: off-policy maximum entropy deep reinforcement learning with a stochastic
actor", 2018 (a); Haarnoja et al., "Soft actor-critic algorithms and applications", 2018 (b), whence the automatic
temperature. As in (b) there is no network for the value of a state alone; two critics judge actions, and of two the
lower one is believed.

One gradient step, in order (`SacLearner._step`):

    temperature   alpha falls while the policy is more undecided than the target entropy, and rises while it is less
    critics       both towards  reward + discount * (lower of the slow critics - alpha * log pi)  of what comes next
    actor         towards actions that the lower critic likes, less alpha * log pi
    slow critics  a little way after the critics

Policies are normal vectors bent into their bounds by a tanh, so every number needs two finite bounds. Results are
bit-identical on the same machine, threads and versions: all chance is in generators that are saved.
"""

from __future__ import annotations

import copy
import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import torch
from torch import Tensor
from torch.nn import functional

from racecraft.algorithms.adam import Adam
from racecraft.algorithms.distributions import HALF_LOG_TAU, SquashedGaussian, squeeze
from racecraft.algorithms.learner import REPLAY, Decision, DivergedError, StateDict
from racecraft.algorithms.network_learner import NetworkLearner
from racecraft.algorithms.networks import Architecture, NetworkConfig, architecture_from
from racecraft.algorithms.policy_spec import PolicySpec
from racecraft.algorithms.replay_sampler import ReplaySampler, Transitions
from racecraft.algorithms.sac_policy import SacPolicy
from racecraft.algorithms.saved_state import copied
from racecraft.algorithms.twin_critics import SoftActorCritic
from racecraft.contract.errors import SettingError
from racecraft.contract.world import Array, ContinuousActions, WorldSpec
from racecraft.settings.table import check_group, setting

AUTO = "auto"
"""A temperature that finds itself."""

FIGURES = {
    "critic_loss": "Half the squared error of both critics together, reward units squared.",
    "actor_loss": "Temperature times log-likelihood, less the lower critic's value: falls as actions get better.",
    "temperature": "Weight of the entropy (alpha), reward units per nat.",
    "entropy": "How undecided the policy is, in nats per action of [-1, 1] units; the automatic temperature steers it.",
    "value": "What the lower critic expects of the policy's own actions, entropy included.",
    "gradient_steps": "Gradient steps taken.",
}
"""What an update tells: means over its gradient steps, unless it says otherwise."""


@dataclass(frozen=True)
class SacConfig:
    """Soft actor-critic."""

    learning_rate: float = setting(3e-4, "Adam's step size, of actor, critics and temperature.", low=1e-8, high=1.0)
    discount: float = setting(0.99, "Weight of the next tick's value (gamma).", low=0.0, high=1.0)
    n_step: int = setting(1, "Steps of reward that are summed before a value is asked for.", unit="steps", low=1)
    batch_size: int = setting(256, "Transitions in one gradient step.", low=1)
    gradient_steps_per_step: float = setting(
        1.0, "Gradient steps for each transition collected; a fraction is carried over.", low=0.0, high=64.0
    )
    temperature: str = setting(
        AUTO, "Weight of the entropy (alpha): a number (AWS's `sac_alpha`), or `auto` to hold `target_entropy`."
    )
    initial_temperature: float = setting(1.0, "Where the automatic temperature begins.", low=1e-6, high=1e3)
    target_entropy: float | None = setting(
        None, "Entropy that the automatic temperature holds; none: one less than nothing for each number.", unit="nats"
    )
    target_rate: float = setting(
        0.005, "How far the slow critics follow at a time (tau); 1 copies the critics.", low=0.0, high=1.0
    )
    target_interval: int = setting(1, "They follow after every so many gradient steps.", unit="steps", low=1)
    noise_correlation: float = setting(
        0.0,
        "How much of its exploration a tick carries over to the next, 0 to under 1; each action's own distribution "
        "stays what it is. High values reach goals that trembling never finds.",
        low=0.0,
        high=0.999,
    )
    adam_epsilon: float = setting(1e-8, "Adam's epsilon.", low=0.0)
    adam_form: str = setting(
        "paper", "Where Adam adds its epsilon; see `ppo.adam_form`.", choices=("paper", "tensorflow")
    )

    def __post_init__(self) -> None:
        check_group(self)
        self.fixed_temperature  # noqa: B018  (refuses a word that is no number)

    @property
    def fixed_temperature(self) -> float | None:
        """The temperature where it is a number; None where it finds itself."""
        if self.temperature == AUTO:
            return None
        try:
            fixed = float(self.temperature)
        except ValueError:
            fixed = math.nan
        if not 0.0 <= fixed <= 1e6:
            raise SettingError(
                "sac.temperature is {temperature!r}; expected `{auto}`, or a number from 0 up.",
                temperature=self.temperature,
                auto=AUTO,
            )
        return fixed


class Losses(NamedTuple):
    """What one gradient step found; scalars."""

    critic: Tensor
    actor: Tensor
    temperature: Tensor
    entropy: Tensor
    value: Tensor


class SacLearner(NetworkLearner[SacConfig]):
    """A policy, its two critics, and how they improve from a replay.

    Args:
        spec: The world's promise; only its observations and actions are read.
        network: The network's settings, or a whole `Architecture`.
        config: The algorithm's settings.
        seed: Of the first weights, of what is drawn while learning and (unless `act` is given another) of exploration.
        device: "cpu" or "cuda".

    Raises:
        SettingError: An action is no vector of numbers with two finite bounds each.

    >>> from racecraft.contract.world import ArraySpec
    >>> seen = {"position": ArraySpec((2,), np.float32)}
    >>> spec = WorldSpec("toy", 4, 1, seen, ContinuousActions((-2.0,), (2.0,)))
    >>> SacLearner(spec, NetworkConfig(), SacConfig(), seed=1).act({"position": np.zeros((5, 2), np.float32)})[0].shape
    (5, 1)
    """

    name = "sac"
    experience = REPLAY
    figures = FIGURES
    network: SoftActorCritic
    policy: SacPolicy

    def __init__(
        self,
        spec: WorldSpec,
        network: NetworkConfig | Architecture,
        config: SacConfig,
        seed: int,
        device: str = "cpu",
    ) -> None:
        actions = bounded(spec.actions)
        super().__init__(spec, network, config, seed, device)
        chance = torch.Generator().manual_seed(seed)
        self.network = SoftActorCritic(spec.observations, actions, self.architecture, chance).to(self.device)
        self.slow = copy.deepcopy(self.network.critics).requires_grad_(False)
        """The critics that the targets ask; they follow the critics."""
        fixed = config.fixed_temperature
        began = math.log(config.initial_temperature if fixed is None else max(fixed, 1e-30))
        self.log_temperature = torch.nn.Parameter(torch.tensor(began, device=self.device))
        size = math.prod(actions.shape)
        self.target_entropy = -float(size) if config.target_entropy is None else config.target_entropy

        self._moved = {"critics": self.network.critic_parameters(), "actor": self.network.actor_parameters()}
        finds_itself = [self.log_temperature] if fixed is None else []
        self.optimisers = {
            whose: Adam(moved, config.learning_rate, config.adam_epsilon, config.adam_form)
            for whose, moved in (
                ("critics", [*self._moved["critics"], *finds_itself]),
                ("actor", self._moved["actor"]),
            )
        }
        """The temperature steps with the critics; it needs nothing of theirs."""
        self.policy = SacPolicy(self.network, SquashedGaussian(actions))
        self.centre, self.scale = (part.to(self.device) for part in (self.policy.kind.centre, self.policy.kind.scale))
        self.noise = torch.zeros(0, size, device=self.device)
        """(R, A): the exploration that each row carries from tick to tick."""
        self.steps, self.owed = 0, 0.0
        """Gradient steps taken, and the fraction of one that is still owed."""
        self.discount, self.n_step = config.discount, config.n_step

    @staticmethod
    def load_policy(spec: PolicySpec, weights: Mapping[str, Tensor]) -> SacPolicy:
        """Return the greedy policy that a spec and its weights describe."""
        actions = bounded(spec.actions)
        chance = torch.Generator().manual_seed(0)
        network = SoftActorCritic(spec.observations, actions, architecture_from(spec.network), chance)
        network.load_state_dict(dict(weights))
        return SacPolicy(network, SquashedGaussian(actions))

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
        mean, log_std = self.network.policy(self.policy.tensors(observations))
        noise = torch.randn(mean.shape, generator=generator or self.generator, device=self.device)
        if self.config.noise_correlation > 0.0:
            noise = self._carried(noise, rows)
        return Decision(self.policy.kind.to_actions(mean + log_std.exp() * noise).cpu().numpy(), {})

    def _carried(self, fresh: Tensor, rows: Array | None) -> Tensor:
        """Return noise that remembers the last tick's, each still standard normal, and remember it."""
        share = self.config.noise_correlation
        if rows is None and len(self.noise) != len(fresh):
            self.noise = fresh.clone()
            return fresh
        picked = slice(None) if rows is None else torch.from_numpy(rows).to(self.device)
        self.noise[picked] = share * self.noise[picked] + math.sqrt(1.0 - share**2) * fresh
        return self.noise[picked]

    def reset_state(self, rows: Array) -> None:
        """Begin the rows' exploration (bool, all of them) anew; nothing else is remembered from tick to tick."""
        if self.config.noise_correlation > 0.0:
            drawn = torch.randn((len(rows), self.noise.shape[1]), generator=self.generator, device=self.device)
            restarted = torch.from_numpy(rows).to(self.device).unsqueeze(1)
            self.noise = drawn if len(self.noise) != len(rows) else torch.where(restarted, drawn, self.noise)

    def update(self, experience: ReplaySampler) -> dict[str, float]:
        """Learn from a replay, `gradient_steps_per_step` times for each new transition; return `FIGURES`.

        Raises:
            DivergedError: A loss is no longer a number.
        """
        self.owed += experience.new_transitions * self.config.gradient_steps_per_step
        count, self.owed = int(self.owed), self.owed % 1.0
        metrics = [self._learn(experience) for _ in range(count)]
        means = torch.stack(metrics).mean(dim=0).tolist() if metrics else [0.0] * len(Losses._fields)
        if not np.isfinite(means).all():
            raise DivergedError(
                "After {steps} gradient steps the losses are {means}; expected numbers. Lower sac.learning_rate "
                "or the size of the rewards, and go on from the last checkpoint.",
                steps=self.steps,
                means=means,
            )
        critic, actor, _, entropy, value = means
        return dict(zip(FIGURES, [critic, actor, self.temperature, entropy, value, count], strict=True))

    @property
    def temperature(self) -> float:
        """Weight of the entropy as it stands."""
        fixed = self.config.fixed_temperature
        return math.exp(self.log_temperature.item()) if fixed is None else fixed

    def state_dict(self) -> StateDict:
        """Return everything an exact continuation needs, as named tensors in groups (copies)."""
        return {
            "network": copied(self.network),
            "slow": copied(self.slow),
            "temperature": {"logarithm": self.log_temperature.detach().clone()},
            "optimiser": {
                f"{whose}/{name}": part
                for whose, optimiser in self.optimisers.items()
                for name, part in optimiser.state_dict().items()
            },
            "generator": {"state": self.generator.get_state()},
            "exploration": {"noise": self.noise.clone()},
            "counts": {"steps": torch.tensor(self.steps), "owed": torch.tensor(self.owed, dtype=torch.float64)},
        }

    @torch.no_grad()
    def load_state_dict(self, state: Mapping[str, Mapping[str, Tensor]]) -> None:
        """Go on from what `state_dict` gave; groups other than "network" may be absent (weights alone)."""
        self.network.load_state_dict(dict(state["network"]))
        self.slow.load_state_dict(dict(state.get("slow") or self.network.critics.state_dict()))
        if "temperature" in state:
            self.log_temperature.copy_(state["temperature"]["logarithm"])
        for whose, optimiser in self.optimisers.items() if state.get("optimiser") else ():
            mine = {name: part for name, part in state["optimiser"].items() if name.startswith(f"{whose}/")}
            optimiser.load_state_dict({name.partition("/")[2]: part for name, part in mine.items()})
        if "generator" in state:
            self.generator.set_state(state["generator"]["state"].cpu())
        if "exploration" in state:
            self.noise = state["exploration"]["noise"].to(self.device)
        if "counts" in state:
            self.steps, self.owed = int(state["counts"]["steps"]), float(state["counts"]["owed"])

    def _learn(self, experience: ReplaySampler) -> Tensor:
        """Draw transitions, take one gradient step on them, and return its losses as a row."""
        batch = experience.sample(self.config.batch_size, self.generator)
        size = (2, len(batch.reward), len(self.centre))
        losses, errors = self.step(batch, torch.randn(size, generator=self.generator, device=self.device))
        experience.set_priorities(batch.index, errors.cpu().numpy())
        return torch.stack(losses)

    def step(self, batch: Transitions, noise: Tensor) -> tuple[Losses, Tensor]:
        """Take one gradient step.

        Args:
            batch: B transitions.
            noise: Standard normal, (2, B, A): what actions are drawn with now, and next.

        Returns:
            Its losses, and how wrong the critics were about each transition, (B,).
        """
        network, fixed = self.network, self.config.fixed_temperature
        alpha = self.log_temperature.detach().exp() if fixed is None else fixed
        for_actor, for_critics = network.features(self._tensors(batch.observations))
        actions, log_prob = sample_actions(*network.decide(for_actor), noise[0])

        surplus = log_prob.detach().mean() + self.target_entropy
        temperature_loss = -self.log_temperature.detach() * surplus
        self.log_temperature.grad = -surplus

        with torch.no_grad():
            next_for_actor, next_for_critics = network.features(self._tensors(batch.next_observations))
            next_actions, next_log_prob = sample_actions(*network.decide(next_for_actor), noise[1])
            following = lower(self.slow(next_for_critics, next_actions)) - alpha * next_log_prob
            target = torch.addcmul(self._tensor(batch.reward), self._tensor(batch.discount), following)
            taken = (self._tensor(batch.actions) - self.centre) / self.scale
            weights = self._tensor(batch.weights).sqrt()
        values = network.critics(for_critics, taken)
        critic_loss = functional.mse_loss(values * weights, (target * weights).expand(2, -1))  # half of two means
        self._move("critics", critic_loss)

        value = lower(network.critics(for_critics.detach(), actions, frozen=True))
        actor_loss = (alpha * log_prob - value).mean()
        self._move("actor", actor_loss)

        self.steps += 1
        if self.steps % self.config.target_interval == 0:
            self._follow()
        found = critic_loss, actor_loss, temperature_loss, -log_prob.mean(), value.mean()
        return Losses(*(one.detach() for one in found)), (values.detach() - target).abs().mean(dim=0)

    def _move(self, whose: str, loss: Tensor) -> None:
        """Take Adam's step down a loss."""
        for one in self._moved[whose]:
            one.grad = None
        loss.backward()
        self.optimisers[whose].step()

    @torch.no_grad()
    def _follow(self) -> None:
        """Let the slow critics go a little way after the critics (Polyak averaging)."""
        for slow, fast in zip(self.slow.parameters(), self.network.critics.parameters(), strict=True):
            slow.lerp_(fast, self.config.target_rate)


def sample_actions(mean: Tensor, log_std: Tensor, noise: Tensor) -> tuple[Tensor, Tensor]:
    """Return actions (R, A) in (-1, 1) and their log-density (R,), both differentiable by mean and log std."""
    raw = torch.addcmul(mean, log_std.exp(), noise)
    normal = (-0.5 * noise.square() - HALF_LOG_TAU - log_std).sum(dim=1)
    return torch.tanh(raw), normal - squeeze(raw)


def lower(values: Tensor) -> Tensor:
    """Return the lower of two critics' values (2, R), (R,)."""
    return torch.minimum(values[0], values[1])


def bounded(actions: object) -> ContinuousActions:
    """Return actions that are numbers with two finite bounds each.

    Raises:
        SettingError: They are not.
    """
    if not isinstance(actions, ContinuousActions):
        raise SettingError("sac decides numbers; found actions {actions}. Use dqn or ppo.", actions=actions)
    if not np.isfinite([actions.low, actions.high]).all():
        raise SettingError(
            "sac bends its actions into their bounds; found low {low}, high {high}, expected finite "
            "ones. Use ppo, which needs none, or rescale the actions.",
            low=actions.low,
            high=actions.high,
        )
    return actions
