"""Gradient steps of the layers that look at pixels, as if the pixels' mean were 0. Begin with `CentredPixels`.

Pixels are 0 to 1, with a mean far from 0, and one frame differs little from another: frames of 2022_reinvent_champ have
a mean of 0.46, and a pixel of them a standard deviation of 0.09. So most of a kernel's gradient is the bias's, the same
everywhere, and a step along it changes what brightness counts rather than what is in a frame (LeCun et al., "Efficient
BackProp", 1998, section 4.3).

A layer of kernels W and bias b over pixels x is one over x - m with the bias b + m sum(W), as nothing is padded. A step
here moves that bias beside W; b itself, the network and its files stay those of x.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import torch
from torch import Tensor, nn

from racecraft.algorithms.convolution import Convolution
from racecraft.algorithms.networks import IMAGE_SCALE, ActorCritic, Encoder, Image, ImageEmbedder

EVERY = 16
"""Of so many rows of a rollout one is looked at for the mean."""


class CentredPixels:
    """The layers of policy and critic that look at pixels; a user's own networks have none.

    Args:
        network: Whose weights are stepped, float32.
    """

    def __init__(self, network: ActorCritic) -> None:
        self._layers = [
            (name, CentredLayer(layer))
            for body in (network.policy_body, network.critic_body)
            if isinstance(body, Encoder)
            for name, layer in pixel_layers(body)
        ]

    def look(self, observations: Mapping[str, Tensor], rows: Tensor) -> None:
        """Take the mean of a rollout's frames, by name, for the steps to come; `rows` (int64) are learned from."""
        for name, layer in self._layers if len(rows) else ():
            layer.look(observations[name].index_select(0, rows[::EVERY]))

    def before_step(self) -> None:
        """Turn the gradients, that are with the weights, into those over centred pixels."""
        for _, layer in self._layers:
            layer.before_step()

    def after_step(self) -> None:
        """Have the biases be those over the pixels as they are."""
        for _, layer in self._layers:
            layer.after_step()


class CentredLayer:
    """A convolution over an image, stepped as if the mean of each channel were 0.

    Args:
        layer: The convolution, without padding.
    """

    def __init__(self, layer: Convolution) -> None:
        assert layer.bias is not None, "every convolution of ours has a bias"
        self._weight, self._bias = layer.weight, layer.bias
        self.mean = torch.zeros(layer.in_channels)
        """Of each channel, in what the layer multiplies by (uint8: 0 to 1)."""
        self._sums = torch.zeros(layer.out_channels, layer.in_channels)

    def look(self, frames: Tensor) -> None:
        """Take the mean of each channel of frames (R, H, W) or (R, H, W, C), or of their tiles."""
        mean = frames.reshape(-1, self._weight.shape[1]).float().mean(dim=0)
        self.mean = mean * IMAGE_SCALE if frames.dtype == torch.uint8 else mean

    @torch.no_grad()
    def before_step(self) -> None:
        """Turn the gradients of the kernels into those at a bias that stays as it is over centred pixels."""
        if self._weight.grad is None or self._bias.grad is None:
            return
        self._weight.grad -= self.mean[:, None, None] * self._bias.grad[:, None, None, None]
        self._sums = self._weight.sum(dim=(2, 3))

    @torch.no_grad()
    def after_step(self) -> None:
        """Give the bias what the kernels' step changed of a frame that is all mean."""
        if self._weight.grad is not None:
            self._bias -= (self._weight.sum(dim=(2, 3)) - self._sums) @ self.mean


def pixel_layers(body: Encoder) -> Iterator[tuple[str, Convolution]]:
    """Yield the first convolution over each image, with the observation's name."""
    for name, embedder in zip(body.names, body.embedders, strict=True):
        if isinstance(embedder, ImageEmbedder):
            image, layer, *_ = [*embedder.children(), nn.Identity()]
            if isinstance(image, Image) and isinstance(layer, Convolution):
                yield name, layer
