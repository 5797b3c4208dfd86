"""A dense layer that lays a small thing out before it multiplies a large one. Begin with `Dense`.

The gradient of a layer's weights is the product of what came back, turned about, and what went in. In bfloat16, oneDNN
reads what is turned about column by column: for the 11,264 x 512 weights of the preset aws 3.6 ms, and 2.0 where the
64 x 512 numbers are laid out in their new order first (one core of a Xeon). The sums are the same, bit by bit.
"""

from __future__ import annotations

from typing import Any

import torch
from torch import Tensor, nn

MANY_WEIGHTS = 1 << 20
"""From so many weights a gradient is worth its laying out; smaller layers lose more to the detour than they gain."""


class Dense(nn.Linear):
    """`nn.Linear`: weights (units, width)."""

    def forward(self, features: Tensor) -> Tensor:
        """Return (R, units) of features (R, width)."""
        if self.weight.dtype != torch.bfloat16 or self.weight.numel() < MANY_WEIGHTS or not torch.is_grad_enabled():
            return super().forward(features)
        product: Tensor = LaidOut.apply(features, self.weight, self.bias)
        return product


class LaidOut(torch.autograd.Function):
    """The product of a dense layer, whose way back lays out what it turns about."""

    @staticmethod
    def forward(ctx: Any, features: Tensor, weight: Tensor, bias: Tensor) -> Tensor:
        """Return (R, units)."""
        ctx.save_for_backward(features, weight)
        return torch.addmm(bias, features, weight.t())

    @staticmethod
    def backward(ctx: Any, *back: Tensor) -> tuple[Tensor | None, ...]:
        """Return the gradients of features, weight and bias; of features only where they are asked for."""
        (back_of_units,) = back
        features, weight = ctx.saved_tensors
        of_features = back_of_units @ weight if ctx.needs_input_grad[0] else None
        return of_features, back_of_units.t().contiguous() @ features, back_of_units.sum(0)
