"""A trainer configuration opens a world."""

import pytest

from racecraft.worlds.unity.env.side_channels import Gaussian, Uniform
from racecraft.worlds.unity.env.trainer_options import words_of
from racecraft.worlds.unity.env.world import ENGINE_FOR_TRAINING, UnityWorld
from racecraft.worlds.unity.files.trainer_yaml import TrainerConfig, read_trainer_yaml

pytest.importorskip("yaml", reason="PyYAML is not installed")


def test_what_the_file_says_of_players_opens_a_world(tmp_path):
    path = tmp_path / "basic.yaml"
    path.write_text(
        "env_settings: {env_path: 'builtin:Basic', env_args: [--agents, 3], num_envs: 2, seed: 4, timeout_wait: 20,\n"
        "  max_lifetime_restarts: -1, restarts_rate_limit_n: 3, restarts_rate_limit_period_s: 5}\n"
        "engine_settings: {time_scale: 5, no_graphics: true}\n"
        "environment_parameters:\n"
        "  mass: 2\n"
        "  wind: {sampler_type: uniform, sampler_parameters: {min_value: 0, max_value: 1.5}}\n"
        "  size: {sampler_type: gaussian, sampler_parameters: {mean: 1, st_dev: 0.1}}\n"
    )
    config = read_trainer_yaml(path)
    words = words_of(config)
    assert words["engine"]["time_scale"] == 5
    assert words["engine"]["quality_level"] == 5  # where the file is silent, as mlagents-learn
    assert words["parameters"] == {"mass": 2.0, "wind": Uniform(0.0, 1.5), "size": Gaussian(1.0, 0.1)}
    assert words["graphics"] is False
    limits = (words["max_lifetime_restarts"], words["restarts_rate_limit_n"], words["restarts_rate_limit_period_s"])
    assert limits == (-1, 3, 5.0)
    world = UnityWorld(config.env_path, **words)
    assert world.spec.num_worlds == 6
    world.close()


def test_a_file_for_playing_brings_the_engine_for_it(tmp_path):
    path = tmp_path / "play.yaml"
    path.write_text("checkpoint_settings: {inference: true}\nengine_settings: {width: 640, height: 360}\n")
    words = words_of(read_trainer_yaml(path))
    assert words["inference"] is True
    assert (words["engine"]["time_scale"], words["engine"]["width"]) == (1.0, 640)


def test_what_the_file_leaves_open_is_left_open():
    assert words_of(TrainerConfig({})) == {"engine": ENGINE_FOR_TRAINING}
    assert words_of(TrainerConfig({}, no_graphics=False, num_envs=1)) == {
        "engine": ENGINE_FOR_TRAINING, "graphics": True, "num_players": 1,
    }  # fmt: skip
