"""Convolving a few frames by one product, beside PyTorch's own convolution."""

import numpy as np
import pytest
import torch
from torch import nn

from racecraft.algorithms import convolution as page
from racecraft.algorithms.convolution import FEW_NUMBERS, Convolution, in_tiles
from racecraft.algorithms.half_precision import Bfloat16Copy
from racecraft.algorithms.networks import ActorCritic, Architecture, image_embedder
from racecraft.contract.world import ArraySpec, DiscreteActions, WorldSpec

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


def test_many_frames_go_the_common_way(monkeypatch):
    seen = []
    common = nn.Conv2d.forward
    monkeypatch.setattr(nn.Conv2d, "forward", lambda layer, maps: seen.append(len(maps)) or common(layer, maps))
    layer = Convolution(1, 16, 6, 3)
    few = FEW_NUMBERS // (9 * 12 * 36)
    with torch.no_grad():
        assert layer(torch.rand(few, 1, 30, 40)).shape == (few, 16, 9, 12)
        layer(torch.rand(few + 1, 1, 30, 40))
    layer(torch.rand(2, 1, 30, 40))
    assert seen == [few + 1, 2]


@pytest.mark.parametrize("activation", ["relu", "tanh"])
@pytest.mark.parametrize(("shape", "rows"), [((30, 40), 5), ((30, 40, 3), 5), ((30, 40), 200)])
def test_an_embedder_that_goes_no_detours_sees_what_it_sees_in_training(shape, rows, activation):
    row = Architecture(convolutions=((16, 6, 3), (32, 4, 2)), image_units=(24,), activation=activation)
    embedder, width = image_embedder("frame", ArraySpec(shape, np.uint8), row, torch.Generator().manual_seed(1))
    frames = torch.randint(0, 256, (rows, *shape), dtype=torch.uint8)
    kept = frames.clone()
    with torch.inference_mode():
        straight = embedder(frames)
    assert straight.shape == (rows, width)
    torch.testing.assert_close(straight, embedder(frames).detach(), atol=1e-5, rtol=1e-5)
    assert torch.equal(frames, kept)
    floats = frames.float() / 255.0
    kept = floats.clone()
    with torch.inference_mode():
        torch.testing.assert_close(embedder(floats), straight, atol=1e-5, rtol=1e-5)
    assert torch.equal(floats, kept)


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
    assert network.laid_out(frames)["frame"] is frames["frame"], "float32 reads frames as they come"
    half = Bfloat16Copy(network).network
    laid = half.laid_out(frames)
    assert laid["frame"].shape == (9, 10, 13, 9)
    for found, wanted in zip(half(laid), half(frames), strict=True):
        assert torch.equal(found, wanted)
    torch.testing.assert_close(half(frames)[1], network(frames)[1], atol=0.02, rtol=0.02)


@pytest.mark.parametrize(("frames", "straight"), [(33, True), (34, False)])
def test_33_frames_of_the_default_car_are_few(frames, straight, monkeypatch):
    """30 x 40 pixels make 9 x 12 patches of 36 numbers: 33 frames 128,304 of 131,072, and 34 frames 132,192."""
    common, seen = nn.Conv2d.forward, []
    monkeypatch.setattr(nn.Conv2d, "forward", lambda layer, maps: seen.append(len(maps)) or common(layer, maps))
    with torch.no_grad():
        Convolution(1, 16, 6, 3)(torch.rand(frames, 1, 30, 40))
    assert seen == ([] if straight else [frames])


def test_just_as_many_numbers_as_are_few_are_few_still(monkeypatch):
    common, seen = nn.Conv2d.forward, []
    monkeypatch.setattr(nn.Conv2d, "forward", lambda layer, maps: seen.append(len(maps)) or common(layer, maps))
    layer, maps = Convolution(2, 3, 3, 2), torch.rand(4, 2, 7, 5)
    with torch.no_grad():
        for few in (4 * 3 * 2 * 3 * 3 * 2, 4 * 3 * 2 * 3 * 3 * 2 - 1):
            monkeypatch.setattr(page, "FEW_NUMBERS", few)
            torch.testing.assert_close(layer(maps), common(layer, maps))
    assert seen == [4]


@pytest.mark.parametrize(
    ("channels", "kernel", "stride", "is_so"), [(8, 4, 2, True), (9, 4, 2, False), (1, 3, 1, False)]
)
def test_tiles_are_of_more_than_a_pixel_and_of_eight_channels_at_most(channels, kernel, stride, is_so):
    assert Convolution(channels, 4, kernel, stride).bfloat16().reads_tiles is is_so


def test_tiles_lie_row_by_row_and_what_no_kernel_comes_to_is_left_out():
    """A picture of 5 x 7 whose pixels are numbered, for kernels of 2 and steps of 2: 2 x 3 tiles of 2 x 2."""
    tiles = in_tiles(torch.arange(35).reshape(1, 5, 7, 1), 2, 2)
    assert tiles.tolist() == [[
        [[0, 1, 7, 8], [2, 3, 9, 10], [4, 5, 11, 12]],
        [[14, 15, 21, 22], [16, 17, 23, 24], [18, 19, 25, 26]],
    ]]  # fmt: skip
    two = in_tiles(torch.arange(48).reshape(1, 4, 6, 2), 4, 2)
    assert two.shape == (1, 2, 3, 8)
    assert two[0, 1, 2].tolist() == [32, 33, 34, 35, 44, 45, 46, 47], "both channels of a pixel side by side"
