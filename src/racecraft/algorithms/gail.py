"""Reward for what cannot be told from what was shown: generative adversarial imitation. Begin with `GailModel`.

A discriminator learns to tell ticks of demonstrations from the learner's own; D, from 0 to 1, is how surely it takes a
tick for a shown one. The reward is -log(1 - D): the better the learner passes for its teacher, the more it earns. What
is seen decides, and with `use_actions` what is done as well. A gradient penalty keeps the discriminator smooth, or it
soon knows everything by heart and says nothing.

The reward is never negative, so an episode that goes on is worth something by itself; a task whose episodes should end
early wants the world's reward beside it, or more of it.

Source: Ho and Ermon, "Generative adversarial imitation learning", 2016; the penalty: Gulrajani et al., "Improved
training of Wasserstein GANs", 2017.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
import torch
from torch import Tensor, nn
from torch.nn import functional

from racecraft.algorithms.curiosity import ActionCode
from racecraft.algorithms.demonstrations import demonstration_tensors
from racecraft.algorithms.networks import IMAGE_SCALE, Architecture, Encoder, dense
from racecraft.algorithms.rnd import load_model_state, model_state
from racecraft.contract.world import Array, SingleActions, WorldSpec
from racecraft.formats.demonstrations import Demonstrations
from racecraft.settings.table import check_group, setting

SUREST = 1.0 - 1e-7
"""D counts as no surer than this, or the reward would have no end: 16.1 at most."""
ACTION = "(action)"
"""Name of what was done among what is judged; no observation is called so."""
ROWS_AT_ONCE = 1024
"""How many ticks are judged at once."""


@dataclass(frozen=True)
class GailConfig:
    """Reward for what cannot be told from demonstrations (GAIL)."""

    strength: float = setting(0.0, "Weight of the reward -log(1 - D); 0: none.", low=0.0)
    demonstrations: str | None = setting(
        None, "Recorded episodes: a file of `racecraft record RUN`, or ML-Agents' `.demo`, one or a folder of them."
    )
    use_actions: bool = setting(False, "Judge what is done as well, not only what is seen.")
    learning_rate: float = setting(3e-4, "Adam's step size.", low=1e-8, high=1.0)
    units: int = setting(128, "Units of each of the discriminator's two dense layers.", low=1)
    batch_size: int = setting(
        128, "Ticks of either kind in one minibatch; each of the learner's is learned from once.", low=1
    )
    gradient_penalty: float = setting(10.0, "Weight of the squared departure of the gradient's norm from 1.", low=0.0)

    def __post_init__(self) -> None:
        check_group(self)


class GailModel:
    """A discriminator between what was shown and what the learner does.

    Args:
        spec: The world's promise; privileged observations are left out.
        actions: What is done in it.
        architecture: Its convolutions serve images.
        config: The settings.
        shown: What was recorded.
        seed: Of the weights, and of which ticks are compared.
        device: "cpu" or "cuda".

    Raises:
        SettingError: The recorded episodes are of another world.
    """

    name = "gail"
    is_novelty = False
    figures: Mapping[str, str] = {
        "gail_loss": "Cross-entropy of telling shown ticks from own ones, in nats; 1.39 where nothing can be told.",
        "gail_shown": "Mean D of shown ticks, 0 to 1.",
        "gail_own": "Mean D of the learner's ticks, 0 to 1.",
    }

    def __init__(
        self,
        spec: WorldSpec,
        actions: SingleActions,
        architecture: Architecture,
        config: GailConfig,
        demonstrations: Demonstrations,
        seed: int,
        device: str,
    ) -> None:
        self.config, self.strength, self.device = config, config.strength, torch.device(device)
        seen = {name: part for name, part in spec.observations.items() if not part.privileged}
        self.shown = demonstration_tensors(demonstrations, spec, seen, self.device, "gail.demonstrations")
        row = replace(architecture, trunk_units=(config.units,))
        chance, units = torch.Generator().manual_seed(seed), config.units
        self.actions = ActionCode(actions) if config.use_actions else None
        width = 0 if self.actions is None else self.actions.width
        self.networks = nn.ModuleDict({
            "features": Encoder(seen, row, chance),
            "judge": nn.Sequential(
                dense(units + width, units, row, chance, 1.0), nn.Tanh(), dense(units, 1, row, chance, 1.0)
            ),
        }).to(self.device)  # fmt: skip
        self.names = list(seen)
        self.optimiser = torch.optim.Adam(self.networks.parameters(), config.learning_rate)
        self.generator = torch.Generator().manual_seed(seed + 1)

    @torch.inference_mode()
    def bonus(self, before: Mapping[str, Array], actions: Array, after: Mapping[str, Array]) -> Array:
        """Return -log(1 - D) of each of B ticks, float32 (B,)."""
        bonuses = []
        for rows in np.array_split(np.arange(len(actions)), -(-len(actions) // ROWS_AT_ONCE)):
            sure = torch.sigmoid(self._logits(self._own(before, actions, rows)))
            bonuses.append(-torch.log(1.0 - SUREST * sure))
        return torch.cat(bonuses).cpu().numpy()

    def learn(self, before: Mapping[str, Array], actions: Array, after: Mapping[str, Array]) -> dict[str, float]:
        """Learn to tell B ticks from as many shown ones, each once."""
        losses = []
        for rows in torch.randperm(len(actions), generator=self.generator).split(self.config.batch_size):
            picked = torch.randint(len(self.shown), (len(rows),), generator=self.generator)
            taken = self.shown.take(picked.to(self.device))
            own, demonstrated = (
                self._own(before, actions, rows.numpy()),
                self._inputs(taken.observations, taken.actions),
            )
            theirs, ours = self._logits(demonstrated), self._logits(own)
            wrong = functional.softplus(-theirs).mean() + functional.softplus(ours).mean()
            loss = wrong + self.config.gradient_penalty * self._roughness(demonstrated, own)
            self.optimiser.zero_grad()
            loss.backward()
            self.optimiser.step()
            losses.append(torch.stack([wrong, torch.sigmoid(theirs).mean(), torch.sigmoid(ours).mean()]).detach())
        return dict(zip(self.figures, torch.stack(losses).mean(dim=0).tolist(), strict=True))

    def state_dict(self) -> dict[str, Tensor]:
        """Return networks, optimiser and chance."""
        return model_state({"networks": self.networks}, self.optimiser, self.generator)

    def load_state_dict(self, state: Mapping[str, Tensor]) -> None:
        """Go on from what `state_dict` gave."""
        load_model_state(state, {"networks": self.networks}, self.optimiser, self.generator)

    def _own(self, seen: Mapping[str, Array], actions: Array, rows: Array) -> dict[str, Tensor]:
        parts = {name: torch.from_numpy(seen[name][rows]).to(self.device) for name in self.names}
        return self._inputs(parts, torch.from_numpy(actions[rows]).to(self.device))

    def _inputs(self, seen: Mapping[str, Tensor], actions: Tensor) -> dict[str, Tensor]:
        """Return all that is judged as float32: pixels from 0 to 1, actions as `ActionCode` tells them."""
        inputs = {
            name: part.float() * IMAGE_SCALE if part.dtype == torch.uint8 else part.float()
            for name, part in seen.items()
        }
        return inputs if self.actions is None else {**inputs, ACTION: self.actions.encoded(actions)}

    def _logits(self, inputs: Mapping[str, Tensor]) -> Tensor:
        """Return log(D / (1 - D)), (B,)."""
        features = self.networks["features"](inputs)
        if self.actions is not None:
            features = torch.cat([features, inputs[ACTION]], dim=1)
        found: Tensor = self.networks["judge"](features).squeeze(1)
        return found

    def _roughness(self, demonstrated: Mapping[str, Tensor], own: Mapping[str, Tensor]) -> Tensor:
        """Return the mean squared departure of the gradient's norm from 1, on the way from shown to own ticks."""
        rows = len(next(iter(own.values())))
        share = torch.rand(rows, generator=self.generator).to(self.device)
        between = {}
        for name, part in own.items():
            weight = share.reshape(-1, *(1,) * (part.ndim - 1))
            between[name] = (weight * demonstrated[name] + (1.0 - weight) * part).requires_grad_()
        slopes = torch.autograd.grad(self._logits(between).sum(), list(between.values()), create_graph=True)
        norm = torch.cat([slope.flatten(1) for slope in slopes], dim=1).norm(dim=1)
        return (norm - 1.0).square().mean()
