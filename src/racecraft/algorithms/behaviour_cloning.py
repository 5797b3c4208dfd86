"""Behavioural cloning: learn to do what was shown, as one learns any table by heart. Begin with `cloning_loss`.

Source: Pomerleau, "ALVINN: an autonomous land vehicle in a neural network", 1988.

Demonstrations are recorded observations and actions (`racecraft record`, `racecraft.formats.demonstrations`). An
iteration is one pass over them in shuffled minibatches, making each recorded action likelier where it was taken. Some
episodes are held out, so that learning by heart shows. The world itself teaches nothing here: what the clone meets in
it is only watched, and judges it. A clone knows nothing of where its demonstrator never was; go on with another
algorithm from its weights (`--from`), which fit every learner with such a network.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import torch
from torch import Tensor

from racecraft.algorithms.adam import Adam
from racecraft.algorithms.demonstrations import DemonstrationBatch, demonstration_tensors, read_demonstration_batch
from racecraft.algorithms.distributions import DiagGaussian, Distribution, distribution_for
from racecraft.algorithms.learner import ROLLOUT, Decision, DivergedError
from racecraft.algorithms.network_learner import ActorCriticLearner
from racecraft.algorithms.networks import ActorCritic, Architecture, NetworkConfig
from racecraft.contract.errors import SettingError
from racecraft.contract.world import (
    ActionSpec,
    Array,
    ContinuousActions,
    DiscreteActions,
    HybridActions,
    WorldSpec,
)
from racecraft.formats.demonstrations import Demonstrations
from racecraft.settings.composition import Settings
from racecraft.settings.table import check_group, setting

FIGURES = {
    "loss": "Mean -log probability of the recorded actions, in nats (of numbers: -log density).",
    "agreement": "Share of recorded choices that are the clone's likeliest; of numbers: of those within a tenth of "
    "their range.",
    "held_out_loss": "The same loss on the episodes held out, after the pass; 0 where none are.",
    "held_out_agreement": "The same share on the episodes held out, after the pass; 0 where none are.",
    "transitions": "Recorded ticks learned from in one pass.",
    "minibatches": "Gradient steps taken.",
}
"""What an update tells: means over its minibatches, unless it says otherwise."""
NEAR = 0.2
"""Numbers in [-1, 1] units agree within so much: a tenth of the range."""


@dataclass(frozen=True)
class BcConfig:
    """Behavioural cloning: recorded actions grow likelier where they were taken."""

    demonstrations: str | None = setting(
        None,
        "File of recorded episodes (`racecraft record RUN` writes one), or ML-Agents' `.demo` files: one, or a folder.",
    )
    learning_rate: float = setting(1e-3, "Adam's step size.", low=1e-8, high=1.0)
    batch_size: int = setting(256, "Recorded ticks in one minibatch.", low=1)
    held_out: float = setting(
        0.1, "Share of the recorded episodes that is only judged by, the last ones.", low=0.0, high=0.9
    )
    least_std: float = setting(
        0.1, "Numbers keep at least this standard deviation, of half their range: others explore from it.", low=1e-3
    )

    def __post_init__(self) -> None:
        check_group(self)


class BcLearner(ActorCriticLearner[BcConfig]):
    """A policy that learns from recorded episodes.

    Args:
        spec: The world's promise; what was recorded must be seen and decided in it.
        network: The network's settings, or a whole `Architecture`.
        config: The algorithm's settings.
        shown: What was recorded.
        seed: Of the first weights and the order of minibatches.
        device: "cpu" or "cuda".

    """

    name = "bc"
    experience = ROLLOUT
    figures = FIGURES
    supported_network_settings = ("encoder",)
    """Settings of `network` that are followed beside its layers."""

    def __init__(
        self,
        spec: WorldSpec,
        network: NetworkConfig | Architecture,
        config: BcConfig,
        shown: Demonstrations,
        seed: int,
        device: str = "cpu",
    ) -> None:
        super().__init__(spec, network, config, seed, device, distribution_for(spec.actions))
        self.optimiser = Adam(self.network.parameters(), config.learning_rate, 1e-8)
        demonstrations = demonstration_tensors(
            shown, spec, self.network.policy_body.names, self.device, "bc.demonstrations"
        )
        self.shown = replace(demonstrations, actions=to_raw(demonstrations.actions, spec.actions))
        first_held = shown.num_episodes - int(config.held_out * shown.num_episodes)
        held = torch.from_numpy(shown.episode >= first_held)
        self.taught, self.held = (part.nonzero().squeeze(1).to(self.device) for part in (~held, held))

    @classmethod
    def build(cls, spec: WorldSpec, settings: Settings, seed: int) -> BcLearner:
        """Return a learner with the settings' groups `network`, `bc` and `runtime`.

        Raises:
            SettingError: No demonstrations are named, or they are of another world.
            CheckpointError: There is no such file, or it holds no demonstrations.
        """
        path = settings.bc.demonstrations
        if path is None:
            raise SettingError(
                "bc learns from recorded episodes and none are named; expected --set bc.demonstrations=FILE, such as "
                "`racecraft record RUN --output demos.safetensors` writes."
            )
        demonstrations = read_demonstration_batch(path)
        return cls(spec, settings.network, settings.bc, demonstrations, seed, settings.runtime.device)

    def act(
        self,
        observations: Mapping[str, Array],
        action_mask: Array | None = None,
        *,
        generator: torch.Generator | None = None,
        rows: Array | None = None,
    ) -> Decision:
        """Do what is likeliest: nothing is explored, for nothing is learned from it."""
        return Decision(self.policy.act(observations, action_mask), {})

    def update(self, experience: Any) -> dict[str, float]:
        """Go once through what was shown, whatever the world brought; return `FIGURES`.

        Raises:
            DivergedError: The loss is no longer a number.
        """
        order = self.taught[torch.randperm(len(self.taught), generator=self.generator, device=self.device)]
        losses = [self._step(self.shown.take(rows)) for rows in order.split(self.config.batch_size)]
        means = torch.stack(losses).mean(dim=0).tolist()
        if not np.isfinite(means).all():
            raise DivergedError(
                "After {count} minibatches loss and agreement are {means}; expected numbers. Lower "
                "bc.learning_rate, and go on from the last checkpoint.",
                count=len(losses),
                means=means,
            )
        return dict(zip(FIGURES, [*means, *self._judge(), len(order), len(losses)], strict=True))

    def _step(self, batch: DemonstrationBatch) -> Tensor:
        loss, agreement = cloning_loss(self.network, self.distribution, batch)
        self.network.zero_grad()
        loss.backward()
        self.optimiser.step()
        if self.network.log_std is not None:
            self.network.log_std.data.clamp_(min=float(np.log(self.config.least_std)))
        return torch.stack([loss.detach(), agreement])

    @torch.inference_mode()
    def _judge(self) -> list[float]:
        """Return loss and agreement on what is held out."""
        if not len(self.held):
            return [0.0, 0.0]
        parts = self.held.split(4096)
        losses = [torch.stack(cloning_loss(self.network, self.distribution, self.shown.take(rows))) for rows in parts]
        sizes = torch.tensor([len(rows) for rows in parts], device=self.device)
        mean: list[float] = ((torch.stack(losses) * sizes[:, None]).sum(dim=0) / sizes.sum()).tolist()
        return mean


def cloning_loss(network: ActorCritic, distribution: Distribution, batch: DemonstrationBatch) -> tuple[Tensor, Tensor]:
    """Return the mean -log probability of what was shown, and the share in which the clone would do the same.

    The actions of the batch are raw ones (`to_raw`).
    """
    params = network.policy(batch.observations)
    log_prob, _ = distribution.log_prob_and_entropy(params, network.log_std, batch.action_mask, batch.actions)
    with torch.no_grad():
        argmax_action, _ = distribution.mode(params, network.log_std, batch.action_mask)
        away = (argmax_action - batch.actions).abs().float().reshape(len(params), -1).amax(dim=1)
    return -log_prob.mean(), (away < NEAR).float().mean()


def to_raw(actions: Tensor, spec: ActionSpec) -> Tensor:
    """Return recorded actions as raw ones: choices as they are, bounded numbers in [-1, 1] units."""
    if isinstance(spec, HybridActions):
        width = spec.continuous.shape[0]
        return torch.cat([to_raw(actions[:, :width], spec.continuous), actions[:, width:]], dim=1)
    if not isinstance(spec, ContinuousActions):
        return actions.long() if isinstance(spec, DiscreteActions) else actions
    bounds = DiagGaussian(spec)
    centre, scale = (part.to(actions.device) for part in (bounds.centre, bounds.scale))
    return (actions.float() - centre) / scale
