"""What choices are worth: two streams by hand, and the policy that takes the best that is allowed."""

import numpy as np
import torch

from racecraft.algorithms.networks import Architecture
from racecraft.algorithms.q_network import QNetwork, QPolicy
from racecraft.contract.world import ArraySpec, DiscreteActions

SEEN = {"x": ArraySpec((3,), np.float32), "secret": ArraySpec((2,), np.float32, privileged=True)}
ROW = Architecture(trunk_units=(6, 4))
X = torch.tensor([[1.0, -2.0, 0.5], [0.0, 3.0, 1.0]])


def network(dueling, row=ROW, seed=1):
    return QNetwork(SEEN, DiscreteActions(3), row, dueling, torch.Generator().manual_seed(seed))


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
