"""Random network distillation: what a network cannot foretell of another's whims is new. Begin with `RndModel`.

A random network that never learns maps what is seen to k numbers; a second one learns to foretell them from all that
was seen. Where its error is large, it has not been often. Nothing about actions or the world's dynamics is learned, so
a next step that cannot be foretold does not draw it. What is seen is whitened and cut at 5 deviations, or the random
network's answers would hardly differ.

Source: Burda et al., "Exploration by random network distillation", 2018.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
import torch
from torch import Tensor, nn

from racecraft.algorithms.intrinsic import RunningMoments
from racecraft.algorithms.networks import Architecture, Encoder, dense
from racecraft.contract.world import Array, ArraySpec
from racecraft.settings.table import check_group, setting

CUT = 5.0
"""Deviations from the mean beyond which what is seen looks alike."""


@dataclass(frozen=True)
class RndConfig:
    """Reward for what is new: random network distillation."""

    strength: float = setting(0.0, "Weight of the bonus, which is measured in its own deviations; 0: none.", low=0.0)
    learning_rate: float = setting(1e-4, "Adam's step size.", low=1e-8, high=1.0)
    units: int = setting(128, "Units of each of the two dense layers.", low=1)
    outputs: int = setting(64, "Numbers of the random network that are foretold.", low=1)
    batch_size: int = setting(256, "Transitions in one minibatch; each is learned from once.", low=1)

    def __post_init__(self) -> None:
        check_group(self)


class RndModel:
    """How new what is seen is, by the error of a foretelling network.

    Args:
        observations: What is seen; privileged names are left out.
        architecture: Its convolutions serve images.
        config: The settings.
        seed: Of the weights and the order of minibatches.
        device: "cpu" or "cuda".
    """

    name = "rnd"
    is_novelty = True
    figures: Mapping[str, str] = {"rnd_loss": "Mean squared error of what was foretold, over the rollout."}

    def __init__(
        self,
        observations: Mapping[str, ArraySpec],
        architecture: Architecture,
        config: RndConfig,
        seed: int,
        device: str,
    ) -> None:
        self.config, self.strength, self.device = config, config.strength, torch.device(device)
        self.seen = {name: part for name, part in observations.items() if not part.privileged}
        row = replace(architecture, trunk_units=(config.units,), memory="none", memory_units=0)
        chance = torch.Generator().manual_seed(seed)
        self.target, self.predictor = (_distilled(self.seen, row, config, chance).to(self.device) for _ in range(2))
        self.target.requires_grad_(False)
        self.optimiser = torch.optim.Adam(self.predictor.parameters(), config.learning_rate)
        self.generator = torch.Generator().manual_seed(seed + 1)
        self.moments = {name: RunningMoments(part.shape) for name, part in self.seen.items()}

    def bonus(self, before: Mapping[str, Array], actions: Array, after: Mapping[str, Array]) -> Array:
        """Return the error over what is seen after each of B transitions, float32 (B,)."""
        for name, moments in self.moments.items():
            moments.add(after[name])
        bonuses = []
        with torch.inference_mode():
            for rows in np.array_split(np.arange(len(actions)), -(-len(actions) // self.config.batch_size)):
                bonuses.append(self._errors(self._whitened(after, rows)).cpu().numpy())
        return np.concatenate(bonuses)

    def learn(self, before: Mapping[str, Array], actions: Array, after: Mapping[str, Array]) -> dict[str, float]:
        """Learn to foretell the random network after B transitions, each once."""
        losses = []
        for rows in torch.randperm(len(actions), generator=self.generator).split(self.config.batch_size):
            loss = self._errors(self._whitened(after, rows.numpy())).mean()
            self.optimiser.zero_grad(set_to_none=True)
            loss.backward()
            self.optimiser.step()
            losses.append(loss.detach())
        return {"rnd_loss": float(torch.stack(losses).mean())}

    def state_dict(self) -> dict[str, Tensor]:
        """Return both networks, the optimiser, the moments and chance."""
        return {
            **model_state({"target": self.target, "predictor": self.predictor}, self.optimiser, self.generator),
            **{f"seen/{name}/{key}": part for name, one in self.moments.items() for key, part in one.state().items()},
        }

    def load_state_dict(self, state: Mapping[str, Tensor]) -> None:
        """Go on from what `state_dict` gave."""
        load_model_state(state, {"target": self.target, "predictor": self.predictor}, self.optimiser, self.generator)
        for name, moments in self.moments.items():
            moments.restore({key: state[f"seen/{name}/{key}"] for key in ("count", "mean", "variance")})

    def _errors(self, seen: dict[str, Tensor]) -> Tensor:
        return (self.predictor(seen) - self.target(seen)).square().mean(dim=1)

    def _whitened(self, named: Mapping[str, Array], rows: Array) -> dict[str, Tensor]:
        parts = {}
        for name, moments in self.moments.items():
            apart = (named[name][rows] - moments.mean) / np.sqrt(moments.variance + 1e-8)
            parts[name] = torch.from_numpy(np.clip(apart, -CUT, CUT).astype(np.float32)).to(self.device)
        return parts


def _distilled(
    seen: Mapping[str, ArraySpec], row: Architecture, config: RndConfig, chance: torch.Generator
) -> nn.Sequential:
    body = Encoder(seen, row, chance)
    return nn.Sequential(body, dense(body.width, config.units, row, chance, 1.0), nn.ReLU(),
                         dense(config.units, config.outputs, row, chance, 1.0))  # fmt: skip


def model_state(
    networks: Mapping[str, nn.Module], optimiser: torch.optim.Optimizer, generator: torch.Generator
) -> dict[str, Tensor]:
    """Return networks, torch's Adam and chance as named tensors (copies)."""
    state = {
        f"{name}/{key}": part.detach().clone()
        for name, one in networks.items()
        for key, part in one.state_dict().items()
    }
    for number, moments in optimiser.state_dict()["state"].items():
        state |= {f"adam/{number}/{key}": part.clone() for key, part in moments.items()}
    return {**state, "generator": generator.get_state()}


def load_model_state(
    state: Mapping[str, Tensor],
    networks: Mapping[str, nn.Module],
    optimiser: torch.optim.Optimizer,
    generator: torch.Generator,
) -> None:
    """Go on from what `model_state` gave."""
    for name, network in networks.items():
        start = f"{name}/"
        network.load_state_dict({key.removeprefix(start): part for key, part in state.items() if key.startswith(start)})
    optimiser_state = optimiser.state_dict()
    moments: dict[int, dict[str, Tensor]] = {}
    for key, part in state.items():
        if key.startswith("adam/"):
            _, number, kind = key.split("/")
            moments.setdefault(int(number), {})[kind] = part.clone()
    optimiser.load_state_dict({**optimiser_state, "state": moments})
    generator.set_state(state["generator"].cpu())
