"""Beside what it learns from reward, a learner makes what was shown likelier. Begin with `ImitationWrapper`.

ML-Agents calls it `behavioral_cloning`. After each update the policy takes gradient steps of its own towards recorded
actions, with an Adam of its own; their size may fall to nothing, so that the demonstrator is outgrown. With
`behaviour_cloning.py` it shares the loss; there nothing is learned from the world.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import torch
from torch import Tensor

from racecraft.algorithms.adam import Adam
from racecraft.algorithms.behaviour_cloning import cloning_loss, to_raw
from racecraft.algorithms.demonstrations import demonstration_tensors
from racecraft.algorithms.learner import DivergedError, Learner, StateDict
from racecraft.algorithms.learner_wrapper import LearnerWrapper
from racecraft.algorithms.ppo import PpoLearner
from racecraft.algorithms.recurrent_network import RecurrentActorCritic
from racecraft.algorithms.rollout_batch import RolloutBatch
from racecraft.contract.errors import SettingError
from racecraft.contract.world import GroupedActions
from racecraft.formats.demonstrations import Demonstrations
from racecraft.settings.table import check_group, setting

STATE = "imitation"
"""Of its state, and of its group of settings."""


@dataclass(frozen=True)
class ImitationConfig:
    """What was shown is made likelier, beside what is learned from reward (ML-Agents' behavioral_cloning)."""

    strength: float = setting(0.0, "Size of its steps, in parts of `learning_rate`; 0: nothing is imitated.", low=0.0)
    demonstrations: str | None = setting(
        None, "Recorded episodes: a file of `racecraft record RUN`, or ML-Agents' `.demo`, one or a folder of them."
    )
    steps: int = setting(0, "Its steps fall in a straight line to nothing until so many are collected; 0: never.",
                         unit="steps", low=0)  # fmt: skip
    learning_rate: float = setting(3e-4, "Adam's step size at strength 1.", low=1e-8, high=1.0)
    batch_size: int = setting(128, "Recorded ticks in one minibatch.", low=1)
    epochs: int = setting(3, "Passes over what was shown, after each update.", low=1, high=100)
    samples_per_update: int = setting(0, "Recorded ticks that a pass takes at most; 0: all.", unit="ticks", low=0)

    def __post_init__(self) -> None:
        check_group(self)


class ImitationWrapper(LearnerWrapper):
    """A learner that also does what it was shown. Towards everybody it is that learner.

    Args:
        inner: Learns from reward; ppo without a memory.
        config: The settings.
        shown: What was recorded.
        seed: Of the order of minibatches.

    Raises:
        SettingError: The learner has no actor network of one look, or another world was recorded.
    """

    def __init__(self, inner: Learner, config: ImitationConfig, shown: Demonstrations, seed: int) -> None:
        if not isinstance(inner, PpoLearner) or isinstance(inner.network, RecurrentActorCritic):
            raise SettingError(
                "imitation.strength is {strength:g}; what was shown is imitated beside ppo without a memory, "
                "in the thread that learns. Use ppo with --set network.memory=none --set ppo.asynchronous=false, or "
                "leave it at 0.",
                strength=config.strength,
            )
        assert not isinstance(inner.spec.actions, GroupedActions), "agents of each kind have a learner of their own"
        super().__init__(inner)
        self.learner, self.config = inner, config
        demonstrations = demonstration_tensors(
            shown, inner.spec, inner.network.policy_body.names, inner.device, "imitation.demonstrations"
        )
        self.shown = replace(demonstrations, actions=to_raw(demonstrations.actions, inner.spec.actions))
        self.optimiser = Adam(inner.network.parameters(), config.strength * config.learning_rate, 1e-8)
        self.generator = torch.Generator().manual_seed(seed)
        self.collected = 0
        """Steps collected so far; the size of its own steps falls with them."""
        self.figures = {
            **self.figures,
            "imitation_loss": "Mean -log probability of the recorded actions, in nats (of numbers: -log density); 0 "
            "once nothing is imitated any more.",
            "imitation_agreement": "Share of recorded choices that are the policy's likeliest; of numbers: of those "
            "within a tenth of their range.",
        }

    @property
    def share(self) -> float:
        """What is left of the size of its steps, 0 to 1."""
        return max(0.0, 1.0 - self.collected / self.config.steps) if self.config.steps else 1.0

    def update(self, experience: RolloutBatch) -> dict[str, float]:
        """Have the learner learn, then imitate; return the figures of both.

        Raises:
            DivergedError: A loss is no longer a number.
        """
        metrics: Mapping[str, Any] = self.inner.update(experience)
        loss, agreement = self._imitate()
        self.collected += experience.num_active
        return {**metrics, "imitation_loss": loss, "imitation_agreement": agreement}

    def state_dict(self) -> StateDict:
        """Return the inner learner's state and, in a group of its own, what imitation remembers."""
        own = {f"optimiser/{name}": part for name, part in self.optimiser.state_dict().items()}
        own |= {"generator": self.generator.get_state(), "collected": torch.tensor(self.collected)}
        return {**self.inner.state_dict(), STATE: own}

    def load_state_dict(self, state: Mapping[str, Mapping[str, Tensor]]) -> None:
        """Go on from what `state_dict` gave; groups other than "network" may be absent."""
        self.inner.load_state_dict(state)
        if own := state.get(STATE):
            kept = {name.partition("/")[2]: part for name, part in own.items() if name.startswith("optimiser/")}
            self.optimiser.load_state_dict(kept)
            self.generator.set_state(own["generator"].cpu())
            self.collected = int(own["collected"])

    def _imitate(self) -> tuple[float, float]:
        """Go over what was shown; return mean loss and agreement, 0 and 0 where nothing is imitated any more."""
        config, share = self.config, self.share
        if share == 0.0:
            return 0.0, 0.0
        self.optimiser.learning_rate = share * config.strength * config.learning_rate
        losses = []
        for _ in range(config.epochs):
            order = torch.randperm(len(self.shown), generator=self.generator)
            order = order[: config.samples_per_update or None].to(self.device)
            losses += [self._step(rows) for rows in order.split(config.batch_size)]
        loss, agreement = torch.stack(losses).mean(dim=0).tolist()
        if not np.isfinite(loss):
            raise DivergedError(
                "After {count} minibatches of what was shown the loss is {loss}; expected a number. Lower "
                "imitation.strength, and go on from the last checkpoint.",
                count=len(losses),
                loss=loss,
            )
        if self.learner.half is not None:
            self.learner.half.refresh()
        return loss, agreement

    def _step(self, rows: Tensor) -> Tensor:
        network = self.learner.network
        loss, agreement = cloning_loss(network, self.learner.distribution, self.shown.take(rows))
        network.zero_grad(set_to_none=True)
        loss.backward()
        self.optimiser.step()
        return torch.stack([loss.detach(), agreement])
