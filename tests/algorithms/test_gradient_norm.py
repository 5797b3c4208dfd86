"""Gradients cut to a norm: PyTorch's own bits."""

import pytest
import torch
from torch import nn

from racecraft.algorithms.gradient_norm import cut_to_norm


@pytest.mark.parametrize("most", [0.5, 1e3, 0.0])
def test_gradients_are_cut_as_pytorch_cuts_them(most):
    torch.manual_seed(1)
    ours = [nn.Parameter(torch.randn(shape)) for shape in ((64, 4), (64,), (64, 64), (2, 64), ())]
    theirs = [nn.Parameter(one.detach().clone()) for one in ours]
    for one, other in zip(ours[:-1], theirs[:-1], strict=True):  # the last carries none
        one.grad = torch.randn_like(one)
        other.grad = one.grad.clone()
    assert torch.equal(cut_to_norm(ours, most), nn.utils.clip_grad_norm_(theirs, most))
    for one, other in zip(ours, theirs, strict=True):
        assert one.grad is other.grad is None or torch.equal(one.grad, other.grad)
    assert cut_to_norm(ours[-1:], most) == 0.0


def test_of_next_to_nothing_a_millionth_is_added_before_it_is_divided_by():
    weight = nn.Parameter(torch.zeros(1))
    weight.grad = torch.tensor([2e-6])
    assert cut_to_norm([weight], 1e-6).item() == pytest.approx(2e-6)
    assert weight.grad.item() == pytest.approx(2e-6 / 3)
