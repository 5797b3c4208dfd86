"""Steps of a layer that looks at pixels, as if their mean were 0."""

import numpy as np
import pytest
import torch
from torch import nn

from racecraft.algorithms.adam import Adam
from racecraft.algorithms.centred_pixels import CentredLayer, pixel_layers
from racecraft.algorithms.convolution import Convolution, in_tiles
from racecraft.algorithms.networks import ActorCritic, Architecture
from racecraft.contract.world import ArraySpec, DiscreteActions

KERNEL, STRIDE = 4, 2


@pytest.fixture
def frames():
    """Bright frames of two channels that differ little, (30, 12, 16, 2)."""
    rng = np.random.default_rng(1)
    return torch.from_numpy((np.array([180, 90]) + rng.integers(-20, 20, (30, 12, 16, 2))).astype(np.uint8))


def pixels(frames):
    return frames.permute(0, 3, 1, 2).float() / 255.0


def loss(answers):
    return torch.tanh(answers * torch.linspace(-3.0, 3.0, answers[0].numel()).view(answers[0].shape)).sum()


def stepped(layer, frames, centred):
    """Step a layer ten times; return what it answers then."""
    optimiser = Adam(layer.parameters(), 0.01, 1e-5)
    for _ in range(10):
        layer.zero_grad()
        loss(layer(pixels(frames))).backward()
        if centred is not None:
            centred.before_step()
        optimiser.step()
        if centred is not None:
            centred.after_step()
    return layer(pixels(frames)).detach()


def test_a_layer_steps_as_one_that_is_shown_centred_pixels(frames):
    torch.manual_seed(2)
    layer, plain = Convolution(2, 3, KERNEL, STRIDE), Convolution(2, 3, KERNEL, STRIDE)
    plain.load_state_dict(layer.state_dict())
    mean = pixels(frames).mean(dim=(0, 2, 3))

    twin = nn.Conv2d(2, 3, KERNEL, STRIDE)
    twin.weight.data = layer.weight.data.clone()
    twin.bias.data = layer.bias.data + layer.weight.data.sum(dim=(2, 3)) @ mean
    optimiser = torch.optim.Adam(twin.parameters(), 0.01, eps=1e-5)
    for _ in range(10):
        optimiser.zero_grad()
        loss(twin(pixels(frames) - mean[:, None, None])).backward()
        optimiser.step()
    wanted = twin(pixels(frames) - mean[:, None, None]).detach()

    centred = CentredLayer(layer)
    centred.look(frames)
    torch.testing.assert_close(stepped(layer, frames, centred), wanted, atol=1e-4, rtol=1e-4)
    assert (stepped(plain, frames, None) - wanted).abs().max() > 0.01


def test_tiles_have_the_mean_of_their_frames(frames):
    whole, tiles = (CentredLayer(Convolution(2, 3, KERNEL, STRIDE)) for _ in range(2))
    whole.look(frames)
    tiles.look(in_tiles(frames, KERNEL, STRIDE))
    torch.testing.assert_close(tiles.mean, whole.mean)


def test_the_layers_are_the_first_over_each_image():
    seen = {
        "left": ArraySpec((30, 40), np.uint8), "speed": ArraySpec((2,), np.float32), "up": ArraySpec((30, 40), np.uint8)
    }  # fmt: skip
    row = Architecture(convolutions=((4, 6, 3), (8, 4, 2)), trunk_units=(16,))
    body = ActorCritic(seen, DiscreteActions(3), row, torch.Generator()).policy_body
    assert [(name, layer.in_channels, layer.out_channels) for name, layer in pixel_layers(body)] == [
        ("left", 1, 4), ("up", 1, 4)
    ]  # fmt: skip
