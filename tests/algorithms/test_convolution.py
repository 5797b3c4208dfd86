"""Convolving in tiles and over a whole map, beside PyTorch's own convolution."""

import numpy as np
import pytest
import torch
from torch import nn

from racecraft.algorithms.convolution import Convolution, in_tiles
from racecraft.algorithms.half_precision import Bfloat16Copy
from racecraft.algorithms.networks import ActorCritic, Architecture
from racecraft.contract.world import ArraySpec, DiscreteActions, WorldSpec


def test_a_kernel_as_large_as_its_map_learns_as_a_convolution_does():
    torch.manual_seed(1)
    layer, maps = Convolution(4, 6, 3, 1), torch.rand(5, 4, 3, 3, requires_grad=True)
    found, common = layer(maps), nn.Conv2d.forward(layer, maps)
    torch.testing.assert_close(found, common)
    slope, wanted = torch.rand_like(common), [layer.weight, layer.bias, maps]
    for mine, theirs in zip(
        torch.autograd.grad(found, wanted, slope), torch.autograd.grad(common, wanted, slope), strict=True
    ):
        torch.testing.assert_close(mine, theirs)
    # A map of that many pixels and another shape is none of it.
    assert layer(torch.rand(5, 4, 3, 4)).shape == (5, 6, 1, 2)


TILED = [(1, 32, 8, 4, 120, 160), (1, 16, 6, 3, 30, 40), (2, 8, 4, 2, 11, 13)]


@pytest.mark.parametrize(("channels", "filters", "kernel", "stride", "height", "width"), TILED)
def test_maps_in_tiles_are_convolved_alike_and_learned_from_alike(channels, filters, kernel, stride, height, width):
    torch.manual_seed(1)
    layer = Convolution(channels, filters, kernel, stride).double()
    maps = torch.rand(3, height, width, channels, dtype=torch.float64).permute(0, 3, 1, 2).requires_grad_()
    straight, tiled = nn.Conv2d.forward(layer, maps), layer.over_tiles(maps)
    torch.testing.assert_close(tiled, straight)
    kinds, pull = [maps, layer.weight, layer.bias], torch.rand_like(straight)
    for found, wanted in zip(
        torch.autograd.grad(tiled, kinds, pull), torch.autograd.grad(straight, kinds, pull), strict=True
    ):
        torch.testing.assert_close(found, wanted)
    laid = in_tiles(maps.permute(0, 2, 3, 1), kernel, stride).permute(0, 3, 1, 2)
    assert torch.equal(layer.over_tiles(laid), tiled)


@pytest.mark.parametrize(
    ("channels", "kernel", "stride", "halved", "is_so"),
    [(1, 8, 4, True, True), (1, 8, 4, False, False), (32, 4, 2, True, False), (1, 3, 2, True, False)],
)
def test_frames_in_bfloat16_are_read_in_tiles_where_the_stride_divides_the_kernel(
    channels, kernel, stride, halved, is_so
):
    layer = Convolution(channels, 4, kernel, stride)
    assert (layer.bfloat16() if halved else layer).reads_tiles is is_so


def test_a_rollout_is_laid_out_once_for_a_policy_and_its_twin_critic():
    spec = WorldSpec("toy", 1, 1, {"frame": ArraySpec((30, 40), np.uint8)}, DiscreteActions(3))
    row = Architecture(convolutions=((16, 6, 3), (32, 4, 2)), separate_networks=True)
    network = ActorCritic(spec.observations, spec.actions, row, torch.Generator().manual_seed(1))
    frames = {"frame": torch.randint(0, 256, (9, 30, 40), dtype=torch.uint8)}
    assert network.prepare(frames)["frame"] is frames["frame"], "float32 reads frames as they come"
    half = Bfloat16Copy(network).network
    laid = half.prepare(frames)
    assert laid["frame"].shape == (9, 10, 13, 9)
    for found, wanted in zip(half(laid), half(frames), strict=True):
        assert torch.equal(found, wanted)
    torch.testing.assert_close(half(frames)[1], network(frames)[1], atol=0.02, rtol=0.02)
