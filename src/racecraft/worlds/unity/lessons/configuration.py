"""Checks of lesson U4: they read a pupil's trainer configuration as the command does, and ask the learner itself."""

from __future__ import annotations

import tempfile
from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING

from racecraft.contract.errors import InputFileError
from racecraft.lessons.checking import Answer, Verdict, compared, passed, tried

if TYPE_CHECKING:
    from racecraft.algorithms.ppo import PpoLearner
    from racecraft.worlds.unity.files.trainer_config import TrainerConfig

BEHAVIOR = "Basic"
AGENTS = 1
ARTICLE: Mapping[str, float] = {
    "gamma": 0.995, "learning_rate": 1e-4, "num_epoch": 20, "batch_size": 100, "buffer_size": 500, "max_steps": 10_000,
}  # fmt: skip
"""The launcher's numbers (source 002), by ML-Agents' names."""
SILENT = "where the file does not say"
CLIP = 0.2


def no_idle_keys(answer: Answer) -> Verdict:
    """The pupil's configuration holds no key without effect, and everything else that it began with."""
    field = answer.exercise.fields[0]
    try:
        found, first = _read(answer.code(field.name)), _read(field.code)
    except InputFileError as error:
        return _unreadable(error)
    silent = [note for note in found.notes if SILENT in note or "not said" in note]
    if idle := [note for note in found.notes if note not in silent]:
        return tried("idle", note=idle[0])
    if silent:
        return tried("silent", note=silent[0])
    now, before = _followed(found), _followed(first)
    if lost := [key for key in before if now.get(key) != before[key]]:
        return tried("changed", key=lost[0], right=before[lost[0]])
    return passed()


def article_settings(answer: Answer) -> Verdict:
    """The pupil's configuration says what the article's launcher says."""
    try:
        found = _read(answer.code("code")).behavior(BEHAVIOR)
    except InputFileError as error:
        return _unreadable(error)
    if (found.batch_size, found.buffer_size) == (ARTICLE["buffer_size"], ARTICLE["batch_size"]):
        return tried("exchanged")
    for key, right in ARTICLE.items():
        if getattr(found, key) != right:
            return tried("differs", key=key, given=getattr(found, key), right=right)
    return passed()


def _unreadable(error: InputFileError) -> Verdict:
    place = error.key or (f"line {error.line}" if error.line else error.path.name)
    return tried("unreadable", place=place, found=str(error.found), expected=str(error.expected))


def _read(text: str) -> TrainerConfig:
    from racecraft.worlds.unity.files.trainer_yaml import read_trainer_yaml

    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "Basic.yaml"
        path.write_text(text, encoding="utf-8")
        return read_trainer_yaml(path)


def _followed(config: TrainerConfig) -> dict[str, str]:
    """Return what a training takes of a configuration, by the names of our settings."""
    section = config.behavior(BEHAVIOR)
    overrides = dict(one.split("=", 1) for one in section.overrides(AGENTS))
    engine = {f"engine_settings.{name}": f"{value:g}" for name, value in config.engine.items()}
    return {**overrides, "max_steps": str(section.max_steps), **engine}


def clip_half_way(answer: Answer) -> Verdict:
    """What PPO's clip is half-way of its linear schedule."""
    learner = basic_learner()
    learner.anneal(0.5)
    given, right = answer.number("epsilon"), learner.now.clip
    return compared(given, right, 0.005, {"to_zero": CLIP / 2, "not_fallen": CLIP}, epsilon=given)


@cache
def basic_learner() -> PpoLearner:
    """Return a PPO learner of Basic that has learned nothing, with one layer and a clip that falls."""
    import numpy as np

    from racecraft.algorithms.networks import NetworkConfig
    from racecraft.algorithms.ppo import PpoConfig, PpoLearner
    from racecraft.contract.world import ArraySpec, DiscreteActions, WorldSpec

    world = WorldSpec(BEHAVIOR, 1, 1, {BEHAVIOR: ArraySpec((20,), np.float32)}, DiscreteActions(3))
    config = PpoConfig(clip=CLIP, clip_schedule="linear")
    return PpoLearner(world, NetworkConfig(hidden_units=(8,), activation="tanh"), config, seed=1)
