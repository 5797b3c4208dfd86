"""RMSProp of the deep Q-network's paper: its steps, where it goes on from, and that it tells copies."""

import pytest
import torch

from racecraft.algorithms.rmsprop import RmsProp


def test_its_steps_are_the_papers_by_hand():
    weight = torch.nn.Parameter(torch.tensor([1.0]))
    optimiser, mean, square, expected = RmsProp([weight], 0.1), 0.0, 0.0, 1.0
    for gradient in (2.0, -1.0, 0.5):
        weight.grad = torch.tensor([gradient])
        optimiser.step()
        mean, square = 0.95 * mean + 0.05 * gradient, 0.95 * square + 0.05 * gradient**2
        expected -= 0.1 * gradient / (square - mean**2 + 0.01) ** 0.5
        assert weight.item() == pytest.approx(expected, rel=1e-5)


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
