"""The five steps in which a car is made, with every field. Begin with `steps`."""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any

from racecraft.algorithms.registry import choices
from racecraft.console.form import Field, Step
from racecraft.worlds.deepracer.console.circuits import circuits, own_circuits, track_choices
from racecraft.worlds.deepracer.files.model_metadata import as_aws_dict, racing_model_metadata
from racecraft.worlds.deepracer.files.reward_examples import racing_reward_source
from racecraft.worlds.deepracer.files.sensor_names import SENSORS
from racecraft.worlds.deepracer.tracks.library import own_names

TEMPLATES = "racecraft.worlds.deepracer.console"
RACES = (("TIME_TRIAL", "Time trial"), ("OBJECT_AVOIDANCE", "Object avoidance"), ("HEAD_TO_BOT", "Head to bot"))
CAMERAS = (*((one.name, one.label) for one in SENSORS if one.kind == "camera" and one.label), ("", "No camera"))
LIDARS = (("", "No LiDAR"), *((one.name, one.label) for one in SENSORS if one.kind == "lidar" and one.label))


def steps(values: Mapping[str, Any]) -> list[Step]:
    """Return the steps in order: track, race, algorithm, car, reward."""
    return [_track(), _race(), _algorithm(), _car(), _reward("weights" in values)]


def _track() -> Step:
    return Step(
        key="track",
        title="Track",
        lead="Where the car drives. A short, wide track is learned soonest.",
        template=f"{TEMPLATES}/track.html",
        data={"circuits": [*own_circuits(), *circuits()]},
        modules=("racecraft.worlds.deepracer.pages/find_cards.js",),
        fields=(
            Field(
                name="track", label="Track", default="reinvent_base", kind="choice",
                choices=(*((name, name) for name in own_names()), *track_choices()),
                names=(("--track", "a name of the list"), ("DR_", "DR_WORLD_NAME")),
            ),
            Field(
                name="reverse", label="Drive it the other way round", default=False, kind="switch",
                names=(("--set", "race.reverse"), ("DR_", "DR_TRAIN_REVERSE_DIRECTION")),
            ),
        ),
    )  # fmt: skip


def _race() -> Step:
    return Step(
        key="race",
        title="Race type",
        lead="What is on the road besides the car.",
        fields=(
            Field(
                name="race", label="Race type", default="TIME_TRIAL", kind="choice", choices=RACES, matters=True,
                sentence="An empty road, boxes to drive round, or slower cars to overtake.",
                names=(("--set", "race.type"), ("DR_", "DR_RACE_TYPE")),
            ),
            Field(
                name="objects", label="Boxes or bots", default=3, kind="whole", low=1, high=20,
                sentence="On the whole lap. More than one each 3 m leaves no road to pass.",
                names=(("--set", "boxes.number, bots.number"), ("DR_", "DR_OA_NUMBER_OF_OBSTACLES")),
            ),
            Field(
                name="random_places", label="New places in every episode", default=True, kind="switch",
                sentence="A car that knows the places by heart fails where they change.",
                names=(("--set", "boxes.random, bots.random"), ("DR_", "DR_OA_RANDOMIZE_OBSTACLE_LOCATIONS")),
            ),
            Field(
                name="bot_speed", label="Speed of bots", default=0.2, low=0.0, high=4.0, unit="m/s",
                sentence="Only in head to bot.", names=(("--set", "bots.speed"), ("DR_", "DR_H2B_BOT_CAR_SPEED")),
            ),
        ),
    )  # fmt: skip


def _hyper(name: str, label: str, default: float, low: float, high: float, sentence: str, **more: Any) -> Field:
    setting = more.pop("setting")
    return Field(
        name=name, label=label, default=default, low=low, high=high, sentence=sentence,
        names=(("JSON", name), ("--set", setting)), **more,
    )  # fmt: skip


def _algorithm() -> Step:
    return Step(
        key="algorithm",
        title="Algorithm",
        lead="How the car learns. The values below lap soonest on two cores; leave them for a first car.",
        fields=(
            Field(
                name="algorithm", label="Algorithm", default="ppo", kind="choice", matters=True,
                choices=tuple(choices()),
                sentence="PPO learns steadily; SAC needs fewer steps and more time for each.",
                names=(("--algorithm", "ppo"), ("JSON", "training_algorithm")),
            ),
            _hyper("lr", "Learning rate", 0.001, 1e-8, 1.0, setting="ppo.learning_rate", matters=True,
                   sentence="Size of a step. Too high: the curve falls back to nothing. Too low: it hardly rises."),
            _hyper("discount_factor", "Discount", 0.97, 0.0, 1.0, setting="ppo.discount", matters=True,
                   sentence="How much the future counts. Higher looks further ahead and learns slower."),
            _hyper("beta_entropy", "Entropy", 0.003, 0.0, 1.0, setting="ppo.entropy_weight", matters=True,
                   sentence="What exploring is worth. Too high: the car wanders. Too low: it stops improving."),
            _hyper("num_epochs", "Epochs", 4, 1, 100, setting="ppo.epochs", kind="whole", matters=True,
                   sentence="Passes over each iteration's steps."),
            _hyper("batch_size", "Batch size", 256, 1, 1_000_000, setting="ppo.batch_size", kind="whole",
                   sentence="Steps in one update. Larger is steadier and slower."),
            Field(
                name="loss_type", label="Loss", default="mean squared error", kind="choice",
                choices=(("mean squared error", "Mean squared error"), ("huber", "Huber")),
                sentence="Huber forgives single large errors.",
                names=(("JSON", "loss_type"), ("--set", "ppo.value_loss")),
            ),
        ),
    )  # fmt: skip


def _car() -> Step:
    return Step(
        key="car",
        title="Car",
        lead="What the car can be told, and what it sees with.",
        template=f"{TEMPLATES}/car.html",
        data={},
        modules=("racecraft.worlds.deepracer.pages/action_plot.js",),
        styles=("racecraft.worlds.deepracer.pages/action_plot.css",),
        fields=(
            Field(
                name="actions", label="Actions", default=default_actions(), kind="text", matters=True,
                sentence="One action a line: degrees (left positive), m/s; at most 30 travel to AWS. "
                "Or ranges: -30 to 30, 1 to 3.",
                names=(("JSON", "action_space"),),
            ),
            Field(
                name="camera", label="Camera", default="FRONT_FACING_CAMERA", kind="choice", choices=CAMERAS,
                sentence="Two cameras see how far boxes are; one learns sooner.", names=(("JSON", "sensor"),),
            ),
            Field(
                name="lidar", label="LiDAR", default="", kind="choice", choices=LIDARS,
                sentence="Sees cars behind and beside; needed for overtaking only.", names=(("JSON", "sensor"),),
            ),
        ),
    )  # fmt: skip


def default_actions() -> str:
    """Return the actions of the car that races, one a line: degrees, m/s.

    >>> default_actions().splitlines()[:2]
    ['-30, 1.5', '-30, 2.5']
    """
    rows = as_aws_dict(racing_model_metadata())["action_space"]
    return "\n".join(f"{row['steering_angle']:g}, {row['speed']:g}" for row in rows)


WEIGHTS = Field(
    name="weights",
    label="Begin with its weights",
    default=True,
    kind="switch",
    sentence="Goes on from the best checkpoint of the model that is cloned; actions and sensors must stay as they are.",
    names=(("--from", "RUN:best"), ("DR_", "DR_LOCAL_S3_PRETRAINED")),
)


def _reward(is_clone: bool) -> Step:
    return Step(
        key="reward",
        title="Reward",
        lead="What the car is paid for, 15 times a second.",
        template=f"{TEMPLATES}/reward.html",
        data={},
        modules=("chart.js", "editor.js"),
        styles=("racecraft.worlds.deepracer.pages/reward.css",),
        fields=(
            Field(
                name="reward", label="Reward function", default=racing_reward_source(), kind="code", matters=True,
                names=(("file", "reward_function.py"),),
            ),
            Field(
                name="stop_laps", label="End when it laps", default=False, kind="switch",
                sentence="After evaluations in a row in which every start brings a full lap: safe, not yet fast.",
                names=(("--stop", "laps"),),
            ),
            Field(
                name="minutes", label="End after", default=5.0, low=0.1, high=1440.0, unit="min",
                sentence="Of training, whatever it has reached; it learns in smaller steps towards the end.",
                names=(("--stop", "minutes=10"),),
            ),
            *([WEIGHTS] if is_clone else []),
        ),
    )  # fmt: skip


def defaults() -> dict[str, Any]:
    """Return the value of every field that is left untouched."""
    return {field.name: field.default for step in steps({}) for field in step.fields}


def as_json(values: Any) -> str:
    """Return a value as the text of a JSON file."""
    return json.dumps(values, indent=2) + "\n"
