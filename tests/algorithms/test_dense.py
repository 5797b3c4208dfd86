"""A dense layer of many weights: PyTorch's own numbers, bit by bit, there and back."""

import pytest
import torch
from torch import nn

from racecraft.algorithms import dense as dense_page
from racecraft.algorithms.dense import Dense


@pytest.mark.parametrize("asks_for_features", [True, False])
@pytest.mark.parametrize(("width", "units", "rows"), [(70, 48, 16), (300, 64, 5)])
def test_the_way_back_gives_what_pytorchs_layer_gives(monkeypatch, width, units, rows, asks_for_features):
    monkeypatch.setattr(dense_page, "MANY_WEIGHTS", 1)
    torch.manual_seed(1)
    ours, theirs = Dense(width, units).bfloat16(), nn.Linear(width, units).bfloat16()
    theirs.load_state_dict(ours.state_dict())
    features, pull = torch.randn(rows, width).bfloat16(), torch.randn(rows, units).bfloat16()
    found = []
    for layer in (ours, theirs):
        seen = features.clone().requires_grad_(asks_for_features)
        given = layer(seen)
        given.backward(pull)
        found.append([given, layer.weight.grad, layer.bias.grad, *([seen.grad] if asks_for_features else [])])
    assert found[0][0].grad_fn.name() == "LaidOutBackward"
    for mine, wanted in zip(*found, strict=True):
        assert torch.equal(mine, wanted)
        assert mine.stride() == wanted.stride()


def test_few_weights_float32_and_looks_take_pytorchs_way(monkeypatch):
    whole, seen = Dense(70, 48), torch.randn(4, 70)
    assert "LaidOut" not in whole(seen).grad_fn.name()
    assert "LaidOut" not in whole.bfloat16()(seen.bfloat16()).grad_fn.name(), "few"
    monkeypatch.setattr(dense_page, "MANY_WEIGHTS", 1)
    with torch.no_grad():
        assert whole(seen.bfloat16()).grad_fn is None
    assert "LaidOut" not in whole.float()(seen).grad_fn.name()


@pytest.mark.parametrize(("width", "units", "laid_out"), [(1024, 1024, True), (1025, 1023, False)])
def test_a_layer_is_worth_its_laying_out_from_1024_times_1024_weights(width, units, laid_out):
    """1025 x 1023 is one weight less; a picture of it is asked for nothing but how its numbers came about."""
    layer = Dense(width, units, device="meta", dtype=torch.bfloat16)
    found = layer(torch.empty((1, width), device="meta", dtype=torch.bfloat16))
    assert ("LaidOut" in found.grad_fn.name()) is laid_out
