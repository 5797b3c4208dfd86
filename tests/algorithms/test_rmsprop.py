"""RMSProp of the deep Q-network's paper: where it goes on from, and that what it tells is its own no more."""

import pytest
import torch

from racecraft.algorithms.rmsprop import RmsProp


def stepped(gradients, rate=0.1, state=None):
    """Return two weights of different shapes after some steps, each along a gradient of one number, and the stepper."""
    weights = [torch.nn.Parameter(torch.ones(2)), torch.nn.Parameter(torch.ones(1, 3))]
    optimiser = RmsProp(iter(weights), rate)
    if state is not None:
        optimiser.load_state_dict(state)
    for gradient in gradients:
        for weight, share in zip(weights, (1.0, -2.0), strict=True):
            weight.grad = torch.full_like(weight, share * gradient)
        optimiser.step()
    return weights, optimiser


def test_the_first_step_by_hand():
    """Means 0.05 g and 0.05 g^2; below the root a variance of 0.05 g^2 - (0.05 g)^2 + 0.01; along the gradient."""
    (one, other), _ = stepped([1.0])
    assert one.tolist() == pytest.approx([1.0 - 0.1 / (0.05 - 0.0025 + 0.01) ** 0.5] * 2, rel=1e-5)
    assert other.tolist() == [pytest.approx([1.0 + 0.2 / (0.2 - 0.01 + 0.01) ** 0.5] * 3, rel=1e-5)]


def test_what_is_remembered_by_hand():
    _, optimiser = stepped([1.0])
    state = optimiser.state_dict()
    assert state.keys() == {"learning_rate", "0.mean", "0.square", "1.mean", "1.square"}
    assert state["learning_rate"].item() == 0.1
    assert state["0.mean"].tolist() == pytest.approx([0.05] * 2)
    assert state["0.square"].tolist() == pytest.approx([0.05] * 2)
    assert state["1.mean"].tolist() == [pytest.approx([-0.1] * 3)]
    assert state["1.square"].tolist() == [pytest.approx([0.2] * 3)]


def test_it_goes_on_where_it_stood():
    _, begun = stepped([1.0, -3.0])
    kept = begun.state_dict()
    _, again = stepped([], rate=7.0, state=kept)
    assert again.learning_rate == 0.1
    stepped([5.0], state=kept)  # copies: whoever goes on from them leaves them as they were
    for name, part in kept.items():
        assert torch.equal(part, begun.state_dict()[name])
        assert torch.equal(part, again.state_dict()[name])
    begun.step()
    assert not torch.equal(kept["0.mean"], begun.state_dict()["0.mean"])
