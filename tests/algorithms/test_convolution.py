"""Convolving a few frames by one product, beside PyTorch's own convolution."""

import pytest
import torch
from torch import nn

from racecraft.algorithms.convolution import FEW_NUMBERS, Convolution

SHAPES = [(1, 16, 6, 3, 30, 40), (16, 32, 4, 2, 9, 12), (3, 8, 5, 2, 21, 18), (4, 6, 3, 1, 7, 5)]
"""Channels, filters, kernel, stride, height, width; the default car's two among them."""


@pytest.mark.parametrize(("channels", "filters", "kernel", "stride", "height", "width"), SHAPES)
def test_few_frames_are_convolved_as_many_are(channels, filters, kernel, stride, height, width):
    torch.manual_seed(1)
    layer = Convolution(channels, filters, kernel, stride)
    maps = torch.rand(7, height, width, channels)[2:].permute(0, 3, 1, 2)  # not at the beginning of its memory
    with torch.no_grad():
        few = layer(maps)
    many = nn.Conv2d.forward(layer, maps)
    torch.testing.assert_close(few, many.detach(), atol=1e-5, rtol=1e-5)
    assert many.requires_grad
    assert not few.requires_grad


def test_maps_in_any_order_of_memory_are_convolved_alike():
    layer, maps = Convolution(16, 32, 4, 2), torch.rand(5, 16, 9, 12)
    with torch.no_grad():
        torch.testing.assert_close(layer(maps), layer(maps.contiguous(memory_format=torch.channels_last)))


def test_many_frames_go_the_common_way(monkeypatch):
    seen = []
    monkeypatch.setattr(nn.Conv2d, "forward", lambda layer, maps: seen.append(len(maps)))
    layer = Convolution(1, 16, 6, 3)
    few = FEW_NUMBERS // (9 * 12 * 36)
    with torch.no_grad():
        assert layer(torch.rand(few, 1, 30, 40)).shape == (few, 16, 9, 12)
        layer(torch.rand(few + 1, 1, 30, 40))
    layer(torch.rand(2, 1, 30, 40))
    assert seen == [few + 1, 2]
