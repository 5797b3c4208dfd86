"""The networks of soft actor-critic: first weights, two critics by hand, and who reads what through which layers."""

import numpy as np
import pytest
import torch

from racecraft.algorithms.networks import NetworkConfig, architecture_of
from racecraft.algorithms.twin_critics import SoftActorCritic
from racecraft.contract.world import ArraySpec, ContinuousActions

STATE = ArraySpec((5,), np.float32)
FRAME = ArraySpec((30, 40), np.uint8, 0, 255)
SECRET = ArraySpec((6,), np.float32, privileged=True)
STEERING = ContinuousActions((-0.5, 1.0), (0.5, 4.0))


def network_of(observations=None, **network):
    row = architecture_of(NetworkConfig(**{"hidden_units": (16,), **network}))
    return SoftActorCritic(observations or {"state": STATE}, STEERING, row, torch.Generator().manual_seed(3))


def gain(weight):
    """Return by what orthogonal columns (or rows, where there are fewer of these) are multiplied."""
    square = weight @ weight.T if weight.shape[0] <= weight.shape[1] else weight.T @ weight
    torch.testing.assert_close(square, torch.eye(len(square)) * square[0, 0], atol=1e-5, rtol=0.0)
    return float(square[0, 0].sqrt())


@pytest.mark.parametrize("activation", ["relu", "tanh"])
def test_networks_begin_with_the_gains_of_published_ppo_and_two_critics_unlike_each_other(activation):
    network = network_of(hidden_units=(16, 8), activation=activation)
    for critic in range(2):
        gains = [gain(weight.detach()[critic]) for weight in network.critics.weights]
        assert gains == pytest.approx([2**0.5, 2**0.5, 1.0])
    assert not torch.equal(network.critics.weights[0][0], network.critics.weights[0][1])
    assert not any(bias.any() for bias in network.critics.biases)
    layers = [one.weight.detach() for one in network.actor if hasattr(one, "weight")]
    assert [tuple(one.shape) for one in layers] == [(16, 5), (8, 16), (4, 8)]
    assert [gain(one) for one in layers] == pytest.approx([2**0.5, 2**0.5, 0.01])


@pytest.mark.parametrize(("activation", "bent"), [("relu", torch.relu), ("tanh", torch.tanh)])
def test_each_critic_is_a_network_of_its_own_over_what_is_seen_and_done(activation, bent):
    critics = network_of(hidden_units=(6, 4), activation=activation).critics
    with torch.no_grad():
        for bias in critics.biases:
            torch.nn.init.normal_(bias, generator=torch.Generator().manual_seed(3))
        chance = torch.Generator().manual_seed(4)
        seen, done = torch.randn(3, 5, generator=chance), torch.randn(3, 2, generator=chance)
        for frozen in (False, True):
            told = critics(seen, done, frozen)
            assert told.shape == (2, 3)
            for number in range(2):
                flow = torch.cat([seen, done], dim=1)
                for layer in range(3):
                    flow = flow @ critics.weights[layer][number] + critics.biases[layer][number]
                    flow = bent(flow) if layer < 2 else flow
                torch.testing.assert_close(told[number], flow[:, 0], rtol=1e-4, atol=1e-5)


def test_deviations_keep_within_e_to_the_minus_twenty_and_e_squared():
    network = network_of()
    with torch.no_grad():
        network.actor[-1].bias.copy_(torch.tensor([0.5, -0.5, 100.0, -100.0]))
        network.actor[-1].weight.zero_()
        mean, log_std = network.policy({"state": torch.ones(1, 5)})
    assert mean.tolist() == [[0.5, -0.5]]
    assert log_std.tolist() == [[2.0, -20.0]]


@pytest.mark.parametrize(
    ("seen", "network", "shapes"),
    [
        ({"state": STATE}, {}, [(2, 7, 16), (2, 16, 1)]),
        ({"state": STATE, "secret": SECRET}, {}, [(2, 13, 16), (2, 16, 1)]),
        ({"state": STATE, "secret": SECRET}, {"privileged_critic": False}, [(2, 7, 16), (2, 16, 1)]),
        ({"camera": FRAME, "secret": SECRET}, {}, [(2, 8, 128), (2, 128, 128), (2, 128, 1)]),
        ({"state": STATE}, {"hidden_units": ()}, [(2, 7, 1)]),
    ],
)
def test_critics_read_the_true_state_through_layers_that_fit_it(seen, network, shapes):
    assert [tuple(weight.shape) for weight in network_of(seen, **network).critics.weights] == shapes


@pytest.mark.parametrize("separate", [True, False])
def test_critics_have_eyes_of_their_own_only_where_networks_are_separate(separate):
    network = network_of({"camera": FRAME}, separate_networks=separate)
    eyes = sum(part.numel() for part in network.eyes.parameters())
    assert eyes > 0
    assert (network.critic_eyes is not None) == separate
    critics = sum(part.numel() for part in network.critics.parameters())
    assert sum(part.numel() for part in network.critic_parameters()) == eyes + critics
    actor = sum(part.numel() for part in network.actor.parameters())
    assert sum(part.numel() for part in network.actor_parameters()) == actor + separate * eyes
