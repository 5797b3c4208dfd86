"""Soft actor-critic on the common road: a racer's files choose it, a broken-off run goes on to the same bits."""

import json

import numpy as np
import pytest

from racecraft.algorithms.registry import find_algorithm
from racecraft.formats.checkpoint import Checkpoints
from racecraft.formats.run_folder import RunFolder
from racecraft.training.callbacks import NullCallback
from racecraft.training.worlds import resume, train
from racecraft.worlds.deepracer.files.hyperparameters import Hyperparameters
from racecraft.worlds.deepracer.training.plan import RaceRequest, plan_car
from racecraft.worlds.deepracer.training.presets import settings_for
from racecraft.worlds.gymnasium.training.trainer import GymRequest

CONTINUOUS = {
    "action_space": {"steering_angle": {"low": -30, "high": 30}, "speed": {"low": 1, "high": 2}},
    "sensor": ["FRONT_FACING_CAMERA"],
    "action_space_type": "continuous",
    "version": "5",
}
SAC = find_algorithm("sac")


def folder(place, hyperparameters=None, **changes):
    place.mkdir()
    (place / "model_metadata.json").write_text(json.dumps({**CONTINUOUS, **changes}))
    (place / "hyperparameters.json").write_text(json.dumps(hyperparameters or {}))
    return place


def test_the_racers_metadata_choose_the_algorithm_where_nobody_names_one(tmp_path):
    sac = folder(tmp_path / "sac", training_algorithm="sac")
    assert plan_car(RaceRequest(sac)).algorithm.name == "sac"
    assert plan_car(RaceRequest(sac, algorithm="ppo")).algorithm.name == "ppo"
    assert plan_car(RaceRequest(folder(tmp_path / "ppo"))).algorithm.name == "ppo"


def test_the_racers_hyperparameters_are_heard_in_their_own_words(tmp_path):
    told = {"lr": 0.0005, "batch_size": 64, "discount_factor": 0.95, "sac_alpha": 0.25, "num_epochs": 5}
    plan = plan_car(RaceRequest(folder(tmp_path / "car", told, training_algorithm="sac")))
    sac = plan.settings.sac
    assert (sac.learning_rate, sac.batch_size, sac.discount) == (0.0005, 64, 0.95)
    assert sac.fixed_temperature == 0.25
    assert "num_epochs changes nothing: it belongs to PPO" in plan.notes
    plan = plan_car(RaceRequest(tmp_path / "car", algorithm="ppo"))
    assert plan.settings.ppo.learning_rate == 0.0005
    assert "sac_alpha changes nothing: it belongs to SAC" in plan.notes


@pytest.mark.parametrize(("episodes", "every"), [(None, 20), (4, 4)])
def test_the_preset_aws_copies_its_critics_every_so_many_steps_as_an_iteration_has_episodes(episodes, every):
    given = Hyperparameters() if episodes is None else Hyperparameters(num_episodes_between_training=episodes)
    settings, _ = settings_for("aws", given, (), algorithm=SAC)
    assert (settings.sac.target_rate, settings.sac.target_interval) == (1.0, every)
    assert (settings.sac.fixed_temperature, settings.sac.batch_size, settings.sac.learning_rate) == (0.2, 64, 3e-4)
    settings, _ = settings_for("aws", given, ("sac.target_interval=7",), algorithm=SAC)
    assert settings.sac.target_interval == 7


TINY = (
    "rollout.num_worlds=4", "rollout.horizon=20", "sac.batch_size=16", "replay.learning_starts=80",
    "evaluation.every=2", "evaluation.episodes=2", "network.hidden_units=8", "sac.noise_correlation=0.5",
)  # fmt: skip


def pendulum(run, steps):
    request = GymRequest("Pendulum-v1", algorithm="sac", stops=(f"steps={steps}",), run=run, overrides=TINY)
    return train(request, NullCallback(), lambda line: None).run


def test_a_training_that_was_broken_off_goes_on_to_the_same_bits(tmp_path):
    whole, broken = pendulum(tmp_path / "whole", 320), pendulum(tmp_path / "broken", 160)
    resume(broken.path, ("steps=320",), NullCallback(), lambda line: None)
    one, other = (Checkpoints(RunFolder.open(run.path).checkpoints).load_policy("last")[0] for run in (whole, broken))
    assert one.keys() == other.keys()
    for name, weights in one.items():
        np.testing.assert_array_equal(other[name], weights, name)
