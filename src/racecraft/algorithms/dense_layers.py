"""Bodies that are one vector and dense layers, which shorter ways lead through. Begin with `dense_layers`."""

from __future__ import annotations

from typing import NamedTuple

from torch import nn

from racecraft.algorithms.networks import Encoder, Vector


class DenseLayers(NamedTuple):
    """What a vector passes, in order; behind each layer stands the same non-linearity."""

    name: str
    """Of the observation that is the vector."""
    vector: Vector
    linear: list[nn.Linear]
    is_tanh: bool
    """Whether that is tanh; else it is ReLU."""


def dense_layers(body: nn.Module | None) -> DenseLayers | None:
    """Return the layers of a body that is one vector and dense layers; None: it is something else."""
    if not isinstance(body, Encoder) or len(body.names) != 1:
        return None
    embedder = body.embedders[0]
    before = list(embedder) if isinstance(embedder, nn.Sequential) else [embedder]
    vector, *layers = [*before, *body.trunk]
    linear, bends = [one for one in layers[::2] if isinstance(one, nn.Linear)], {type(one) for one in layers[1::2]}
    if not isinstance(vector, Vector) or len(linear) != len(layers[::2]) or bends not in ({nn.Tanh}, {nn.ReLU}):
        return None
    return DenseLayers(body.names[0], vector, linear, bends == {nn.Tanh})
