"""`ray.rllib.models.torch.misc`: layers that scripts' networks are made of."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import torch
from torch import Tensor, nn

ACTIVATIONS: dict[str, type[nn.Module]] = {"tanh": nn.Tanh, "relu": nn.ReLU, "swish": nn.SiLU, "silu": nn.SiLU}


def normc_initializer(std: float = 1.0) -> Callable[[Tensor], None]:
    """Return what fills a weight so that the numbers that feed each unit have this length (Euclidean)."""

    def fill(weight: Tensor) -> None:
        with torch.no_grad():
            weight.normal_()
            weight.mul_(std / weight.norm(dim=1, keepdim=True))

    return fill


class SlimFC(nn.Module):
    """A dense layer, its first weights, and what follows it."""

    def __init__(
        self, in_size: int, out_size: int, initializer: Any = None, activation_fn: Any = None, use_bias: bool = True,
        bias_init: float = 0.0,
    ) -> None:  # fmt: skip
        super().__init__()
        layer = nn.Linear(in_size, out_size, bias=use_bias)
        (initializer or nn.init.xavier_uniform_)(layer.weight)
        if use_bias:
            nn.init.constant_(layer.bias, bias_init)
        kind = ACTIVATIONS.get(activation_fn) if isinstance(activation_fn, str) else activation_fn
        self._model = nn.Sequential(layer, *([] if kind is None else [kind()]))

    def forward(self, x: Tensor) -> Tensor:
        """Return what the layer gives."""
        return self._model(x)


__all__ = ["SlimFC", "normc_initializer"]
