"""Curiosity: what one's own actions do, and cannot yet be foretold, is new. Begin with `CuriosityModel`.

What is seen becomes features; from two sets of features in a row an inverse model tells which action lay between, and
from features and action a forward model foretells the next features. The bonus is half the forward model's squared
error. The features are taught by the inverse model alone, so that they hold what actions can change and leave out what
they cannot, such as noise.

Source: Pathak et al., "Curiosity-driven exploration by self-supervised prediction", 2017 (ICM).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
import torch
from torch import Tensor, nn
from torch.nn import functional

from racecraft.algorithms.networks import Architecture, Encoder, dense
from racecraft.algorithms.rnd import load_model_state, model_state
from racecraft.contract.world import (
    Array,
    ArraySpec,
    ContinuousActions,
    DiscreteActions,
    HybridActions,
    MultiDiscreteActions,
    SingleActions,
)
from racecraft.settings.table import check_group, setting

FORWARD_SHARE = 0.2
"""Weight of the forward model's loss; the inverse model has the rest (beta in Pathak et al.)."""


@dataclass(frozen=True)
class CuriosityConfig:
    """Reward for what is new: curiosity about what one's own actions do (ICM)."""

    strength: float = setting(0.0, "Weight of the bonus, which is measured in its own deviations; 0: none.", low=0.0)
    learning_rate: float = setting(3e-4, "Adam's step size.", low=1e-8, high=1.0)
    units: int = setting(128, "Units of the features and of each dense layer.", low=1)
    batch_size: int = setting(64, "Transitions in one minibatch; each is learned from once.", low=1)

    def __post_init__(self) -> None:
        check_group(self)


class CuriosityModel:
    """How new what an action did is, by the error of a forward model.

    Args:
        observations: What is seen; privileged names are left out.
        actions: What is done.
        architecture: Its convolutions serve images.
        config: The settings.
        seed: Of the weights and the order of minibatches.
        device: "cpu" or "cuda".
    """

    name = "curiosity"
    is_novelty = True
    figures: Mapping[str, str] = {
        "curiosity_forward_loss": "Half the squared error of the foretold features, summed, mean over transitions.",
        "curiosity_inverse_loss": "Error in telling the action: cross-entropy in nats, or mean squared error.",
    }

    def __init__(
        self,
        observations: Mapping[str, ArraySpec],
        actions: SingleActions,
        architecture: Architecture,
        config: CuriosityConfig,
        seed: int,
        device: str,
    ) -> None:
        self.config, self.strength, self.device = config, config.strength, torch.device(device)
        self.actions = ActionCode(actions)
        self.names = [name for name, part in observations.items() if not part.privileged]
        row = replace(architecture, trunk_units=(config.units,))
        chance, units, width = torch.Generator().manual_seed(seed), config.units, self.actions.width
        self.networks = nn.ModuleDict({
            "features": Encoder({name: observations[name] for name in self.names}, row, chance),
            "between": nn.Sequential(
                dense(2 * units, units, row, chance, 1.0), nn.ReLU(), dense(units, width, row, chance, 1.0)
            ),
            "ahead": nn.Sequential(
                dense(units + width, units, row, chance, 1.0), nn.ReLU(), dense(units, units, row, chance, 1.0)
            ),
        }).to(self.device)  # fmt: skip
        self.optimiser = torch.optim.Adam(self.networks.parameters(), config.learning_rate)
        self.generator = torch.Generator().manual_seed(seed + 1)

    def bonus(self, before: Mapping[str, Array], actions: Array, after: Mapping[str, Array]) -> Array:
        """Return half the squared error of what was foretold, float32 (B,)."""
        bonuses = []
        with torch.inference_mode():
            for rows in np.array_split(np.arange(len(actions)), -(-len(actions) // self.config.batch_size)):
                bonuses.append(self._errors(before, actions, after, rows)[0].cpu().numpy())
        return np.concatenate(bonuses)

    def learn(self, before: Mapping[str, Array], actions: Array, after: Mapping[str, Array]) -> dict[str, float]:
        """Learn from B transitions, each once."""
        losses = []
        for rows in torch.randperm(len(actions), generator=self.generator).split(self.config.batch_size):
            forward, inverse = (part.mean() for part in self._errors(before, actions, after, rows.numpy()))
            self.optimiser.zero_grad()
            (FORWARD_SHARE * forward + (1.0 - FORWARD_SHARE) * inverse).backward()
            self.optimiser.step()
            losses.append(torch.stack([forward, inverse]).detach())
        return dict(zip(self.figures, torch.stack(losses).mean(dim=0).tolist(), strict=True))

    def state_dict(self) -> dict[str, Tensor]:
        """Return networks, optimiser and chance."""
        return model_state({"networks": self.networks}, self.optimiser, self.generator)

    def load_state_dict(self, state: Mapping[str, Tensor]) -> None:
        """Go on from what `state_dict` gave."""
        load_model_state(state, {"networks": self.networks}, self.optimiser, self.generator)

    def _errors(
        self, before: Mapping[str, Array], actions: Array, after: Mapping[str, Array], rows: Array
    ) -> tuple[Tensor, Tensor]:
        """Return the errors of forward and inverse model, (B,) each."""
        first, then = self._features(before, rows), self._features(after, rows)
        done = torch.from_numpy(actions[rows]).to(self.device)
        prediction = self.networks["between"](torch.cat([first, then], dim=1))
        foretold = self.networks["ahead"](torch.cat([first.detach(), self.actions.encoded(done)], dim=1))
        return 0.5 * (foretold - then.detach()).square().sum(dim=1), self.actions.error(prediction, done)

    def _features(self, named: Mapping[str, Array], rows: Array) -> Tensor:
        features: Tensor = self.networks["features"](
            {name: torch.from_numpy(named[name][rows]).to(self.device) for name in self.names}
        )
        return features


class ActionCode:
    """Actions as numbers for a network, and how wrong a guess of them is.

    Args:
        actions: One choice, several, numbers, or both; numbers without bounds are taken as they are.
    """

    def __init__(self, actions: SingleActions) -> None:
        parts = (actions.continuous, actions.discrete) if isinstance(actions, HybridActions) else (actions,)
        self.numbers = next((part for part in parts if isinstance(part, ContinuousActions)), None)
        self.counts: tuple[int, ...] = ()
        for part in parts:
            if isinstance(part, DiscreteActions | MultiDiscreteActions):
                self.counts = part.counts if isinstance(part, MultiDiscreteActions) else (part.count,)
        self.plain = len(self.numbers.low) if self.numbers is not None else 0
        self.width = self.plain + sum(self.counts)

    def encoded(self, actions: Tensor) -> Tensor:
        """Return actions (B, ...) as float32 (B, width): numbers as shares of their bounds, choices one-hot."""
        flat = actions.reshape(len(actions), -1)
        parts = [self._scaled(flat[:, : self.plain])] if self.plain else []
        for place, count in enumerate(self.counts):
            parts.append(functional.one_hot(flat[:, self.plain + place].long(), count).float())
        return torch.cat(parts, dim=1)

    def error(self, prediction: Tensor, actions: Tensor) -> Tensor:
        """Return how wrong guesses (B, width) are, (B,): squared for numbers plus cross-entropy for each choice."""
        flat = actions.reshape(len(actions), -1)
        wrong = prediction.new_zeros(len(prediction))
        if self.plain:
            wrong = wrong + (prediction[:, : self.plain] - self._scaled(flat[:, : self.plain])).square().mean(dim=1)
        for place, logits in enumerate(prediction[:, self.plain :].split(self.counts, dim=1) if self.counts else ()):
            wrong = wrong + functional.cross_entropy(logits, flat[:, self.plain + place].long(), reduction="none")
        return wrong

    def _scaled(self, numbers: Tensor) -> Tensor:
        assert self.numbers is not None
        low, high = torch.tensor(self.numbers.low), torch.tensor(self.numbers.high)
        bounded = torch.isfinite(low) & torch.isfinite(high)
        middle = torch.where(bounded, (high + low) / 2, torch.zeros_like(low)).to(numbers.device)
        half = torch.where(bounded, (high - low) / 2, torch.ones_like(low)).to(numbers.device)
        return (numbers.float() - middle) / half
