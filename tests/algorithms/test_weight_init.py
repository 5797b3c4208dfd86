"""First weights of what a foreign model's file does not hold: their sizes, and how widely they are drawn."""

import math

import numpy as np
import pytest

from racecraft.algorithms.weight_init import fresh_critics, fresh_spread, init_critic
from racecraft.contract.world import ContinuousActions, DiscreteActions

KERNELS, DENSE = (8, 3, 5, 4), (32, 40)
POLICY = {
    "policy_body.0.weight": np.ones(KERNELS, np.float32), "policy_body.0.bias": np.ones(8, np.float32),
    "policy_body.2.weight": np.ones(DENSE, np.float32), "policy_body.2.bias": np.ones(32, np.float32),
    "policy_head.weight": np.ones((5, 32), np.float32), "policy_head.bias": np.ones(5, np.float32),
}  # fmt: skip


def assert_glorots(found, into, out):
    """Hold weights to Glorot's uniform numbers: within sqrt(6 / (in + out)) of 0, and evenly so."""
    limit = math.sqrt(6 / (into + out))
    assert found.dtype == np.float32
    assert 0.97 * limit < abs(found).max() <= limit * (1 + 1e-6)
    assert found.mean() == pytest.approx(0.0, abs=0.1 * limit)
    assert found.std() == pytest.approx(limit / math.sqrt(3), rel=0.1)


def test_a_critic_is_the_twin_of_its_policy_with_a_value_for_a_head():
    critic = init_critic(POLICY)
    assert {name: part.shape for name, part in critic.items()} == {
        "critic_body.0.weight": KERNELS, "critic_body.0.bias": (8,),
        "critic_body.2.weight": DENSE, "critic_body.2.bias": (32,),
        "value_head.weight": (1, 32), "value_head.bias": (1,),
    }  # fmt: skip
    assert_glorots(critic["critic_body.0.weight"], 3 * 5 * 4, 8 * 5 * 4)  # a window of 5 x 4 pixels, 3 channels, 8 maps
    assert_glorots(critic["critic_body.2.weight"], 40, 32)
    assert not any(part.any() for name, part in critic.items() if name.endswith("bias"))
    assert np.linalg.norm(critic["value_head.weight"]) == pytest.approx(1.0)
    assert critic["value_head.weight"].dtype == np.float32
    assert len(np.unique(critic["value_head.weight"])) == 32
    again = init_critic(POLICY)
    assert all(np.array_equal(part, again[name]) for name, part in critic.items()), "the same at every import"


def test_two_critics_lie_behind_each_other_and_see_by_twins_of_the_actors_eyes():
    actor = {"eyes.0.weight": np.ones((16, 1, 6, 6), np.float32), "eyes.0.bias": np.ones(16, np.float32)}
    critics = fresh_critics({**actor, "actor.0.weight": np.ones((64, 30), np.float32)}, 32, (40, 24))
    assert {name: part.shape for name, part in critics.items()} == {
        "critic_eyes.0.weight": (16, 1, 6, 6), "critic_eyes.0.bias": (16,),
        "critics.weights.0": (2, 32, 40), "critics.biases.0": (2, 1, 40),
        "critics.weights.1": (2, 40, 24), "critics.biases.1": (2, 1, 24),
        "critics.weights.2": (2, 24, 1), "critics.biases.2": (2, 1, 1),
    }  # fmt: skip
    assert_glorots(critics["critic_eyes.0.weight"], 36, 16 * 36)
    assert_glorots(critics["critics.weights.0"], 32, 40)
    assert_glorots(critics["critics.weights.1"], 40, 24)
    assert abs(critics["critics.weights.2"]).max() <= math.sqrt(6 / 25) < 1.1 * abs(critics["critics.weights.2"]).max()
    assert not np.array_equal(*critics["critics.weights.0"]), "each with numbers of its own"
    assert not any(part.any() for name, part in critics.items() if "bias" in name)


def test_a_policy_over_numbers_explores_by_a_deviation_of_one_and_over_choices_by_none():
    ((name, spread),) = fresh_spread(ContinuousActions((-1.0, 0.0, 0.0), (1.0, 1.0, 2.0))).items()
    assert (name, spread.dtype, spread.tolist()) == ("log_std", np.float32, [0.0, 0.0, 0.0])
    assert fresh_spread(DiscreteActions(3)) == {}
