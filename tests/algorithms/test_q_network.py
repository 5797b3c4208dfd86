"""What choices are worth: two streams by hand, masks, first weights, and the policy that takes the best."""

import numpy as np
import pytest
import torch

from racecraft.algorithms.networks import Architecture
from racecraft.algorithms.policy_spec import PolicySpec, architecture_values
from racecraft.algorithms.q_network import QNetwork, QPolicy, allowed_only, load_q_policy
from racecraft.contract.world import ArraySpec, DiscreteActions

SEEN = {"x": ArraySpec((3,), np.float32), "secret": ArraySpec((2,), np.float32, privileged=True)}
ROW = Architecture(trunk_units=(6, 4))
X = torch.tensor([[1.0, -2.0, 0.5], [0.0, 3.0, 1.0]])


def network(dueling, row=ROW, seed=1):
    return QNetwork(SEEN, DiscreteActions(3), row, dueling, torch.Generator().manual_seed(seed))


def gain(layer):
    """Return by what a layer's orthogonal rows (or columns, where it has more rows) are multiplied."""
    weight = layer.weight.detach()
    square = weight @ weight.T if weight.shape[0] <= weight.shape[1] else weight.T @ weight
    torch.testing.assert_close(square, torch.eye(len(square)) * square[0, 0], atol=1e-5, rtol=0.0)
    return float(square[0, 0].sqrt())


def test_of_two_streams_what_each_choice_adds_is_told_beside_its_mean():
    """Wang et al., 2016, equation 9: V + A - mean of A."""
    two = network(dueling=True)
    torch.nn.init.normal_(two.choices[-1].weight, generator=torch.Generator().manual_seed(2))
    with torch.no_grad():
        features = two.body({"x": X})
        adds, moment = two.choices(features), two.moment(features)
        worth = two({"x": X})
    expected = moment.numpy() + adds.numpy() - adds.numpy().mean(axis=1, keepdims=True)
    np.testing.assert_allclose(worth, expected, rtol=1e-5)
    np.testing.assert_allclose(worth.mean(dim=1), moment[:, 0], rtol=1e-4, atol=1e-6)


def test_two_streams_take_the_place_of_the_last_layer():
    one, two = network(dueling=False), network(dueling=True)
    shapes = [[tuple(part.shape) for part in net.parameters() if part.dim() == 2] for net in (one, two)]
    assert shapes == [[(6, 3), (4, 6), (3, 4)], [(6, 3), (4, 6), (3, 4), (4, 6), (1, 4)]]
    assert one.moment is None
    bare = network(dueling=True, row=Architecture(trunk_units=()))
    assert [tuple(part.shape) for part in bare.parameters() if part.dim() == 2] == [(3, 3), (1, 3)]


@pytest.mark.parametrize("activation", ["relu", "tanh"])
@pytest.mark.parametrize("dueling", [True, False])
def test_at_first_everything_is_worth_almost_nothing(dueling, activation):
    begun = network(dueling, Architecture(trunk_units=(6, 4), activation=activation))
    streams = [begun.choices, begun.moment] if dueling else [begun.choices]
    for stream in streams:
        hidden = [one for one in stream[:-1] if hasattr(one, "weight")]
        assert len(hidden) == int(dueling)
        assert [gain(one) for one in hidden] == pytest.approx([2**0.5] * len(hidden))
        assert gain(stream[-1]) == pytest.approx(0.01)
        bends = torch.nn.Tanh if activation == "tanh" else torch.nn.ReLU
        assert [type(one) for one in stream[:-1] if not hasattr(one, "weight")] == [bends] * len(hidden)


def test_a_forbidden_choice_is_worth_less_than_any_other():
    worth = torch.tensor([[-1e6, 5.0, 9.0]])
    assert allowed_only(worth, torch.tensor([[True, False, False]])).argmax(dim=1).tolist() == [0]
    assert allowed_only(worth, None) is worth


def test_the_policy_takes_the_best_that_is_allowed_every_time():
    policy = QPolicy(network(dueling=False))
    with torch.no_grad():
        policy.network.choices[-1].weight.zero_()
        policy.network.choices[-1].bias.copy_(torch.tensor([1.0, 3.0, 2.0]))
    seen, mask = {"x": X.numpy()}, np.array([[True, True, True], [True, False, True]])
    assert policy.act(seen).tolist() == [1, 1]
    assert policy.act(seen, mask).tolist() == [1, 2]
    np.testing.assert_allclose(policy.values(seen), [[1.0, 3.0, 2.0]] * 2)
    likely = policy.probabilities(seen, mask)
    assert likely.tolist() == [[0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]
    assert likely.dtype == np.float32
    scores = policy.scores(policy.inputs(seen))
    assert scores.are_q_values
    assert scores.branches[0].tolist() == [[1.0, 3.0, 2.0]] * 2
    assert (scores.numbers.shape, scores.deviations.shape) == ((2, 0), (2, 0))
    assert policy.encoder.names == ("x",)  # nothing privileged


@pytest.mark.parametrize("dueling", [True, False])
def test_it_is_rebuilt_from_its_spec_and_weights(dueling):
    made = network(dueling, seed=7)
    told = architecture_values(ROW) | ({"dueling": True} if dueling else {})
    spec = PolicySpec("dqn", SEEN, DiscreteActions(3), told)
    policy = load_q_policy(spec, made.state_dict())
    np.testing.assert_array_equal(policy.values({"x": X.numpy()}), QPolicy(made).values({"x": X.numpy()}))
