"""What AWS's tools want to know of a training before its first tick: the car, how it learns, the simulator's orders.

Begin with `aws_setup`. Numbers are those the training really uses, whatever file or preset they came from.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

from racecraft.settings.composition import Settings
from racecraft.worlds.deepracer.env.objects import read_positions
from racecraft.worlds.deepracer.env.settings import BotsConfig, BoxesConfig, objects_of
from racecraft.worlds.deepracer.files.hyperparameters import Hyperparameters
from racecraft.worlds.deepracer.files.model_metadata import ModelMetadata
from racecraft.worlds.deepracer.files.run_env_variables import BY_NAME

EPISODES_PER_ITERATION = 20
"""AWS's own number of episodes between trainings, where nobody gives another."""

TEMPLATE = Hyperparameters(
    e_greedy_value=0.05,
    epsilon_steps=10000,
    exploration_type="categorical",
    stack_size=1,
    term_cond_avg_score=350.0,
    term_cond_max_episodes=1000,
    sac_alpha=0.2,
)
"""Values that change nothing here and that readers of old look for."""

FROM_ENV = {
    "BODY_SHELL_TYPE": "DR_CAR_BODY_SHELL_TYPE",
    "CAR_COLOR": "DR_CAR_COLOR",
    "CAR_NAME": "DR_CAR_NAME",
    "DISPLAY_NAME": "DR_DISPLAY_NAME",
    "RACER_NAME": "DR_RACER_NAME",
    "CAMERA_MAIN_ENABLE": "DR_CAMERA_MAIN_ENABLE",
    "CAMERA_SUB_ENABLE": "DR_CAMERA_SUB_ENABLE",
    "ENABLE_EXTRA_KVS_OVERLAY": "DR_ENABLE_EXTRA_KVS_OVERLAY",
}
"""Which variable of run.env each parameter of the simulator comes from: names and colours, which change no training."""


@dataclass(frozen=True)
class AwsSetup:
    """What is said of a training once."""

    world_name: str
    """The track, by AWS's name."""
    metadata: ModelMetadata
    hyperparameters: Hyperparameters
    """With every value that readers look for."""
    params: Mapping[str, str]
    """What the simulator is told."""
    best_model_metric: str = "progress"

    @property
    def episodes_per_iteration(self) -> int:
        """Episodes of one of AWS's iterations: how many stand in one trace."""
        return self.hyperparameters.num_episodes_between_training or EPISODES_PER_ITERATION


def aws_setup(
    world_name: str,
    settings: Settings,
    metadata: ModelMetadata,
    given: Hyperparameters,
    model_name: str = "racecraft",
    env: Mapping[str, str] | None = None,
    alternates: bool = False,
) -> AwsSetup:
    """Return what is said of a training once.

    Args:
        world_name: The track.
        settings: As they are used.
        metadata: The car.
        given: The racer's own hyperparameters.
        model_name: Stands for the folder of the model: the run folder's name.
        env: Variables of the racer's run.env, if there is one.
        alternates: Whether the track is driven in both directions.
    """
    return AwsSetup(
        world_name,
        metadata,
        used_hyperparameters(settings, given),
        training_params(world_name, settings, model_name, env or {}) | {"ALTERNATE_DRIVING_DIRECTION": str(alternates)},
        best_model_metric(settings),
    )


def best_model_metric(settings: Settings) -> str:
    """Return by which of AWS's metrics the best checkpoint is chosen: a pace is a time, too."""
    by = settings.evaluation.best_by
    return "laptime" if by == "pace" else by


def used_hyperparameters(settings: Settings, given: Hyperparameters) -> Hyperparameters:
    """Return the hyperparameters as they are used, the rest from the racer's file or the template."""
    learner = next((group for name in settings if hasattr(group := getattr(settings, name), "learning_rate")), None)
    other = {name: getattr(given, name) for name in TEMPLATE.given if getattr(given, name) is not None}

    def used(ours: str, theirs: str) -> Any:
        fallback = getattr(given, theirs)
        return getattr(learner, ours, getattr(TEMPLATE, theirs) if fallback is None else fallback)

    as_used = {
        "batch_size": used("batch_size", "batch_size"),
        "beta_entropy": used("entropy_weight", "beta_entropy"),
        "discount_factor": used("discount", "discount_factor"),
        "exploration_type": used("exploration", "exploration_type"),
        "e_greedy_value": used("epsilon_last", "e_greedy_value"),
        "epsilon_steps": used("epsilon_steps", "epsilon_steps"),
        "loss_type": "huber" if getattr(learner, "value_loss", "huber") == "huber" else "mean squared error",
        "lr": used("learning_rate", "lr"),
        "num_episodes_between_training": settings.rollout.episodes_per_iteration
        or given.num_episodes_between_training
        or EPISODES_PER_ITERATION,
        "num_epochs": used("epochs", "num_epochs"),
    }
    return replace(TEMPLATE, **(other | as_used), unknown=given.unknown)


def training_params(world_name: str, settings: Settings, model_name: str, env: Mapping[str, str]) -> dict[str, str]:
    """Return what DeepRacer for Cloud would tell its simulator, in its own words."""
    car_name = env.get("DR_CAR_NAME", BY_NAME["DR_CAR_NAME"].default)
    words = {
        key: env.get(name, BY_NAME[name].default).replace("$DR_CAR_NAME", car_name) for key, name in FROM_ENV.items()
    }
    race = settings.race
    return {
        "JOB_TYPE": "TRAINING",
        "AWS_REGION": "us-east-1",
        "KINESIS_VIDEO_STREAM_NAME": "",
        "METRICS_S3_BUCKET": "bucket",
        "METRICS_S3_OBJECT_KEY": f"{model_name}/metrics/TrainingMetrics.json",
        "MODEL_METADATA_FILE_S3_KEY": f"{model_name}/model/model_metadata.json",
        "REWARD_FILE_S3_KEY": f"{model_name}/reward_function.py",
        "ROBOMAKER_SIMULATION_JOB_ACCOUNT_ID": "Dummy",
        "NUM_WORKERS": "1",
        "SAGEMAKER_SHARED_S3_BUCKET": "bucket",
        "SAGEMAKER_SHARED_S3_PREFIX": model_name,
        "SIMTRACE_S3_BUCKET": "bucket",
        "SIMTRACE_S3_PREFIX": model_name,
        "TRAINING_JOB_ARN": "arn:Dummy",
        **words,
        "ENABLE_DOMAIN_RANDOMIZATION": str(varies_as_aws(settings)),
        "WORLD_NAME": world_name,
        "START_POSITION_OFFSET": str(race.start_offset),
        "REVERSE_DIR": str(race.reverse),
        "CHANGE_START_POSITION": str(race.change_start),
        "ROUND_ROBIN_ADVANCE_DIST": f"{race.start_advance:g}",
        "MIN_EVAL_TRIALS": str(settings.evaluation.episodes),
        "BEST_MODEL_METRIC": best_model_metric(settings),
        "RACE_TYPE": race.type,
        **objects_params(objects_of(settings)),
    }


def varies_as_aws(settings: Settings) -> bool:
    """Tell whether lamps differ from episode to episode, whoever asked for it: the files tell what ran."""
    return "variation" in settings and bool(settings.variation.amounts["lamps"])


def objects_params(boxes: BoxesConfig | BotsConfig | None) -> dict[str, str]:
    """Return what the simulator is told of boxes or bots."""
    if isinstance(boxes, BoxesConfig):
        places = {"OBJECT_POSITIONS": boxes.positions} if boxes.positions else {}
        return {
            "NUMBER_OF_OBSTACLES": str(len(read_positions(boxes.positions)) or boxes.number),
            "MIN_DISTANCE_BETWEEN_OBSTACLES": str(boxes.min_distance),
            "RANDOMIZE_OBSTACLE_LOCATIONS": str(boxes.random),
            "IS_OBSTACLE_BOT_CAR": str(boxes.as_cars),
            "OBSTACLE_TYPE": boxes.type,
            **places,
        }
    if isinstance(boxes, BotsConfig):
        return {
            "NUMBER_OF_BOT_CARS": str(boxes.number),
            "MIN_DISTANCE_BETWEEN_BOT_CARS": str(boxes.min_distance),
            "RANDOMIZE_BOT_CAR_LOCATIONS": str(boxes.random),
            "BOT_CAR_SPEED": str(boxes.speed),
            "IS_LANE_CHANGE": str(boxes.lane_change),
            "LOWER_LANE_CHANGE_TIME": str(boxes.lane_change_after_low),
            "UPPER_LANE_CHANGE_TIME": str(boxes.lane_change_after_high),
            "LANE_CHANGE_DISTANCE": str(boxes.lane_change_distance),
            "PENALTY_SECONDS": str(boxes.penalty),
        }
    return {}
