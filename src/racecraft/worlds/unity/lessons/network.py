"""A small network as numbers and a recipe: what is exported, in Python. modules/network.js has it too."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import tanh
from typing import Any

Layers = Sequence[Mapping[str, Any]]
"""Each with "weights" (a row for each sum) and "bias" (a number for each sum)."""


def scores(observation: Sequence[float], layers: Layers, *, adds_bias: bool = True, bends: bool = True) -> list[float]:
    """Return the sums of the last layer; those of the others are bent by tanh.

    Args:
        observation: What the first layer reads.
        layers: From the first to the last.
        adds_bias: Whether each sum has its bias.
        bends: Whether tanh stands between layers.
    """
    values = list(observation)
    for number, layer in enumerate(layers):
        sums = [
            adds_bias * bias + sum(weight * value for weight, value in zip(row, values, strict=True))
            for row, bias in zip(layer["weights"], layer["bias"], strict=True)
        ]
        values = [tanh(one) for one in sums] if bends and number < len(layers) - 1 else sums
    return values


def decision(observation: Sequence[float], layers: Layers, **recipe: bool) -> int:
    """Return which score is the highest."""
    found = scores(observation, layers, **recipe)
    return found.index(max(found))
