"""A small plain network as numbers that compiled code looks through. Begin with `compile_policy`.

Asked about one frame of the default car, PyTorch takes four times as long as the multiplications do, and whoever drives
laps asks hundreds of times. What is larger, or not plain, PyTorch looks through.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import NamedTuple

import numpy as np
import torch
from torch import nn

from racecraft.algorithms.convolution import Convolution
from racecraft.algorithms.distributions import Categorical, Distribution
from racecraft.algorithms.kernels.greedy_action import NO_BEND, RELU, TANH
from racecraft.algorithms.networks import IMAGE_SCALE, ActorCritic, Encoder, FlattenChannelsLast, Image, ImageEmbedder
from racecraft.contract.world import Array

MAX_PRODUCTS = 2_000_000
"""Networks of more products a frame are looked through by PyTorch; the default car's has a quarter of a million."""


class CompiledPolicy(NamedTuple):
    """A network from one grey frame to a choice, as `kernels/compile_policy.py` reads it."""

    layers: Array
    """int64 (L, 8), a row for each layer."""
    weights: Array
    """float32, all of them, end to end; copies."""
    scale: np.float32
    """What a grey level counts."""
    buffer_size: int
    """Numbers in its widest map, and in its widest kernel."""


class Layer(NamedTuple):
    """A convolution, or a dense layer as one of 1 x 1, with what is behind it."""

    weight: Array
    """float32 (rows, columns, channels, filters)."""
    bias: Array
    stride: int
    bend: int
    """NO_BEND, RELU or TANH."""


def compile_policy(
    network: ActorCritic, distribution: Distribution, name: str, frame: tuple[int, ...]
) -> CompiledPolicy | None:
    """Return how a policy's network looks at a frame and chooses, as it stands now; None: PyTorch is to be asked.

    It must be convolutions and dense layers over one grey frame, on the processor, with one choice behind them.

    Args:
        network: The policy's.
        distribution: What its numbers mean.
        name: What the frame is called; it must be all that the network sees.
        frame: Its shape, (H, W).
    """
    body = network.policy_body
    if type(network) is not ActorCritic or not isinstance(body, Encoder) or body.names != (name,):
        return None
    eyes = body.embedders[0]
    if not (isinstance(distribution, Categorical) and isinstance(eyes, ImageEmbedder) and len(frame) == 2):
        return None
    if network.policy_head.weight.device.type != "cpu":
        return None
    with torch.no_grad():
        layers = [*_layers([*eyes, *body.trunk, network.policy_head])]
    return end_to_end(layers, (*frame, 1))


def _layers(modules: Iterable[nn.Module]) -> Iterator[Layer]:
    """Yield the layers of a row of modules, each with what is behind it."""
    kept: Layer | None = None
    for module in modules:
        if isinstance(module, (nn.ReLU, nn.Tanh)):
            assert kept is not None, "something bends what no layer gave"
            kept = kept._replace(bend=RELU if isinstance(module, nn.ReLU) else TANH)
        elif isinstance(module, (Convolution, nn.Linear)):
            if kept is not None:
                yield kept
            kept = _flattened(module)
        else:
            assert isinstance(module, (Image, FlattenChannelsLast)), f"{type(module).__name__} is no plain layer"
    assert kept is not None
    yield kept


def _flattened(module: Convolution | nn.Linear) -> Layer:
    weight, bias = module.weight.detach().float(), module.bias
    assert bias is not None
    if isinstance(module, nn.Linear):
        weight, stride = weight[:, :, None, None], 1
    else:
        stride = module.stride[0]
    return Layer(weight.permute(2, 3, 1, 0).numpy(), bias.detach().float().numpy(), stride, NO_BEND)


def end_to_end(layers: Iterable[Layer], shape: tuple[int, int, int]) -> CompiledPolicy | None:
    """Lay layers end to end over a frame (rows, columns, channels); None where they multiply too much.

    A dense layer behind a convolution takes its map row by row, column by column, the channels of a place together.
    """
    rows, parts, first, products, buffer_size = [], [], 0, 0, shape[0] * shape[1]
    height, width, channels = shape
    for layer in layers:
        size, _, seen, filters = layer.weight.shape
        if seen != channels:  # flattened before a dense layer
            height, width, channels = 1, 1, height * width * channels
        row = (first, height, width, channels, size, layer.stride, filters, layer.bend)
        height, width = ((side - size) // layer.stride + 1 for side in (height, width))
        products += height * width * layer.weight.size
        if products > MAX_PRODUCTS:
            return None
        rows.append(row)
        parts += [layer.bias, layer.weight.reshape(-1)]
        first += filters + layer.weight.size
        channels, buffer_size = filters, max(buffer_size, height * width * filters, size * size * seen)
    return CompiledPolicy(
        np.array(rows, np.int64), np.concatenate(parts, dtype=np.float32), np.float32(IMAGE_SCALE), buffer_size
    )
