"""Deep Q-learning on one page: learn what each choice is worth, and take the best. Begin with `DqnLearner`.

Source: Mnih et al., "Human-level control through deep reinforcement learning", 2015; the defaults are the paper's
(extended data table 1). Switches, each off in the paper:

* `double`: the network chooses what the target network values (van Hasselt et al., 2016);
* `dueling`: a moment's worth and what each choice adds are told apart (Wang et al., 2016);
* `n_step`: so many rewards are summed before a value is asked for (Sutton, 1988);
* `replay.prioritised`: what was foreseen badly is drawn oftener (Schaul et al., 2016).

The paper's reward clipping belongs to its world and is not done here; its stacked frames are `network.stack_size`.
Results are bit-identical on the same machine, threads and versions: all chance is in generators that are saved.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import torch
from torch import Tensor
from torch.nn import functional
from torch.nn.utils import clip_grad_norm_

from racecraft.algorithms.adam import Adam
from racecraft.algorithms.learner import REPLAY, Decision, DivergedError, StateDict
from racecraft.algorithms.network_learner import NetworkLearner
from racecraft.algorithms.networks import Architecture, NetworkConfig
from racecraft.algorithms.policy_spec import PolicySpec
from racecraft.algorithms.q_network import QNetwork, QPolicy, allowed_only, load_q_policy
from racecraft.algorithms.replay_sampler import ReplaySampler, Transitions
from racecraft.algorithms.rmsprop import RmsProp
from racecraft.algorithms.saved_state import copied
from racecraft.contract.world import Array, DiscreteActions, WorldSpec
from racecraft.settings.table import check_group, setting

ROWS_AT_ONCE = 1024
"""How many transitions are drawn, and asked of the target network, at once."""

FIGURES = {
    "loss": "Huber loss of what was expected against its target, weighed: reward units, squared below 1.",
    "q": "Mean worth of the choices that were taken, in reward units.",
    "td_error": "Mean distance between what was expected and its target, in reward units.",
    "grad_norm": "Euclidean norm of the gradient before it was cut; 0 where it is never cut (it is then not computed).",
    "epsilon": "Share of random choices while collecting, 0 to 1, by now.",
    "transitions": "Transitions collected since the update before.",
    "remembered": "Transitions in the replay.",
    "gradient_steps": "Gradient steps taken.",
}
"""What an update tells: means over its gradient steps, unless it says otherwise."""


@dataclass(frozen=True)
class DqnConfig:
    """Deep Q-learning; the defaults are those of the paper."""

    learning_rate: float = setting(2.5e-4, "The optimiser's step size.", low=1e-8, high=1.0)
    discount: float = setting(0.99, "Weight of the next tick's value (gamma).", low=0.0, high=1.0)
    batch_size: int = setting(32, "Transitions in one gradient step.", low=1)
    train_every: int = setting(4, "So many transitions collected are worth `gradient_steps`.", unit="steps", low=1)
    gradient_steps: int = setting(1, "Gradient steps for every `train_every` transitions.", low=1)
    target_every: int = setting(
        10_000, "The target network follows after so many gradient steps.", unit="gradient steps", low=1
    )
    target_share: float = setting(
        1.0, "How far it follows then (tau): 1 wholly, a little with `target_every=1`.", low=1e-6, high=1.0
    )
    epsilon_first: float = setting(1.0, "Share of random choices at the beginning.", low=0.0, high=1.0)
    epsilon_last: float = setting(0.1, "Share of random choices at the end.", low=0.0, high=1.0)
    epsilon_steps: int = setting(
        1_000_000, "Steps until that share is reached, in a straight line.", unit="steps", low=1
    )
    optimiser: str = setting(
        "rmsprop", "RMSProp as in the paper (centred, 0.95, 0.01), or Adam.", choices=("rmsprop", "adam")
    )
    adam_epsilon: float = setting(1e-8, "Adam's epsilon.", low=0.0)
    max_grad_norm: float | None = setting(None, "Gradients are scaled down to this norm.", low=0.0)
    double: bool = setting(False, "The network chooses what the target network values.")
    dueling: bool = setting(False, "A moment's worth and what each choice adds are told apart.")
    n_step: int = setting(1, "Rewards summed before a value is asked for.", unit="ticks", low=1, high=100)

    def __post_init__(self) -> None:
        check_group(self)


@dataclass
class Minibatch:
    """B transitions, as tensors on the learner's device."""

    observations: dict[str, Tensor]
    actions: Tensor
    reward: Tensor
    discount: Tensor
    next_observations: dict[str, Tensor]
    next_mask: Tensor | None
    weights: Tensor
    next_worth: Tensor
    """(B, A): what the target network expects of each choice afterwards; forbidden ones are worth nothing good."""

    def split(self, size: int) -> Iterator[Minibatch]:
        """Yield the transitions in their order, `size` at a time."""
        for first in range(0, len(self.actions), size):
            rows = slice(first, first + size)
            yield Minibatch(
                {name: array[rows] for name, array in self.observations.items()},
                self.actions[rows],
                self.reward[rows],
                self.discount[rows],
                {name: array[rows] for name, array in self.next_observations.items()},
                None if self.next_mask is None else self.next_mask[rows],
                self.weights[rows],
                self.next_worth[rows],
            )


class DqnLearner(NetworkLearner[DqnConfig]):
    """What each choice is worth, and how that is learned.

    Args:
        spec: The world's promise; only its observations and actions are read.
        network: The network's settings, or a whole `Architecture`.
        config: The algorithm's settings.
        seed: Of the first weights, of what is drawn from the replay and (unless `act` is given another) of exploration.
        device: "cpu" or "cuda".

    >>> from racecraft.contract.world import ArraySpec
    >>> seen = {"position": ArraySpec((2,), np.float32)}
    >>> learner = DqnLearner(WorldSpec("toy", 4, 1, seen, DiscreteActions(3)), NetworkConfig(), DqnConfig(), seed=1)
    >>> learner.act({"position": np.zeros((5, 2), np.float32)}).actions.shape
    (5,)
    """

    experience = REPLAY
    figures = FIGURES
    name = "dqn"
    network: QNetwork
    policy: QPolicy

    def __init__(
        self,
        spec: WorldSpec,
        network: NetworkConfig | Architecture,
        config: DqnConfig,
        seed: int,
        device: str = "cpu",
    ) -> None:
        assert isinstance(spec.actions, DiscreteActions), "the registry refuses other actions"
        super().__init__(spec, network, config, seed, device)
        self.discount, self.n_step = config.discount, config.n_step
        chance = torch.Generator().manual_seed(seed)
        self.network = self._network(spec.actions, chance)
        self.target = self._network(spec.actions, chance)
        self.target.load_state_dict(self.network.state_dict())
        self._weights = list(self.network.parameters())
        self.optimiser: Adam | RmsProp
        if config.optimiser == "adam":
            self.optimiser = Adam(self._weights, config.learning_rate, config.adam_epsilon)
        else:
            self.optimiser = RmsProp(self._weights, config.learning_rate)
        self.policy = QPolicy(self.network)
        self.explored = 0
        """Decisions drawn so far; the random share falls with them."""
        self.owed = 0
        """Transitions collected that were not yet worth a gradient step."""
        self.steps_taken = 0
        """Gradient steps taken so far."""

    @classmethod
    def load_policy(cls, spec: PolicySpec, weights: Mapping[str, Tensor]) -> QPolicy:
        """Return the greedy policy of a checkpoint."""
        return load_q_policy(spec, weights)

    @property
    def policy_values(self) -> Mapping[str, Any]:
        """Whether a moment's worth and what each choice adds are told apart."""
        return {"dueling": self.config.dueling}

    @property
    def epsilon(self) -> float:
        """Share of random choices now: from the first in a straight line to the last one."""
        config = self.config
        done = min(self.explored / config.epsilon_steps, 1.0)
        return config.epsilon_first + (config.epsilon_last - config.epsilon_first) * done

    @torch.inference_mode()
    def act(
        self,
        observations: Mapping[str, Array],
        action_mask: Array | None = None,
        *,
        generator: torch.Generator | None = None,
        rows: Array | None = None,
    ) -> Decision:
        """Decide for R rows: the best choice, or with probability `epsilon` any allowed one; see `Actor.act`."""
        worth = self.network(self._tensors(observations))
        drawn = self._explore(worth, action_mask, self.epsilon, generator or self.generator)
        self.explored += len(drawn)
        return Decision(drawn.cpu().numpy(), {})

    def update(self, experience: ReplaySampler) -> dict[str, float]:
        """Take the gradient steps that the new transitions are worth; return `FIGURES`.

        Raises:
            DivergedError: A loss is no longer a number.
        """
        self.owed += experience.new_transitions
        return self.metrics(self._learn(experience, self._due_steps()), experience)

    def metrics(self, steps: list[Tensor], experience: ReplaySampler) -> dict[str, float]:
        """Return `FIGURES` of some gradient steps.

        Raises:
            DivergedError: A loss is no longer a number.
        """
        means = torch.stack(steps).mean(dim=0).tolist() if steps else [0.0] * 4
        if not np.isfinite(means).all():
            raise DivergedError(
                "After {steps_taken} gradient steps the losses are {means}; expected numbers. Lower "
                "{name}.learning_rate or the size of the rewards, and go on from the last checkpoint.",
                steps_taken=self.steps_taken,
                means=means,
                name=self.name,
            )
        facts = (self.epsilon, experience.new_transitions, len(experience), len(steps))
        return dict(zip(FIGURES, [*means, *facts], strict=True))

    def state_dict(self) -> StateDict:
        """Return everything an exact continuation needs, as named tensors in groups (copies)."""
        counts = {"explored": self.explored, "owed": self.owed, "steps_taken": self.steps_taken}
        return {
            **super().state_dict(),
            "target": copied(self.target),
            "counts": {name: torch.tensor(count) for name, count in counts.items()},
        }

    def load_state_dict(self, state: Mapping[str, Mapping[str, Tensor]]) -> None:
        """Go on from what `state_dict` gave; groups other than "network" may be absent (weights alone)."""
        super().load_state_dict(state)
        self.target.load_state_dict(dict(state.get("target", state["network"])))
        for name, count in state.get("counts", {}).items():
            setattr(self, name, int(count))

    def _network(self, actions: DiscreteActions, chance: torch.Generator) -> QNetwork:
        network = QNetwork(self.spec.observations, actions, self.architecture, self.config.dueling, chance)
        return network.to(self.device)

    def _explore(
        self, worth: Tensor, action_mask: Array | None, epsilon: float | Tensor, chance: torch.Generator
    ) -> Tensor:
        """Return the best choice of each row, but with probability `epsilon` any allowed one, int64 (R,)."""
        mask = self._mask(action_mask)
        if mask is None:
            anything = torch.randint(worth.shape[1], (len(worth),), generator=chance, device=self.device)
        else:
            anything = torch.multinomial(mask.float(), 1, generator=chance).squeeze(1)
        wander = torch.rand(len(worth), generator=chance, device=self.device) < epsilon
        return torch.where(wander, anything, allowed_only(worth, mask).argmax(dim=1))

    def _due_steps(self) -> int:
        """Return how many gradient steps are due; what is not yet worth one stays owed."""
        rounds, self.owed = divmod(self.owed, self.config.train_every)
        return rounds * self.config.gradient_steps

    def _learn(self, replay: ReplaySampler, steps: int) -> list[Tensor]:
        """Take gradient steps; return the figures of each.

        Nothing that is drawn hangs on the step before, unless by priority, and the target network stands still for a
        while: so much is drawn and asked of it at once.
        """
        size, losses = self.config.batch_size, list[Tensor]()
        while len(losses) < steps:
            until_it_follows = self.config.target_every - self.steps_taken % self.config.target_every
            at_once = 1 if replay.prioritised else max(1, ROWS_AT_ONCE // size)
            count = min(steps - len(losses), until_it_follows, at_once)
            drawn = replay.sample(count * size, self.generator)
            for batch in self._minibatch(drawn).split(size):
                figures, errors = self._step(batch)
                losses.append(figures)
                if replay.prioritised:
                    replay.set_priorities(drawn.index, errors.cpu().numpy())
        return losses

    def _step(self, batch: Minibatch) -> tuple[Tensor, Tensor]:
        """Take one gradient step; return its figures, the first four of `FIGURES`, and the errors (B,)."""
        loss, figures, errors = dqn_loss(self.network, batch, self.config.double)
        for one in self._weights:
            one.grad = None
        loss.backward()
        norm = torch.zeros((), device=self.device)
        if self.config.max_grad_norm is not None:
            norm = clip_grad_norm_(self._weights, self.config.max_grad_norm)
        self.optimiser.step()
        self.steps_taken += 1
        if self.steps_taken % self.config.target_every == 0:
            self._follow()
        return torch.cat([figures, norm.reshape(1)]), errors

    @torch.no_grad()
    def _follow(self) -> None:
        """Let the target network follow."""
        targets, weights = ([one.data for one in each.parameters()] for each in (self.target, self.network))
        torch._foreach_lerp_(targets, weights, self.config.target_share)

    @torch.no_grad()
    def _minibatch(self, drawn: Transitions) -> Minibatch:
        following = self._tensors(drawn.next_observations)
        mask = self._mask(drawn.next_action_mask)
        return Minibatch(
            observations=self._tensors(drawn.observations),
            actions=self._tensor(drawn.actions),
            reward=self._tensor(drawn.reward),
            discount=self._tensor(drawn.discount),
            next_observations=following,
            next_mask=mask,
            weights=self._tensor(drawn.weights),
            next_worth=allowed_only(self.target(following), mask),
        )


def dqn_loss(network: QNetwork, batch: Minibatch, double: bool) -> tuple[Tensor, Tensor, Tensor]:
    """Return the loss of a minibatch; (3,) loss, mean worth, mean distance; and the errors (B,)."""
    with torch.no_grad():
        if double:
            best = allowed_only(network(batch.next_observations), batch.next_mask).argmax(dim=1, keepdim=True)
            following = batch.next_worth.gather(1, best).squeeze(1)
        else:
            following = batch.next_worth.amax(dim=1)
        target = batch.reward + batch.discount * following
    expected = network(batch.observations).gather(1, batch.actions.unsqueeze(1)).squeeze(1)
    loss = (batch.weights * functional.smooth_l1_loss(expected, target, reduction="none")).mean()
    errors = (expected - target).detach()
    return loss, torch.stack([loss.detach(), expected.detach().mean(), errors.abs().mean()]), errors
