"""Mean and deviation of what was seen so far, kept beside a network's weights. Begin with `RunningStatistics`."""

from __future__ import annotations

import torch
from torch import Tensor, nn


class RunningStatistics(nn.Module):
    """Mean and deviation of all vectors (W,) shown so far, much as ML-Agents keeps them (its `Normalizer`).

    A distance of 1 from the mean counts as seen before all others, so that nothing is ever divided by 0. ML-Agents also
    counts a vector of zeros, which makes what is far from zero look spread out for long. They are buffers: saved and
    loaded with the weights, and no optimiser touches them.
    """

    count: Tensor
    mean: Tensor
    squares: Tensor
    """Sum of squared distances from the mean."""

    def __init__(self, width: int) -> None:
        super().__init__()
        self.register_buffer("count", torch.zeros((), dtype=torch.float64))
        self.register_buffer("mean", torch.zeros(width, dtype=torch.float64))
        self.register_buffer("squares", torch.ones(width, dtype=torch.float64))

    @torch.no_grad()
    def update(self, vectors: Tensor) -> None:
        """Take in R vectors (R, W)."""
        rows = vectors.double()
        if not len(rows):
            return
        self.count += len(rows)
        before = rows - self.mean
        self.mean += before.sum(dim=0) / self.count
        self.squares += (before * (rows - self.mean)).sum(dim=0)

    def mean_and_deviation(self) -> tuple[Tensor, Tensor]:
        """Return mean and deviation, float32 (W,)."""
        return self.mean.float(), (self.squares / (self.count + 1.0)).sqrt().float()
