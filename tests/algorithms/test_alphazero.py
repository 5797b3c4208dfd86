"""What a search teaches a policy, by hand."""

import math

import pytest
import torch

from racecraft.algorithms.alphazero import SEARCHED, alphazero_loss


def test_moves_that_are_surely_fatal_weigh_nothing_in_the_loss():
    """Of three moves one is forbidden, however much the network likes it; the other two are equally likely."""
    batch = {
        SEARCHED: torch.tensor([[0.25, 0.75, 0.0]]),
        "targets": torch.tensor([1.0]),
        "action_mask": torch.tensor([[True, True, False]]),
    }

    def network(seen):
        return torch.tensor([[0.0, 0.0, 9.0]]), torch.tensor([0.5])

    loss, (policy, value, entropy, agreement) = alphazero_loss(network, batch, value_weight=2.0)
    assert float(policy) == pytest.approx(math.log(2))
    assert (float(value), float(agreement)) == (0.25, 0.0)
    assert float(entropy) == pytest.approx(-(0.25 * math.log(0.25) + 0.75 * math.log(0.75)))
    assert float(loss) == pytest.approx(math.log(2) + 0.5)
