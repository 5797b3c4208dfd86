"""A convolution that oneDNN, by which PyTorch convolves on a processor, does quickly. Begin with `Convolution`.

In bfloat16, oneDNN is made for kernels that read many channels at every pixel: over frames of one, the gradient of the
first layer's kernels took as long as all else of the layers. Where the stride s divides the kernel, frames are laid out
in tiles of s x s pixels, each as one place of s * s times the channels; the kernel then steps from place to place, and
the sums are the same but for their order.

A kernel as large as what it looks at, with which RLlib's networks end, is a dense layer: as one product it takes a
fifth of the time, its gradients in (64 maps of 3 x 3 x 32 into 256: 0.27 ms for 1.25 there).
"""

from __future__ import annotations

import torch
from torch import Tensor, nn
from torch.nn import functional

FEW_CHANNELS = 8
"""Up to so many, tiles are worth their laying out in bfloat16 (measured on two cores of a Xeon: 2.2 ms for 8.9 of 64
frames of 160 x 120 with one channel; of 32 channels nothing is gained)."""


class Convolution(nn.Conv2d):
    """`nn.Conv2d` without padding, dilation or groups: weights (filters, channels, kernel, kernel)."""

    def __init__(self, channels: int, filters: int, kernel: int, stride: int, device: str | None = None) -> None:
        super().__init__(channels, filters, kernel, stride, device=device)

    def forward(self, maps: Tensor) -> Tensor:
        """Return maps (R, filters, H', W') of maps (R, channels, H, W), channels last in memory as they were."""
        if tuple(maps.shape[1:]) == (self.in_channels, *self.kernel_size):
            return self.over_all(maps)
        return self.over_tiles(maps) if self.reads_tiles else super().forward(maps)

    def over_all(self, maps: Tensor) -> Tensor:
        """Return maps (R, filters, 1, 1) of maps (R, channels, H, W) that are as large as the kernel."""
        pixels, kernels = (part.permute(0, 2, 3, 1).flatten(1) for part in (maps, self.weight))
        return functional.linear(pixels, kernels, self.bias)[:, :, None, None]

    @property
    def reads_tiles(self) -> bool:
        """Whether maps are laid out in tiles for it; where they are in tiles already, it takes them as they are."""
        (kernel, _), (stride, _) = self.kernel_size, self.stride
        is_half = self.weight.dtype == torch.bfloat16
        return is_half and self.in_channels <= FEW_CHANNELS and stride > 1 and kernel % stride == 0

    def over_tiles(self, maps: Tensor) -> Tensor:
        """Return maps (R, filters, H', W') of maps (R, channels, H, W), or of those in tiles, which have more."""
        (kernel, _), (stride, _) = self.kernel_size, self.stride
        if maps.shape[1] == self.in_channels:
            maps = in_tiles(maps.permute(0, 2, 3, 1), kernel, stride).permute(0, 3, 1, 2)
        steps = kernel // stride
        kernels = self.weight.permute(0, 2, 3, 1).reshape(-1, steps, stride, steps, stride, self.in_channels)
        laid = kernels.permute(0, 1, 3, 2, 4, 5).reshape(-1, steps, steps, maps.shape[1]).permute(0, 3, 1, 2)
        return functional.conv2d(maps, laid, self.bias)


def in_tiles(pixels: Tensor, kernel: int, stride: int) -> Tensor:
    """Return maps (R, H, W, channels) in tiles of stride x stride pixels: (R, H', W', stride * stride * channels).

    What no kernel of this size and stride comes to is left out at the right and the bottom.
    """
    rows, height, width, channels = pixels.shape
    high, wide = ((size - kernel) // stride + kernel // stride for size in (height, width))
    used = pixels[:, : high * stride, : wide * stride].reshape(rows, high, stride, wide, stride, channels)
    return used.permute(0, 1, 3, 2, 4, 5).flatten(3)
