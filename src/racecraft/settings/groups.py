"""The settings of a training, group by group.

Defaults are those of the preset `fast`, which seeks the least wall time to skill on two cores; `presets.py` in
`training` says what another preset changes.
"""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass, field
from typing import Any

from racecraft.settings.table import check_group, setting


@dataclass(frozen=True)
class RaceConfig:
    """The race: which car, how episodes start and end."""

    car: str = setting(
        "v6",
        "Vehicle profile: the console's car until mid-2022, its later one, today's (ROS 2), or the ideal bicycle.",
        choices=("v4", "v5-classic", "v6", "kinematic"),
    )
    max_episode_seconds: float | None = setting(
        None,
        "An episode is cut after this much simulated time; by default 100 s, or 100 000 ticks with fidelity aws.",
        unit="s",
        low=1.0,
    )
    start_offset: float = setting(
        0.0,
        "Where on the lap the first start lies; cars side by side are spread from there.",
        unit="lap",
        low=0.0,
        high=1.0,
    )
    start_advance: float = setting(
        0.05, "How far round the next start of a car lies after each training episode.", unit="lap", low=0.0, high=1.0
    )
    change_start: bool = setting(True, "Whether training starts advance round the track at all.")
    reverse: bool = setting(False, "Drive the track in the opposite direction.")
    waypoints: str = setting(
        "as_filed",
        "Whether a row that a route file repeats (59 of AWS's do) counts as a waypoint: as_filed, in all of AWS's logs "
        "of 2020 to 2026; distinct, in the code of simapp 6.0.5.",
        choices=("as_filed", "distinct"),
    )
    fidelity: str = setting(
        "sane",
        "Whose habits the world has where the original's are bugs: `racecraft.envs.deepracer.fidelity` lists each.",
        choices=("sane", "aws"),
    )

    def __post_init__(self) -> None:
        check_group(self)


@dataclass(frozen=True)
class CameraConfig:
    """The frame the policy sees; same optics at every size."""

    width: int = setting(40, "Pixels across.", unit="px", low=8, high=640)
    height: int = setting(30, "Pixels down.", unit="px", low=6, high=480)
    light: str = setting(
        "car",
        "Year of the original whose light falls on the circuit; car: 2021 for classic cars, 2026 for today's.",
        choices=("car", "2019", "2021", "2026"),
    )
    grass: bool = setting(False, "The field has the grain of grass, as in the original, instead of one plain colour.")

    def __post_init__(self) -> None:
        check_group(self)


@dataclass(frozen=True)
class RolloutConfig:
    """How experience is gathered."""

    num_worlds: int = setting(32, "Worlds (cars) stepped side by side.", low=1, high=65536)
    horizon: int = setting(64, "Ticks taken from each world before one update.", unit="ticks", low=1)
    episodes_per_iteration: int | None = setting(
        None,
        "With a number: an iteration is this many whole episodes, a fixed quota a world, instead of `horizon`.",
        low=1,
    )
    memory_steps: int | None = setting(
        None,
        "With a number: once the episodes of an iteration hold more ticks than this, the rest of them are not learned "
        "from.",
        unit="ticks",
        low=1,
    )

    def __post_init__(self) -> None:
        check_group(self)


@dataclass(frozen=True)
class NetworkConfig:
    """The policy's and the critic's network."""

    conv_filters: tuple[int, ...] = setting((16, 32), "Filters of each convolution.", low=1)
    conv_kernels: tuple[int, ...] = setting((6, 4), "Kernel size of each convolution.", unit="px", low=1)
    conv_strides: tuple[int, ...] = setting((3, 2), "Stride of each convolution.", unit="px", low=1)
    image_units: tuple[int, ...] | None = setting(
        None, "Units of each dense layer between an image's convolutions and what all observations share.", low=1
    )
    hidden_units: tuple[int, ...] = setting((128,), "Units of each dense layer.", low=1)
    activation: str = setting("relu", "Non-linearity between layers.", choices=("relu", "tanh"))
    privileged_critic: bool = setting(
        True, "While training, the critic sees the true state the world offers; the policy never does."
    )
    separate_networks: bool = setting(False, "Whether a critic without privileges shares nothing with the policy.")
    initialisation: str = setting(
        "orthogonal", "How the first weights are drawn; biases start at 0.", choices=("orthogonal", "glorot")
    )

    def __post_init__(self) -> None:
        check_group(self)


@dataclass(frozen=True)
class PpoConfig:
    """Proximal policy optimisation with a clipped objective."""

    learning_rate: float = setting(5e-4, "Adam's step size.", low=1e-8, high=1.0)
    discount: float = setting(0.97, "Weight of the next tick's value (gamma).", low=0.0, high=1.0)
    gae_lambda: float = setting(0.95, "Mix of advantage estimates (lambda).", low=0.0, high=1.0)
    epochs: int = setting(4, "Passes over each rollout.", low=1, high=100)
    batch_size: int = setting(256, "Transitions in one minibatch.", low=1)
    clip: float = setting(0.2, "How far the probability ratio may move from 1.", low=0.0, high=1.0)
    entropy_weight: float = setting(0.01, "Weight of the entropy bonus.", low=0.0, high=1.0)
    value_weight: float = setting(0.5, "Weight of the value loss.", low=0.0)
    value_loss: str = setting("mse", "How the critic's error is measured.", choices=("mse", "huber"))
    max_grad_norm: float | None = setting(0.5, "Gradients are scaled down to this norm.", low=0.0)
    adam_epsilon: float = setting(1e-5, "Adam's epsilon.", low=0.0)
    adam_form: str = setting(
        "paper",
        "Where Adam adds its epsilon: `tensorflow` adds it before the second moment's bias is taken out, which makes "
        "the first steps smaller.",
        choices=("paper", "tensorflow"),
    )
    standardise: str = setting(
        "minibatch", "Over what advantages are standardised.", choices=("minibatch", "rollout", "none")
    )
    drop_remainder: bool = setting(False, "Leave out the last minibatch of an epoch when it is not full.")
    precision: str = setting(
        "float32",
        "What layers multiply in while training; weights, heads, losses and Adam stay float32. bfloat16 is coarser, "
        "and faster on processors that have it (avx512_bf16, amx); auto takes it there.",
        choices=("float32", "bfloat16", "auto"),
    )
    probability_floor: float = setting(
        0.0, "No choice counts as less likely than this; the others are not lowered for it.", low=0.0, high=1e-3
    )
    exploration: str = setting(
        "categorical",
        "How choices are drawn while training: by their probability, or the likeliest with random ones between.",
        choices=("categorical", "e-greedy"),
    )
    epsilon_last: float = setting(
        0.05, "Share of random choices at the end; with e-greedy exploration.", low=0.0, high=1.0
    )
    epsilon_steps: int = setting(
        10_000, "Steps until that share is reached, in a straight line from 1; with e-greedy.", unit="steps", low=1
    )

    def __post_init__(self) -> None:
        check_group(self)


@dataclass(frozen=True)
class SelfPlayConfig:
    """Snakes that learn: whom they meet, what they see and what they are paid."""

    anchor_share: float = setting(
        0.5, "Share of the games against anchors, built-in players that never change.", low=0.0, high=1.0
    )
    anchors: tuple[str, ...] = setting(
        ("flood_fill", "flood_fill", "hungry", "random_safe"),
        "Who sits there, in turn; a name may stand several times.",
        choices=("random_safe", "hungry", "flood_fill"),
    )
    pool_share: float = setting(
        0.25, "Share of the games against a past self from the pool; the rest is against itself.", low=0.0, high=1.0
    )
    pool_size: int = setting(8, "Past selves in the pool; the oldest leave it.", low=1, high=100)
    pool_every: int = setting(10, "A self enters the pool after every so many iterations.", unit="iterations", low=1)
    view: int = setting(11, "Side of the window about the head; odd.", unit="squares", low=3, high=49)
    outlook: bool = setting(
        True, "Whether a snake is told the room, territory, food and heads behind each of its moves."
    )
    food_prize: float = setting(0.0, "Reward for a food; a win is worth 1, a death -1.", low=-1.0, high=1.0)
    max_turns: int = setting(500, "A game that lasts longer is cut.", unit="turns", low=1)

    def __post_init__(self) -> None:
        check_group(self)


@dataclass(frozen=True)
class EvaluationConfig:
    """How progress is judged while training."""

    every: int = setting(1, "Evaluate after every so many iterations.", unit="iterations", low=1)
    episodes: int = setting(5, "Greedy episodes of one evaluation, starts spread round the track.", low=1, high=1000)
    best_by: str = setting(
        "progress",
        "What makes a checkpoint of a car the best: mean progress, mean reward (the reward function is asked then), or "
        "mean lap time (an unfinished lap counts 999.999 s). Of equals the newer.",
        choices=("progress", "reward", "laptime"),
    )
    stable_after: int = setting(2, "Evaluations in a row, all laps complete, that count as stable.", low=1)

    def __post_init__(self) -> None:
        check_group(self)


@dataclass(frozen=True)
class RuntimeConfig:
    """Where the work is done."""

    threads: int | None = setting(None, "CPU threads for worlds and learner; none takes every core.", low=1)
    device: str = setting("cpu", "Device of the learner.", choices=("cpu", "cuda"))

    def __post_init__(self) -> None:
        check_group(self)


@dataclass(frozen=True)
class TrainSettings:
    """Everything about a training that is a setting, group by group."""

    race: RaceConfig = field(default_factory=RaceConfig)
    camera: CameraConfig = field(default_factory=CameraConfig)
    rollout: RolloutConfig = field(default_factory=RolloutConfig)
    network: NetworkConfig = field(default_factory=NetworkConfig)
    ppo: PpoConfig = field(default_factory=PpoConfig)
    selfplay: SelfPlayConfig = field(default_factory=SelfPlayConfig)
    evaluation: EvaluationConfig = field(default_factory=EvaluationConfig)
    runtime: RuntimeConfig = field(default_factory=RuntimeConfig)


def group_names(settings: Any) -> list[str]:
    """Return the names of the groups of a settings object, in the order of declaration."""
    return [part.name for part in dataclasses.fields(settings)]
