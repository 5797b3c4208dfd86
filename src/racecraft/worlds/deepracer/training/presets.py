"""From a preset, a racer's JSON files and overrides to the settings of one training. Begin with `settings_for`.

The order is: the preset, then the fidelity, then what `hyperparameters.json` gives, then each `--set`. Whatever is not
used is said.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass
from typing import Any

from racecraft.algorithms.apex import ApexConfig
from racecraft.algorithms.dqn import DqnConfig
from racecraft.algorithms.half_precision import processor_precision
from racecraft.algorithms.networks import NetworkConfig
from racecraft.algorithms.registry import Algorithm, find_algorithm
from racecraft.algorithms.sac import SacConfig
from racecraft.contract.errors import SettingError, nearest
from racecraft.rollout.settings import RolloutConfig
from racecraft.settings.composition import Settings
from racecraft.settings.overrides import apply_overrides, with_values
from racecraft.training.settings import EvaluationConfig, RuntimeConfig, composed
from racecraft.worlds.deepracer.env.fidelity import FIDELITIES, habits
from racecraft.worlds.deepracer.env.sensors import STEREO
from racecraft.worlds.deepracer.env.settings import (
    AgainstConfig,
    BotsConfig,
    BoxesConfig,
    CameraConfig,
    RaceConfig,
    with_race_groups,
)
from racecraft.worlds.deepracer.env.variation import RANGES, VariationConfig
from racecraft.worlds.deepracer.files.hyperparameters import Hyperparameters
from racecraft.worlds.deepracer.files.model_metadata import NETWORKS, ModelMetadata
from racecraft.worlds.deepracer.files.sensor_names import LIDARS

PPO = find_algorithm("ppo")

PRESETS = {
    "race": "the learner that laps fastest within a budget of steps; without files, a table and reward that race",
    "fast": "the learner and network that lap soonest on two cores; without files, the console's table, which crawls",
    "aws": "the learner and networks of AWS DeepRacer, figure by figure",
}
"""Every preset, with what it seeks."""
FIDELITY_OF = {"race": "sane", "fast": "sane", "aws": "aws"}
"""The fidelity that goes with a preset where none is asked for."""

SHALLOW, NORMAL, DEEP = NETWORKS


@dataclass(frozen=True)
class AwsNetwork:
    """One of the networks a racer's `neural_network` names."""

    convolutions: tuple[tuple[int, int, int], ...]
    """(filters, kernel px, stride px) of each, over a camera of one eye. AWS's dense layers behind them stand before
    anything is flattened, so they work on each place by itself: convolutions of one pixel."""
    stereo_convolutions: tuple[tuple[int, int, int], ...]
    """The same over two eyes, with no dense layers behind."""
    hidden_units: tuple[int, ...]
    """The "middleware"."""
    memory_steps: int
    """What the original's trainer could remember of an iteration."""


FEW, MANY = ((32, 8, 4), (64, 4, 2), (64, 3, 1)), ((32, 3, 1), (64, 3, 2), (64, 3, 1), (128, 3, 2), (128, 3, 1))
AWS_NETWORKS: Mapping[str, AwsNetwork] = {
    SHALLOW: AwsNetwork(FEW, FEW, (512,), 10_000),
    NORMAL: AwsNetwork(((32, 5, 2), (32, 3, 1), (64, 3, 2), (64, 3, 1), (64, 1, 1)), MANY, (512,), 3_000),
    DEEP: AwsNetwork(
        ((32, 8, 4), (32, 4, 2), (64, 4, 2), (64, 3, 1), (512, 1, 1), (512, 1, 1)), MANY, (256, 128), 3_000
    ),
}
"""Facts: simapp `sensors/utils.py`, `deepracer_memory.py`; Coach `embedder.py` (flattens last). Its batch norm, tanh
and dropout entries were never used."""
AWS_LIDAR_UNITS = (256, 256)
"""Dense layers over any LiDAR, whatever the network's name."""

TUNED: Mapping[str, Any] = {
    "dqn": DqnConfig(
        learning_rate=5e-4, discount=0.97, batch_size=128, train_every=16, target_every=200, epsilon_last=0.03,
        epsilon_steps=30_000, optimiser="adam", max_grad_norm=10.0, double=True, n_step=3,
    ),
    "apex": ApexConfig(learning_rate=5e-4, discount=0.97, target_every=200, optimiser="adam"),
    "sac": SacConfig(learning_rate=1e-3, batch_size=128, gradient_steps_per_step=0.5),
}  # fmt: skip
"""What each algorithm learns cars with; one that is not here takes its own defaults."""
TUNED_WORLDS: Mapping[str, Mapping[str, Any]] = {
    "sac": {
        "rollout": RolloutConfig(num_worlds=16, horizon=16),
        "evaluation": EvaluationConfig(every=4),
        "runtime": RuntimeConfig(threads=1),
    },
}
"""Groups of the car's settings that an algorithm wants otherwise. One thread: steps this small only wait
for a second one."""

RACE_VALUES: Mapping[str, Mapping[str, Any]] = {
    "network": {"stack_size": 3},
    "race": {"practice_seconds": 8.0},
    "rollout": {"horizon": 32},
    "ppo": {
        "learning_rate": 1.5e-3, "learning_rate_schedule": "linear", "entropy_weight": 0.003,
        "entropy_schedule": "linear", "initial_std": 0.3, "centred_pixels": True,
    },
    "evaluation": {"episodes": 20, "share": 0.25, "best_by": "pace", "averaged": 0.1},
    "variation": {"level": "perturbed", "in_evaluations": False},
}  # fmt: skip
"""What the preset `race` changes (benchmarks/racing.md): the policy sees the past, steps grow smaller towards the end
of the budget, and the best checkpoint is that of the best pace over several evaluations of 20 starts. Rollouts half as
long as usual bring the first stable laps sooner; later they grow. Numbers are drawn more narrowly from the beginning:
what is drawn across the whole range pays for hasty steering, whatever the policy does. Steps over centred pixels bring
the first stable laps a little sooner. In training commands stray: a car that nothing ever pushed drives so near the
border that it leaves the road once in some 24 laps (2022_reinvent_champ). Most drives are over after 8 s, about a lap
of re:Invent 2018: on longer tracks standing starts, where most cars fail, are rare. Of the latest weights the mean is
judged and kept: checkpoints 50 updates apart finished .72 to .91 on Belille, the mean of the latest tenth .95 as fast;
where the latest weights agree it wins nothing (2022_reinvent_champ, seed 3)."""
RACE_LONGEST_HORIZON = 128
"""To how many ticks the rollouts of the preset `race` grow with PPO, for which it was measured: long ones lap faster
after long trainings (benchmarks/racing.md, Rollouts that grow)."""
RACE_STEPS = 200_000
"""The budget of the preset `race`, where no stop is set."""

AWS_VALUES: Mapping[str, Mapping[str, Any]] = {
    "camera": {"width": 160, "height": 120},
    "rollout": {"num_worlds": 20, "episodes_per_iteration": 20},
    "network": {
        "activation": "relu", "privileged_critic": False, "separate_networks": True, "initialisation": "glorot",
    },
    "ppo": {
        "learning_rate": 3e-4, "discount": 0.99, "epochs": 5, "batch_size": 64, "entropy_weight": 0.01,
        "value_loss": "huber",
        "gae_lambda": 0.95, "clip": 0.2, "value_weight": 1.0, "max_grad_norm": None,
        "adam_epsilon": 1e-5, "adam_form": "tensorflow", "standardise": "rollout", "drop_remainder": True,
        "probability_floor": 1e-8, "exploration": "categorical", "epsilon_last": 0.05, "epsilon_steps": 10_000,
        "precision": "auto",
    },
    "sac": {
        "learning_rate": 3e-4, "discount": 0.99, "batch_size": 64, "temperature": "0.2", "target_rate": 1.0,
        "gradient_steps_per_step": 1.0, "adam_epsilon": 1e-5, "adam_form": "tensorflow", "noise_correlation": 0.0,
    },
    "evaluation": {"every": 1, "share": None, "episodes": 5},
}  # fmt: skip
"""What the preset `aws` changes. Facts: Coach `clipped_ppo_agent.py`, `ppo_head.py`; where a racer's file says nothing,
the hyperparameters are those of DeepRacer for Cloud's template, which differ from simapp's own in three: discount 0.99
(0.999), 5 epochs (10), huber (mean squared error)."""

FROM_JSON: Mapping[str, tuple[tuple[str, str], ...]] = {
    "lr": tuple((group, "learning_rate") for group in ("ppo", "sac", "dqn", "apex")),
    "discount_factor": tuple((group, "discount") for group in ("ppo", "sac", "dqn", "apex")),
    "num_epochs": (("ppo", "epochs"),),
    "batch_size": tuple((group, "batch_size") for group in ("ppo", "sac", "dqn", "apex")),
    "beta_entropy": (("ppo", "entropy_weight"),),
    "loss_type": (("ppo", "value_loss"),),
    "num_episodes_between_training": (("rollout", "episodes_per_iteration"),),
    "exploration_type": (("ppo", "exploration"),),
    "e_greedy_value": (("ppo", "epsilon_last"),),
    "epsilon_steps": (("ppo", "epsilon_steps"),),
    "sac_alpha": (("sac", "temperature"),),
    "stack_size": (("network", "stack_size"),),
}
"""Which setting each hyperparameter becomes: that of the training's own algorithm."""

ASKED_BY = {"clipped_ppo": "ppo", "sac": "sac"}
"""Which algorithm each `training_algorithm` of model_metadata.json is; the default where it is absent is PPO's."""

IN_OUR_WORDS = {"mean squared error": "mse"}
"""Values of the file that we spell otherwise."""

STOP_OF = {"term_cond_avg_score": "reward", "term_cond_max_episodes": "episodes"}
"""Hyperparameters that end a training, and the stop that each becomes."""

AWS_STOP_OF = {"term_cond_max_episodes": "iterations"}
"""The same as AWS's trainer took them, for the preset `aws`."""


def settings_for(
    preset: str,
    hyperparameters: Hyperparameters,
    overrides: Iterable[str],
    fidelity: str | None = None,
    metadata: ModelMetadata | None = None,
    algorithm: Algorithm = PPO,
) -> tuple[Settings, list[str]]:
    """Return the settings of a training and what is worth saying about them, a clause each.

    Args:
        preset: One of `PRESETS`.
        hyperparameters: What the racer's file gives.
        overrides: "group.name=value", as typed.
        fidelity: "sane" or "aws"; None: the one that goes with the preset.
        metadata: The racer's car; the preset `aws` takes its `neural_network`.
        algorithm: What learns.

    Raises:
        SettingError: An unknown preset or fidelity, or an override that is not legal.
    """
    if preset not in PRESETS:
        raise SettingError("There is no preset '{preset}'. {hint}", preset=preset, hint=nearest(preset, PRESETS))
    if fidelity is not None and fidelity not in FIDELITIES:
        raise SettingError(
            "There is no fidelity '{fidelity}'. {hint}", fidelity=fidelity, hint=nearest(fidelity, FIDELITIES)
        )
    settings, notes = preset_settings(preset, metadata, algorithm)
    settings = with_fidelity(settings, fidelity or FIDELITY_OF[preset], network_of(metadata))
    settings = _with_json(settings, hyperparameters, notes)
    if preset == "aws":
        notes += _aws_stop_notes(hyperparameters)
    overrides = tuple(overrides)
    settings = apply_overrides(settings, (one for one in overrides if one.split("=")[0].strip() == "race.type"))
    settings = with_race_groups(copy_critics_as_aws(settings) if preset == "aws" else settings)
    settings = apply_overrides(settings, overrides)
    if settings.variation.is_on:
        judged = "evaluations, too" if settings.variation.in_evaluations else "evaluations are undisturbed"
        notes.append(f"{', '.join(_variation_given(settings.variation))} in training; {judged}")
    settings = fit_exploration(settings, metadata, notes)
    return fit_worlds_to_episodes(resolve_precision(settings, notes), notes), notes


def _variation_given(variation: VariationConfig) -> list[str]:
    """Return the level and the ranges that make episodes differ, as they are set."""
    level = [] if variation.level == "off" else [f"variation.level={variation.level}"]
    given = {name: getattr(variation, name) for name in RANGES}
    return level + [f"variation.{name}={value:g}" for name, value in given.items() if value is not None]


def default_settings(algorithm: Algorithm = PPO) -> Settings:
    """Return the settings of the preset `fast`, which seeks the least wall time to skill on two cores.

    The groups of every type of race are in it; `settings_for` leaves those of others out.
    """
    world = Settings(
        race=RaceConfig(),
        boxes=BoxesConfig(),
        bots=BotsConfig(),
        against=AgainstConfig(),
        camera=CameraConfig(),
        variation=VariationConfig(),
        rollout=RolloutConfig(),
        network=NetworkConfig(),
        evaluation=EvaluationConfig(share=1.5),
        runtime=RuntimeConfig(),
    )
    for name, group in TUNED_WORLDS.get(algorithm.name, {}).items():
        world = world.with_group(name, group)
    return composed(world, algorithm, TUNED.get(algorithm.name))


def preset_settings(
    preset: str, metadata: ModelMetadata | None = None, algorithm: Algorithm = PPO
) -> tuple[Settings, list[str]]:
    """Return a preset's settings for a car, and what is worth saying about them."""
    network = metadata.neural_network if metadata is not None else SHALLOW
    settings = default_settings(algorithm)
    for group, values in {"race": RACE_VALUES, "fast": {}, "aws": AWS_VALUES}[preset].items():
        settings = with_values(settings, group, values) if group in settings else settings
    if preset == "race" and algorithm == PPO:
        settings = with_values(settings, "rollout", {"longest_horizon": RACE_LONGEST_HORIZON})
    if preset != "aws":
        return settings, [f"preset {preset}: its own small network is trained, not {network}"]
    if not algorithm.critic:
        settings = with_values(settings, "network", {"separate_networks": False})
    name = network_of(metadata)
    notes = [] if name == network else [f"{network} with the sensor 'observation' is {name}, as at AWS"]
    sensors = () if metadata is None else metadata.sensors
    return with_values(settings, "network", aws_network_values(AWS_NETWORKS[name], sensors)), notes


def aws_network_values(row: AwsNetwork, sensors: Collection[str]) -> dict[str, Any]:
    """Return the settings of a network with an embedder for every sensor on board."""
    is_stereo = STEREO in sensors
    filters, kernels, strides = zip(*(row.stereo_convolutions if is_stereo else row.convolutions), strict=True)
    return {
        "conv_filters": filters,
        "conv_kernels": kernels,
        "conv_strides": strides,
        "image_units": None,
        "vector_units": AWS_LIDAR_UNITS if any(name in LIDARS for name in sensors) else None,
        "hidden_units": row.hidden_units,
    }


def network_of(metadata: ModelMetadata | None) -> str:
    """Return the network AWS would train for a car: what it names, but for the sensor `observation` the shallow one."""
    if metadata is None or "observation" in metadata.sensors:
        return SHALLOW
    return metadata.neural_network


def with_fidelity(settings: Settings, fidelity: str, network: str = SHALLOW) -> Settings:
    """Return the settings with the world's habits, and with what they ask of the learner's memory."""
    settings = with_values(settings, "race", {"fidelity": fidelity})
    cap = AWS_NETWORKS[network].memory_steps if habits(fidelity).memory_is_finite else None
    return with_values(settings, "rollout", {"memory_steps": cap})


def stops_given(hyperparameters: Hyperparameters, preset: str = "race") -> tuple[str, ...]:
    """Return the stops that the racer's file asks for, as typed.

    The preset `aws` takes them as AWS's trainer did: it counted iterations where the name says episodes, and never
    looked at the score.

    >>> stops_given(Hyperparameters(term_cond_max_episodes=60, term_cond_avg_score=12.5))
    ('reward=12.5', 'episodes=60')
    >>> stops_given(Hyperparameters(term_cond_max_episodes=60, term_cond_avg_score=12.5), "aws")
    ('iterations=60',)
    """
    stop_of = AWS_STOP_OF if preset == "aws" else STOP_OF
    return tuple(
        f"{stop_of[name]}={getattr(hyperparameters, name)}" for name in hyperparameters.given if name in stop_of
    )


def _aws_stop_notes(given: Hyperparameters) -> list[str]:
    """Return what the preset `aws` does with conditions that end a training."""
    notes = {
        "term_cond_avg_score": "term_cond_avg_score changes nothing: AWS's trainer never looked at it; "
        "--stop reward=N ends by it",
        "term_cond_max_episodes": "term_cond_max_episodes counts iterations, as AWS's trainer did; --stop episodes=N "
        "counts episodes",
    }
    return [note for name, note in notes.items() if name in given.given]


def _with_json(settings: Settings, given: Hyperparameters, notes: list[str]) -> Settings:
    greedy = given.exploration_type == "e-greedy"
    for name in given.given:
        value = getattr(given, name)
        if name == "exploration_type" and value == "additive_noise":
            notes.append(f"{name} '{value}' changes nothing: actions are drawn from the policy's own distribution")
        elif name in ("e_greedy_value", "epsilon_steps") and not greedy:
            notes.append(f"{name} changes nothing: exploration is categorical")
        elif name in STOP_OF:
            continue
        elif (place := _place_of(name, settings)) is None:
            whose = " and ".join(group.upper() for group, _ in FROM_JSON[name])
            notes.append(f"{name} changes nothing: it belongs to {whose}")
        else:
            group, setting = place
            value = f"{value:g}" if name == "sac_alpha" else IN_OUR_WORDS.get(value, value)
            settings = with_values(settings, group, {setting: value})
            if name == "stack_size" and settings.network.stack_size > 1:
                notes.append(f"stack_size: {value} frames are seen at once; AWS ignored it and showed one")
    return settings


def _place_of(name: str, settings: Settings) -> tuple[str, str] | None:
    """Return (group, setting) of a hyperparameter in a training; None where no group of it has one."""
    return next((place for place in FROM_JSON[name] if place[0] in settings), None)


def copy_critics_as_aws(settings: Settings) -> Settings:
    """Return settings whose SAC copies its critics as often as AWS's: every so many steps as episodes an iteration."""
    every = settings.rollout.episodes_per_iteration
    return with_values(settings, "sac", {"target_interval": every}) if "sac" in settings and every else settings


def resolve_precision(settings: Settings, notes: list[str]) -> Settings:
    """Put what this processor multiplies fast in the place of the precision `auto`; bfloat16 is added to `notes`."""
    if "ppo" not in settings:
        return settings
    precision = processor_precision(settings.ppo.precision)
    if settings.ppo.precision == "auto" and precision == "bfloat16":
        notes.append("layers multiply in bfloat16; --set ppo.precision=float32 is slower and exactly AWS's")
    return with_values(settings, "ppo", {"precision": precision})


def fit_exploration(settings: Settings, metadata: ModelMetadata | None, notes: list[str]) -> Settings:
    """Let a car with continuous actions explore by its own distribution alone; a change is added to `notes`."""
    if "ppo" not in settings or metadata is None or metadata.action_space_type == "discrete":
        return settings
    if settings.ppo.exploration == "categorical":
        return settings
    notes.append(
        f"exploration {settings.ppo.exploration} chooses from a list of actions; continuous ones are drawn from the "
        "policy's own normal distribution"
    )
    return with_values(settings, "ppo", {"exploration": "categorical"})


def fit_worlds_to_episodes(settings: Settings, notes: list[str]) -> Settings:
    """Give every world the same quota of whole episodes: their number must divide the episodes of an iteration.

    A change is added to `notes`.
    """
    episodes, worlds = settings.rollout.episodes_per_iteration, settings.rollout.num_worlds
    if episodes is None or episodes % worlds == 0:
        return settings
    fitting = max(count for count in range(1, min(episodes, worlds) + 1) if episodes % count == 0)
    notes.append(f"{fitting} worlds, not {worlds}, so that each plays {episodes // fitting} of {episodes} episodes")
    return with_values(settings, "rollout", {"num_worlds": fitting})
