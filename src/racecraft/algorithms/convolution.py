"""A convolution that answers a few frames quickly. Begin with `Convolution`.

oneDNN, by which PyTorch convolves on a processor, prepares every call as if thousands of frames were to come: for the
five cars of an evaluation that takes longer than the arithmetic, and pushes what the world's tick needs out of the
cache. For few frames and without gradients the patches that a kernel sees are laid side by side instead and multiplied
by the kernels in one product. The sums are the same but for their order.
"""

from __future__ import annotations

import torch
from torch import Tensor, nn

FEW_NUMBERS = 1 << 17
"""So many numbers in all patches are few: 32 frames of the default car (measured on two cores of a Xeon: five frames
take 50 us for 120, 32 frames as long either way, more of them longer)."""


class Convolution(nn.Conv2d):
    """`nn.Conv2d` without padding, dilation or groups; weights of its kind: (filters, channels, kernel, kernel)."""

    def __init__(self, channels: int, filters: int, kernel: int, stride: int, device: str | None = None) -> None:
        super().__init__(channels, filters, kernel, stride, device=device)

    def forward(self, maps: Tensor) -> Tensor:
        """Return maps (R, filters, H', W') of maps (R, channels, H, W), channels last in memory as they were."""
        if torch.is_grad_enabled() or maps.device.type != "cpu":
            return super().forward(maps)
        (kernel, _), (stride, _) = self.kernel_size, self.stride
        rows, channels, height, width = maps.shape
        high, wide = (height - kernel) // stride + 1, (width - kernel) // stride + 1
        if rows * high * wide * kernel * kernel * channels > FEW_NUMBERS:
            return super().forward(maps)
        pixels = maps.permute(0, 2, 3, 1).contiguous()
        line = width * channels
        patches = pixels.as_strided(
            (rows, high, wide, kernel, kernel * channels),
            (height * line, stride * line, stride * channels, line, 1),
            pixels.storage_offset(),
        ).reshape(rows * high * wide, kernel * kernel * channels)
        kernels = self.weight.permute(0, 2, 3, 1).reshape(self.out_channels, -1)
        assert self.bias is not None
        return torch.addmm(self.bias, patches, kernels.t()).view(rows, high, wide, -1).permute(0, 3, 1, 2)
