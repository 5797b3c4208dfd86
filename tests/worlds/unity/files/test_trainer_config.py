"""What ML-Agents' trainer configuration says, as settings of our own."""

import pytest

from racecraft.worlds.unity.files.trainer_config import BehaviorConfig, TrainerConfig


@pytest.mark.parametrize(
    ("given", "words", "told"),
    [
        ({"buffer_size": 10}, {}, ("rollout.horizon=10",)),  # one agent
        ({"buffer_size": 10}, {"num_agents": 4}, ("rollout.horizon=3",)),  # no fewer steps than the file asks for
        ({"buffer_size": 1}, {"num_agents": 4}, ("rollout.horizon=1",)),
        ({"memory_size": 4}, {}, ("network.memory=lstm", "network.memory_units=2", "ppo.sequence_length=64")),
        ({"normalize": False}, {}, ()),
        (
            {"vis_encode_type": "nature_cnn"},  # the convolutions of Mnih et al. 2015
            {},
            ("network.conv_filters=32,64,64", "network.conv_kernels=8,4,3", "network.conv_strides=4,2,1"),
        ),
        (
            {"vis_encode_type": "simple"},
            {},
            ("network.conv_filters=16,32", "network.conv_kernels=8,4", "network.conv_strides=4,2"),
        ),
        ({"cloning": {"steps": 5}}, {}, ("imitation.steps=5",)),
        (
            {"cloning": {"steps": 5}, "learning_rate": 0.1},
            {},
            ("ppo.learning_rate=0.1", "imitation.steps=5", "imitation.learning_rate=0.1"),
        ),
    ],
)
def test_what_ppo_is_told(given, words, told):
    assert BehaviorConfig("A", **given).overrides(**words) == told


@pytest.mark.parametrize(
    ("given", "told"),
    [
        ({"buffer_init_steps": 0}, ("replay.learning_starts=1",)),
        ({"buffer_init_steps": 3, "batch_size": 64}, ("sac.batch_size=64", "replay.learning_starts=64")),
        ({"buffer_init_steps": 99, "batch_size": 64}, ("sac.batch_size=64", "replay.learning_starts=99")),
        ({"steps_per_update": 8}, ("sac.gradient_steps_per_step=0.125",)),
        ({"cloning": {"steps": 5}, "signals": {"rnd": {"strength": 1}}, "memory_size": 4, "normalize": True}, ()),
    ],
)
def test_what_sac_is_told_and_what_it_has_no_setting_for(given, told):
    assert BehaviorConfig("A", trainer="sac", **given).overrides(algorithm="sac") == told


def test_where_nothing_is_said_somebody_learns():
    assert TrainerConfig({}).inference is False
    assert TrainerConfig({}).behavior("A?team=1") == BehaviorConfig("A")
