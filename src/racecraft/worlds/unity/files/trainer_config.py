"""What ML-Agents' trainer configuration says, as values; `trainer_yaml.py` reads them from a file.

Begin at `TrainerConfig`. None stands where the file says nothing, but for what ML-Agents does silently and a training
here goes by: the schedules, and 500,000 steps.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

PPO, SAC = "ppo", "sac"
"""Trainers whose sections are followed, by ML-Agents' names, which are ours as well."""


@dataclass(frozen=True)
class BehaviorConfig:
    """How one behavior learns; None where the file says nothing."""

    name: str
    batch_size: int | None = None
    """Transitions in one minibatch."""
    buffer_size: int | None = None
    """Transitions gathered before one update, all agents together."""
    learning_rate: float | None = None
    """Adam's step size."""
    beta: float | None = None
    """Weight of the entropy bonus."""
    epsilon: float | None = None
    """How far the probability ratio may move from 1."""
    lambd: float | None = None
    """Mix of advantage estimates, 0 to 1."""
    num_epoch: int | None = None
    """Passes over each buffer."""
    gamma: float | None = None
    """Weight of the next step's value, 0 to 1, from the extrinsic reward signal."""
    hidden_units: int | None = None
    """Units of each dense layer."""
    num_layers: int | None = None
    """Dense layers."""
    vis_encode_type: str | None = None
    """Convolutions over pictures: `simple` or `nature_cnn`."""
    max_steps: int | None = None
    """Stop after so many steps of all agents together; ML-Agents' 500,000 where a section does not say it."""
    learning_rate_schedule: str | None = None
    """`linear` (falls to its end in `SCHEDULE_ENDS` at max_steps) or `constant`, with ML-Agents' default."""
    beta_schedule: str | None = None
    """The same for beta; as the learning rate's where the section does not say it."""
    epsilon_schedule: str | None = None
    """The same for epsilon."""
    normalize: bool | None = None
    """Whether vector observations are scaled by their running mean and deviation."""
    time_horizon: int | None = None
    """Steps of one agent before its trajectory goes into the buffer."""
    memory_size: int | None = None
    """Numbers an LSTM carries from step to step, h and c together; None: no memory."""
    sequence_length: int | None = None
    """Steps that gradients flow back through; with a memory."""
    signals: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)
    """Of `curiosity`, `rnd` and `gail`, where asked for: strength, learning_rate, units; of GAIL also demonstrations
    and use_actions."""
    cloning: Mapping[str, Any] = field(default_factory=dict)
    """Of `behavioral_cloning`, where asked for: strength, demonstrations, steps, batch_size, epochs,
    samples_per_update."""
    trainer: str = PPO
    """`trainer_type`, as the file has it."""
    tau: float | None = None
    """How far SAC's slow critics follow at a time, 0 to 1."""
    steps_per_update: float | None = None
    """Steps of all agents together for each of SAC's gradient steps."""
    buffer_init_steps: int | None = None
    """Steps before SAC begins to learn."""
    init_entcoef: float | None = None
    """Where SAC's temperature begins."""
    unfollowed: tuple[str, ...] = ()
    """What the section asks for that no trainer here does, by key and value: POCA, self-play."""

    def overrides(self, num_agents: int = 1, algorithm: str = PPO) -> tuple[str, ...]:
        """Return the settings as "group.name=value", for `apply_overrides`.

        Args:
            num_agents: Agents that act side by side; they share the buffer.
            algorithm: What learns: `ppo` or `sac`. Of a section for another trainer only the network is followed, and
                what both know: the size of a minibatch, the step size and the discount.

        >>> BehaviorConfig("Basic", batch_size=32, buffer_size=256, hidden_units=20, num_layers=1).overrides(4)
        ('ppo.batch_size=32', 'rollout.horizon=64', 'network.hidden_units=20')
        >>> BehaviorConfig("Ball", trainer="sac", buffer_size=9000, steps_per_update=2).overrides(4, "sac")
        ('replay.capacity=9000', 'sac.gradient_steps_per_step=0.5')
        """
        overrides = self._of_sac() if algorithm == SAC else self._of_ppo(num_agents)
        overrides |= self._of_network(algorithm)
        for signal, values in self.signals.items() if algorithm != SAC else ():
            overrides |= {f"{signal}.{name}": value for name, value in values.items()}
        if self.cloning and algorithm != SAC:
            overrides |= {f"imitation.{name}": value for name, value in self.cloning.items()}
            if self.learning_rate is not None:  # there it is the trainer's own
                overrides["imitation.learning_rate"] = self.learning_rate
        return tuple(f"{name}={value}" for name, value in overrides.items())

    def _named(self, settings: Mapping[str, str]) -> dict[str, Any]:
        return {setting: getattr(self, key) for setting, key in settings.items() if getattr(self, key) is not None}

    def _of_ppo(self, num_agents: int) -> dict[str, Any]:
        overrides = self._named(_PPO_SETTINGS)
        if self.buffer_size is not None and self.trainer != SAC:  # there it is a memory, and no rollout
            overrides["rollout.horizon"] = max(1, math.ceil(self.buffer_size / num_agents))
        return overrides

    def _of_sac(self) -> dict[str, Any]:
        if self.trainer != SAC:
            return self._named(_SHARED_SETTINGS)
        overrides = self._named({**_SHARED_SETTINGS, **_SAC_SETTINGS})
        if self.steps_per_update is not None:
            overrides["sac.gradient_steps_per_step"] = f"{1.0 / self.steps_per_update:g}"
        if self.buffer_init_steps is not None:
            overrides["replay.learning_starts"] = max(self.buffer_init_steps, self.batch_size or 1)
        return overrides

    def _of_network(self, algorithm: str) -> dict[str, Any]:
        overrides: dict[str, Any] = {}
        if self.normalize and algorithm != SAC:
            overrides["network.normalise"] = "true"
        if self.hidden_units is not None or self.num_layers is not None:
            units, layers = self.hidden_units or DEFAULT_UNITS, self.num_layers or DEFAULT_LAYERS
            overrides["network.hidden_units"] = ",".join([str(units)] * layers)
        if self.vis_encode_type is not None:
            columns = zip(*ENCODERS[self.vis_encode_type], strict=True)
            for name, column in zip(("filters", "kernels", "strides"), columns, strict=True):
                overrides[f"network.conv_{name}"] = ",".join(map(str, column))
        if self.memory_size is not None and algorithm != SAC:
            overrides |= {"network.memory": "lstm", "network.memory_units": self.memory_size // 2}
            overrides["ppo.sequence_length"] = self.sequence_length or DEFAULT_SEQUENCE_LENGTH
        return overrides


@dataclass(frozen=True)
class Sampler:
    """An environment parameter that is drawn at each reset."""

    kind: str
    """`uniform` (min, max), `gaussian` (mean, deviation) or `multirangeuniform` (min, max, min, max …)."""
    numbers: tuple[float, ...]


@dataclass(frozen=True)
class Lesson:
    """One lesson of a parameter's curriculum."""

    name: str
    value: float | Sampler
    measure: str = ""
    """What it is left by: `reward` or `progress`; "" for the last one."""
    behavior: str = ""
    """Whose measure that is."""
    threshold: float = 0.0
    """The measure has to exceed it."""
    min_episodes: int = 0
    """Episodes of the lesson before it can be left (min_lesson_length)."""
    is_smoothed: bool = True
    """Whether the measure is mixed with the one before (signal_smoothing)."""


@dataclass(frozen=True)
class TrainerConfig:
    """What a file says."""

    behaviors: Mapping[str, BehaviorConfig]
    env_path: str | None = None
    """The build."""
    env_args: tuple[str, ...] = ()
    """Arguments for the player."""
    num_envs: int | None = None
    """Processes."""
    num_areas: int | None = None
    """Training areas in each."""
    timeout_wait: float | None = None
    """Seconds that a player may be silent."""
    seed: int | None = None
    """None where the file says -1 (draw one) or nothing."""
    base_port: int | None = None
    """The first player's port."""
    max_lifetime_restarts: int | None = None
    """How often each lost player is started anew; -1: no limit."""
    restarts_rate_limit_n: int | None = None
    """How often within one period; -1: no limit."""
    restarts_rate_limit_period_s: float | None = None
    """The period, in seconds."""
    inference: bool = False
    """Whether the file asks for playing without learning."""
    no_graphics: bool | None = None
    """Whether the player opens no window."""
    engine: Mapping[str, float] = field(default_factory=dict)
    """width, height, quality_level, time_scale, target_frame_rate, capture_frame_rate, where given."""
    parameters: Mapping[str, float | Sampler] = field(default_factory=dict)
    """Environment parameters; of one with a curriculum the first lesson's value, or the last's for `inference`."""
    curricula: Mapping[str, tuple[Lesson, ...]] = field(default_factory=dict)
    """The lessons of parameters that have several."""
    device: str | None = None
    """`cpu` or `cuda`, from torch_settings."""
    notes: tuple[str, ...] = ()
    """What was read and is not followed, a clause each."""

    def behavior(self, name: str) -> BehaviorConfig:
        """Return the section of a behavior, named with or without its team; an empty one where there is none."""
        base = name.split("?")[0]
        found = self.behaviors.get(name) or self.behaviors.get(base) or self.behaviors.get("*")
        return found or BehaviorConfig(base)


SCHEDULE_ENDS = {"learning_rate": 1e-10, "beta": 1e-5, "epsilon": 0.1}
"""Where ML-Agents' linear schedules end, at max_steps."""
DEFAULT_MAX_STEPS = 500_000
"""What ML-Agents takes where a section says nothing."""
SILENT_DEFAULTS: Mapping[str, float] = {
    "batch_size": 1024, "buffer_size": 10240, "learning_rate": 3e-4, "beta": 5e-3, "epsilon": 0.2, "lambd": 0.95,
    "num_epoch": 3, "gamma": 0.99, "hidden_units": 128, "num_layers": 2,
}  # fmt: skip
"""The same, of what our own settings stand in for."""
DEFAULT_MEMORY_SIZE, DEFAULT_SEQUENCE_LENGTH = 128, 64
"""What ML-Agents takes where `memory` is there and does not say them."""
DEFAULT_UNITS, DEFAULT_LAYERS = 128, 2
"""What ML-Agents takes where one of the two is not given."""
ENCODERS = {
    "simple": ((16, 8, 4), (32, 4, 2)),
    "nature_cnn": ((32, 8, 4), (64, 4, 2), (64, 3, 1)),
}
"""(filters, kernel, stride) of the picture encoders that we follow."""
_PPO_SETTINGS = {
    "ppo.batch_size": "batch_size",
    "ppo.learning_rate": "learning_rate",
    "ppo.entropy_weight": "beta",
    "ppo.clip": "epsilon",
    "ppo.gae_lambda": "lambd",
    "ppo.epochs": "num_epoch",
    "ppo.discount": "gamma",
    "ppo.learning_rate_schedule": "learning_rate_schedule",
    "ppo.entropy_schedule": "beta_schedule",
    "ppo.clip_schedule": "epsilon_schedule",
}
_SHARED_SETTINGS = {
    "sac.batch_size": "batch_size",
    "sac.learning_rate": "learning_rate",
    "sac.discount": "gamma",
}
_SAC_SETTINGS = {
    "sac.target_rate": "tau",
    "sac.initial_temperature": "init_entcoef",
    "replay.capacity": "buffer_size",
}
