"""The simulation log: the text that log readers search for its few telling lines.

Begin with `log_head`, the settings of the training, and `trace_lines`, one line a tick. Readers need the line of the
world before that of the sensors.

Source: facts: simapp `s3_metrics.py` (formats), deepracer-utils and log-guru (what they look for).
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any

import numpy as np

from racecraft.contract.world import Array
from racecraft.worlds.deepracer.files.hyperparameters import Hyperparameters
from racecraft.worlds.deepracer.files.model_metadata import ModelMetadata, as_aws_dict
from racecraft.worlds.deepracer.files.sim_trace import (
    CONTINUOUS_ACTION,
    NAMES,
    action_texts,
    flag_texts,
    number_texts,
)

PREFIX = "SIM_TRACE_LOG:"
_TWO_DIGITS = ("steer", "throttle", "track_len", "pause_duration")
_NOTHING = {"pause_duration": "0.00", "wall_clock": "0.0000"}


def log_head(world_name: str, metadata: ModelMetadata, hyperparameters: Hyperparameters) -> list[str]:
    """Return the lines with which a log begins: hyperparameters, actions, world, sensors."""
    car = as_aws_dict(metadata)
    values = {name: getattr(hyperparameters, name) for name in hyperparameters.given}
    return [
        "Using the following hyper-parameters",
        *json.dumps(values, indent=2).split("\n"),
        f"Action space from file: {car['action_space']}",
        f" * /WORLD_NAME: {world_name}",
        f"Sensor list {car['sensor']}, network {car['neural_network']}, simapp_version {car['version']}, "
        f"training_algorithm {car['training_algorithm']}, action_space_type {car['action_space_type']}",
    ]


def trace_lines(trace: Mapping[str, Array]) -> list[str]:
    """Return the line of each tick of a trace, in the units of AWS; what a trace lacks is written as 0."""
    import polars as pl

    ticks = len(trace["episode"])
    if not ticks:
        return []
    frame = pl.DataFrame([pl.Series(name, _printed(name, trace, ticks)) for name in NAMES])
    text = frame.write_csv(include_header=False, float_precision=4, quote_style="never")
    return [PREFIX + line for line in text.splitlines()]


def episode_line(worker: int, episode: int, reward: float, steps: int, iteration: int) -> str:
    """Return the line that ends an episode.

    >>> episode_line(0, 1, 31.2, 57, 0)
    'Training> Name=main_level/agent, Worker=0, Episode=1, Total reward=31.2, Steps=57, Training iteration=0'
    """
    return (
        f"Training> Name=main_level/agent, Worker={worker}, Episode={episode}, "
        f"Total reward={round(reward, 2)}, Steps={steps}, Training iteration={iteration}"
    )


def update_line(surrogate_loss: float, kl_divergence: float, entropy: float, epoch: int, learning_rate: float) -> str:
    """Return the line of one pass over the data of an iteration."""
    return (
        f"Policy training> Surrogate loss={surrogate_loss}, KL divergence={kl_divergence}, Entropy={entropy}, "
        f"training epoch={epoch}, learning_rate={learning_rate}"
    )


def checkpoint_line(iteration: int, steps: int) -> str:
    """Return the line of a checkpoint.

    >>> checkpoint_line(0, 0)
    "Checkpoint> Saving in path=['./checkpoint_sagemaker/agent/0_Step-0.ckpt']"
    """
    return f"Checkpoint> Saving in path=['./checkpoint_sagemaker/agent/{iteration}_Step-{steps}.ckpt']"


def _printed(name: str, trace: Mapping[str, Array], ticks: int) -> Any:
    """Return a column as it stands in the log; floats are still to be printed with four digits."""
    if name not in trace:
        return ["in_progress" if name == "episode_status" else _NOTHING.get(name, "0")] * ticks
    values = np.asarray(trace[name])
    if name == "action":
        return action_texts(trace) if (values == CONTINUOUS_ACTION).any() else values
    if name == "steps":
        return values.astype(np.int64)
    if name == "tstamp":
        return number_texts(values.astype(np.float64))
    if name in _TWO_DIGITS:
        numbers = values.tolist()
        few = {number: f"{number:.2f}" for number in set(numbers)}
        return [few[number] for number in numbers]
    if values.dtype == bool:
        return flag_texts(values)
    return values.tolist() if values.dtype.kind == "U" else values
