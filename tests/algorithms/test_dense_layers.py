"""Which bodies are one vector and dense layers, and which are something else."""

import numpy as np
import pytest
import torch
from torch import nn

from racecraft.algorithms.dense_layers import dense_layers
from racecraft.algorithms.networks import Architecture, Encoder
from racecraft.contract.world import ArraySpec

VECTOR = {"speed": ArraySpec((3,), np.float32)}


def body(observations=VECTOR, **row):
    return Encoder(observations, Architecture(**row), torch.Generator().manual_seed(1))


@pytest.mark.parametrize("activation", ["tanh", "relu"])
@pytest.mark.parametrize(("own", "trunk"), [((), (4,)), ((), (4, 5)), ((6,), (4, 5)), ((6, 7), ()), ((6, 7), (4,))])
def test_a_vectors_layers_are_told_in_the_order_that_it_passes_them(own, trunk, activation):
    encoder = body(vector_units=own, trunk_units=trunk, activation=activation)
    found = dense_layers(encoder)
    assert [one.out_features for one in found.linear] == [*own, *trunk]
    assert (found.name, found.is_tanh) == ("speed", activation == "tanh")
    seen = torch.randn(2, 3, generator=torch.Generator().manual_seed(2))
    passed = found.vector(seen)
    for layer in found.linear:
        passed = torch.tanh(layer(passed)) if found.is_tanh else torch.relu(layer(passed))
    torch.testing.assert_close(passed, encoder({"speed": seen}))


def test_two_vectors_pictures_and_what_is_no_encoder_are_something_else():
    two = {**VECTOR, "place": ArraySpec((2,), np.float32)}
    assert dense_layers(body(two, trunk_units=(4,))) is None
    picture = {"eye": ArraySpec((12, 16), np.uint8)}
    assert dense_layers(body(picture, convolutions=((2, 6, 3),), trunk_units=(4,))) is None
    assert dense_layers(nn.Linear(3, 4)) is None
    assert dense_layers(None) is None
