"""With what a network begins: the gains that published PPO measures, and the size of a critic that is told more."""

import numpy as np
import pytest
import torch

from racecraft.algorithms.architecture import Architecture
from racecraft.algorithms.networks import ActorCritic
from racecraft.contract.world import ArraySpec, ContinuousActions

SEEN = {"frame": ArraySpec((20, 20), np.uint8), "place": ArraySpec((6,), np.float32)}


def network(seen=SEEN, **architecture):
    return ActorCritic(
        seen, ContinuousActions((-1.0, 0.0), (1.0, 1.0)), Architecture(**architecture), torch.Generator().manual_seed(2)
    )


def gain(layer):
    """Return by what a layer's orthogonal rows (or columns, where it has more rows) are multiplied."""
    weight = layer.weight.detach().reshape(len(layer.weight), -1)
    square = weight @ weight.T if weight.shape[0] <= weight.shape[1] else weight.T @ weight
    torch.testing.assert_close(square, torch.eye(len(square)) * square[0, 0], atol=1e-5, rtol=0.0)
    return float(square[0, 0].sqrt())


@pytest.mark.parametrize("activation", ["relu", "tanh"])
def test_layers_begin_with_the_gains_of_published_ppo(activation):
    """Root of two for what is hidden, 0.01 for the policy, 1 for the value (Huang and others, 2022, detail 2)."""
    begun = network(
        convolutions=((4, 4, 2), (5, 3, 1)), image_units=(9,), vector_units=(7,), trunk_units=(12, 8),
        activation=activation,
    )  # fmt: skip
    hidden = [one for one in begun.policy_body.modules() if hasattr(one, "weight")]
    assert len(hidden) == 6
    assert [gain(one) for one in hidden] == pytest.approx([2**0.5] * 6)
    assert (gain(begun.policy_head), gain(begun.value_head)) == pytest.approx((0.01, 1.0))
    assert not any(one.bias.any() for one in [*hidden, begun.policy_head, begun.value_head])
    assert begun.log_std.tolist() == [0.0, 0.0]


def test_a_critic_that_is_told_more_has_two_layers_of_128():
    told = ArraySpec((3,), np.float32, privileged=True)
    body = network({**SEEN, "told": told}, trunk_units=(16,), privileged_critic=True).critic_body
    assert [one.weight.shape for one in body.modules() if hasattr(one, "weight")] == [(128, 9), (128, 128)]
