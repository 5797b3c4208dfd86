"""What a policy decides by, open to gradients: what it is fed and what it makes of it, by hand."""

import math
from types import SimpleNamespace

import numpy as np
import pytest
import torch

from racecraft.algorithms.distributions import distribution_for
from racecraft.algorithms.explainable import as_floats, names_read, scores_of
from racecraft.algorithms.networks import Architecture, CustomEncoder, Encoder
from racecraft.contract.world import (
    ArraySpec,
    ContinuousActions,
    DiscreteActions,
    HybridActions,
    MultiDiscreteActions,
)

SEEN = {"b": ArraySpec((2,), np.uint8), "a": ArraySpec((1,), np.float64)}
SHOWN = {"b": np.array([[0, 255]], np.uint8), "a": np.array([[3.5]]), "more": np.zeros((1, 1))}
NUMBERS = ContinuousActions((-1.0, -4.0), (1.0, 4.0))


def own_eyes():
    eyes = CustomEncoder.__new__(CustomEncoder)
    torch.nn.Module.__init__(eyes)
    eyes.names = ("a", "b")
    return eyes


def test_bytes_are_fed_as_shares_of_their_largest_and_to_a_users_own_network_as_they_are():
    ours = Encoder(SEEN, Architecture(trunk_units=(2,)), torch.Generator())
    for eyes, largest in ((ours, 1.0), (own_eyes(), 255.0)):
        fed = as_floats(eyes, SHOWN, torch.device("cpu"))
        assert list(fed) == ["a", "b"]
        assert fed["b"].tolist() == [[0.0, pytest.approx(largest)]]
        assert fed["a"].tolist() == [[3.5]]
        assert {part.dtype for part in fed.values()} == {torch.float32}
        assert names_read(eyes) == ("a", "b")


def test_scores_of_numbers_and_choices_are_told_apart():
    both = HybridActions(NUMBERS, MultiDiscreteActions((2, 3)))
    params = torch.arange(14.0).view(2, 7)
    scores = scores_of(distribution_for(both), params, torch.tensor([0.0, math.log(2.0)]))
    assert scores.numbers.tolist() == [[0, 1], [7, 8]]
    np.testing.assert_allclose(scores.deviations, [[1, 2], [1, 2]], rtol=1e-6)
    assert [part.tolist() for part in scores.branches] == [[[2, 3], [9, 10]], [[4, 5, 6], [11, 12, 13]]]
    assert not scores.are_q_values


def test_choices_alone_have_no_numbers_and_squashed_ones_are_bent():
    scores = scores_of(distribution_for(DiscreteActions(3)), torch.zeros(2, 3), None)
    assert (scores.numbers.shape, scores.deviations.shape, len(scores.branches)) == ((2, 0), (2, 0), 1)
    bent = scores_of(distribution_for(NUMBERS, 0.0, "squashed"), torch.tensor([[0.0, 0.5]]), torch.zeros(2))
    assert bent.numbers.tolist() == [[0.0, pytest.approx(math.tanh(0.5))]]
    assert bent.deviations.tolist() == [[1.0, 1.0]]
    plain = scores_of(SimpleNamespace(spec=NUMBERS), torch.tensor([[0.0, 0.5]]), None)
    assert (plain.numbers.tolist(), plain.deviations.tolist()) == ([[0.0, 0.5]], [[0.0, 0.0]])
