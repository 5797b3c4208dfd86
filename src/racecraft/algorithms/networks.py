"""From named observations to the parameters of actions and a value. Begin with `ActorCritic`.

A network is built from an `Architecture`, which is a row of plain figures: convolutions for images, dense layers for
vectors, one trunk behind them, two heads. A new network is a new row.

* An observation is an image if it is uint8 of shape (H, W) or (H, W, C), or float of shape (H, W, C); everything else
  is flattened to a vector. uint8 is divided by 255 here, and nowhere before.
* Several observations are embedded one by one and laid end to end in the order of their sorted names.
* The policy reads what is not privileged. With `privileged_critic` and a world that offers privileged vectors, the
  critic is a small network of its own over all vectors, privileged or not; it looks at no image, so it is cheap and its
  error does not pull at the policy's eyes. Otherwise the critic is a second head of the policy's trunk, or (with
  `separate_networks`) a twin of the whole policy network.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from itertools import pairwise

import numpy as np
import torch
from torch import Tensor, nn

from racecraft.algorithms.architecture import Architecture as Architecture
from racecraft.algorithms.architecture import NetworkConfig as NetworkConfig
from racecraft.algorithms.architecture import architecture_from as architecture_from
from racecraft.algorithms.architecture import architecture_of as architecture_of
from racecraft.algorithms.convolution import Convolution, in_tiles
from racecraft.algorithms.distributions import numbers_width, params_width
from racecraft.algorithms.running_statistics import RunningStatistics
from racecraft.contract.errors import SettingError
from racecraft.contract.loading import load_class
from racecraft.contract.world import ActionSpec, ArraySpec

CRITIC_UNITS = (128, 128)
"""Dense layers of a critic that reads privileged vectors."""
IMAGE_SCALE = 1.0 / 255.0
MAX_DEVIATIONS = 5.0
"""Normalised numbers are cut to this, as at ML-Agents."""
HIDDEN_GAIN = {"relu": math.sqrt(2.0), "tanh": math.sqrt(2.0)}
"""Gain of the orthogonal start; the same for both, as in the PPO implementations that were measured."""
POLICY_GAIN = 0.01
"""Gain of the policy's last layer: it starts almost indifferent."""


class ActorCritic(nn.Module):
    """Policy and critic over named observations.

    Args:
        observations: What the world shows, by name.
        actions: What the world obeys.
        architecture: The network as a row of figures.
        generator: Chance for the first weights; the global generator is not touched.

    The policy's parameters are those that `distributions.py` asks for: logits of choices, means of numbers in [-1, 1]
    units. `log_std` is a parameter of its own, shape (A,), that does not depend on what is seen; None without numbers.
    """

    def __init__(
        self,
        observations: Mapping[str, ArraySpec],
        actions: ActionSpec,
        architecture: Architecture,
        generator: torch.Generator,
    ) -> None:
        super().__init__()
        visible = {name: part for name, part in observations.items() if not part.privileged}
        vectors = {name: part for name, part in observations.items() if not is_image(part)}
        has_privileged = any(part.privileged for part in vectors.values())
        count, numbers = params_width(actions), numbers_width(actions)

        self.policy_body: Encoder | CustomEncoder | CustomPolicyNetwork = encoder_for(visible, architecture, generator)
        self.critic_body: Encoder | CustomEncoder | None = None
        if architecture.privileged_critic and has_privileged:
            row = replace(
                Architecture(trunk_units=CRITIC_UNITS, activation="tanh"),
                initialisation=architecture.initialisation,
                normalise=architecture.normalise,
            )
            self.critic_body = Encoder(vectors, row, generator)
        elif architecture.separate_networks:
            self.critic_body = encoder_for(visible, architecture, generator)

        policy_width, critic_width = self._head_widths(architecture, generator)
        self.policy_head = dense(policy_width, count, architecture, generator, POLICY_GAIN)
        self.value_head = dense(critic_width, 1, architecture, generator, 1.0)
        self.log_std = nn.Parameter(torch.zeros(numbers)) if numbers else None
        if architecture.initialisation == "glorot":
            normalise_columns(self.value_head, 1.0, generator)
            if self.log_std is not None:
                normalise_columns(self.policy_head, POLICY_GAIN, generator)

    def _head_widths(self, architecture: Architecture, generator: torch.Generator) -> tuple[int, int]:
        """Return how many features the heads of policy and critic read."""
        return self.policy_body.width, (self.critic_body or self.policy_body).width

    def forward(self, observations: Mapping[str, Tensor]) -> tuple[Tensor, Tensor]:
        """Return the policy's parameters (R, P) and the values (R,) of R rows."""
        features = self.policy_body(observations)
        critic = features if self.critic_body is None else self.critic_body(observations)
        return self.policy_head(features.float()), self.value_head(critic.float()).squeeze(-1)

    def policy(self, observations: Mapping[str, Tensor]) -> Tensor:
        """Return the policy's parameters (R, P) alone; needs no privileged observation."""
        return self.policy_head(self.policy_body(observations).float())

    def value(self, observations: Mapping[str, Tensor]) -> Tensor:
        """Return the values (R,) alone."""
        return self.value_head((self.critic_body or self.policy_body)(observations).float()).squeeze(-1)

    def prepare(self, observations: Mapping[str, Tensor]) -> dict[str, Tensor]:
        """Return the observations of a rollout, laid out once for all the passes that will be made over them."""
        policy, critic = self.policy_body, self.critic_body
        if isinstance(policy, Encoder) and (critic is None or isinstance(critic, Encoder)):
            return {**observations, **policy.prepare(observations)}
        return dict(observations)

    def observe(self, observations: Mapping[str, Tensor]) -> None:
        """Take R rows into the running statistics of vectors, where there are any."""
        for body in (self.policy_body, self.critic_body):
            if isinstance(body, Encoder):
                body.observe(observations)


class Encoder(nn.Module):
    """Embedders side by side, laid end to end, and a trunk over them: named observations to features (R, width)."""

    def __init__(
        self, observations: Mapping[str, ArraySpec], architecture: Architecture, generator: torch.Generator
    ) -> None:
        super().__init__()
        self.names = tuple(sorted(observations))
        self.embedders = nn.ModuleList()
        width = 0
        for name in self.names:
            part = observations[name]
            embedder, size = (image_embedder if is_image(part) else vector_embedder)(
                name, part, architecture, generator
            )
            self.embedders.append(embedder)
            width += size
        self.trunk = dense_stack(width, architecture.trunk_units, architecture, generator)
        self.width = architecture.trunk_units[-1] if architecture.trunk_units else width

    def forward(self, observations: Mapping[str, Tensor]) -> Tensor:
        """Return features (R, width)."""
        parts = [embed(observations[name]) for name, embed in zip(self.names, self.embedders, strict=True)]
        return self.trunk(parts[0] if len(parts) == 1 else torch.cat(parts, dim=1))

    def prepare(self, observations: Mapping[str, Tensor]) -> dict[str, Tensor]:
        """Return what it sees, laid out for many passes: see `ImageEmbedder.prepare`."""
        eyes = zip(self.names, self.embedders, strict=True)
        return {name: embed.prepare(observations[name]) for name, embed in eyes if isinstance(embed, ImageEmbedder)}

    def observe(self, observations: Mapping[str, Tensor]) -> None:
        """Take R rows into the running statistics of vectors, where there are any."""
        for name, embed in zip(self.names, self.embedders, strict=True):
            if isinstance(embed, nn.Sequential) and isinstance(embed[0], Vector) and embed[0].statistics is not None:
                embed[0].statistics.update(observations[name])


class CustomEncoder(nn.Module):
    """A user's own network in the place of `Encoder`.

    It is a `torch.nn.Module` whose class takes the observations' specs by name and nothing else, whose `width` tells
    how many features it gives, and whose `forward` takes named tensors (R, ...), in the world's own types, and returns
    float32 (R, width). Its first weights are drawn under a seed of their own; PyTorch's global chance is not touched.

    Raises:
        SettingError: There is no such class, or it is of another shape.
    """

    def __init__(
        self, observations: Mapping[str, ArraySpec], architecture: Architecture, generator: torch.Generator
    ) -> None:
        super().__init__()
        self.names = tuple(sorted(observations))
        named = str(architecture.encoder)
        own = load_class(named, "network.encoder")
        with torch.random.fork_rng(devices=[]):
            torch.manual_seed(int(torch.randint(0, 1 << 31, (1,), generator=generator)))
            try:
                self.own = own({name: observations[name] for name in self.names})
                self.width = int(self.own.width)
                self._require_shape(observations, named)
            except SettingError:
                raise
            except Exception as error:
                raise SettingError(
                    "network.encoder {named} failed ({type_name}: {error}); expected a torch.nn.Module "
                    "made from the specs of {names}, with `width`, whose forward takes named tensors.",
                    named=named,
                    type_name=type(error).__name__,
                    error=error,
                    names=", ".join(self.names),
                ) from error

    def forward(self, observations: Mapping[str, Tensor]) -> Tensor:
        """Return features (R, width)."""
        features: Tensor = self.own({name: observations[name] for name in self.names})
        return features

    @torch.no_grad()
    def _require_shape(self, observations: Mapping[str, ArraySpec], named: str) -> None:
        """Ask it once, about two rows of zeros."""
        found = tuple(self.forward(zero_rows(observations, self.names)).shape)
        if found != (2, self.width):
            raise SettingError(
                "network.encoder {named} gives {found} for two rows; expected (2, {width}), as its `width` says.",
                named=named,
                found=found,
                width=self.width,
            )


class CustomPolicyNetwork(nn.Module):
    """A user's own network in the place of layers and heads.

    It is a `torch.nn.Module` whose class takes the observations' specs by name, the actions' spec, and how many numbers
    P describe a decision; its `forward` takes named tensors (R, ...), in the world's own types, and returns float32
    (R, P) and what it expects to earn, (R,). Its first weights are drawn under a seed of their own.

    Raises:
        SettingError: There is no such class, or it is of another shape.
    """

    def __init__(
        self,
        observations: Mapping[str, ArraySpec],
        actions: ActionSpec,
        architecture: Architecture,
        generator: torch.Generator,
    ) -> None:
        super().__init__()
        self.names, self.width = tuple(sorted(observations)), params_width(actions)
        named = str(architecture.policy)
        own = load_class(named, "network.policy")
        with torch.random.fork_rng(devices=[]):
            torch.manual_seed(int(torch.randint(0, 1 << 31, (1,), generator=generator)))
            try:
                self.own = own({name: observations[name] for name in self.names}, actions, self.width)
                params, values = self.forward(zero_rows(observations, self.names))
                found = tuple(params.shape), tuple(values.shape)
            except SettingError:
                raise
            except Exception as error:
                raise SettingError(
                    "network.policy {named} failed ({type_name}: {error}); expected a torch.nn.Module made "
                    "from the specs of {names}, of the actions and {width}, whose forward takes "
                    "named tensors.",
                    named=named,
                    type_name=type(error).__name__,
                    error=error,
                    names=", ".join(self.names),
                    width=self.width,
                ) from error
        if found != ((2, self.width), (2,)):
            raise SettingError(
                "network.policy {named} gives {found} and {found_2} for two rows; expected (2, {width}) "
                "numbers that decide and (2,) values.",
                named=named,
                found=found[0],
                found_2=found[1],
                width=self.width,
            )

    def forward(self, observations: Mapping[str, Tensor]) -> tuple[Tensor, Tensor]:
        """Return the policy's parameters (R, P) and the values (R,)."""
        params, values = self.own({name: observations[name] for name in self.names})
        return params.float(), values.float()


class OwnActorCritic(ActorCritic):
    """A user's own network as policy and critic; it reads nothing privileged."""

    def __init__(
        self,
        observations: Mapping[str, ArraySpec],
        actions: ActionSpec,
        architecture: Architecture,
        generator: torch.Generator,
    ) -> None:
        nn.Module.__init__(self)
        visible = {name: part for name, part in observations.items() if not part.privileged}
        numbers = numbers_width(actions)
        self.policy_body = CustomPolicyNetwork(visible, actions, architecture, generator)
        self.critic_body = None
        self.log_std = nn.Parameter(torch.zeros(numbers)) if numbers else None

    def forward(self, observations: Mapping[str, Tensor]) -> tuple[Tensor, Tensor]:
        """Return the policy's parameters (R, P) and the values (R,) of R rows."""
        decided: tuple[Tensor, Tensor] = self.policy_body(observations)
        return decided

    def policy(self, observations: Mapping[str, Tensor]) -> Tensor:
        """Return the policy's parameters (R, P) alone."""
        return self.forward(observations)[0]

    def value(self, observations: Mapping[str, Tensor]) -> Tensor:
        """Return the values (R,) alone."""
        return self.forward(observations)[1]


def zero_rows(observations: Mapping[str, ArraySpec], names: tuple[str, ...]) -> dict[str, Tensor]:
    """Return two rows of zeros, to ask a network once what shape it gives."""
    shapes = {name: ((2, *observations[name].shape), observations[name].dtype) for name in names}
    return {name: torch.from_numpy(np.zeros(shape, dtype)) for name, (shape, dtype) in shapes.items()}


def encoder_for(
    observations: Mapping[str, ArraySpec], architecture: Architecture, generator: torch.Generator
) -> Encoder | CustomEncoder:
    """Return the network over observations: ours, or a user's own."""
    kind = Encoder if architecture.encoder is None else CustomEncoder
    return kind(observations, architecture, generator)


class Image(nn.Module):
    """(R, H, W) or (R, H, W, C) to floats (R, C, H, W) with its channels last in memory, uint8 scaled to [0, 1].

    With channels last, convolutions need no reordering on a CPU and flattening afterwards needs no copy.
    """

    def __init__(self) -> None:
        super().__init__()
        self.dtype = torch.float32
        """What the layers behind it multiply in."""

    def forward(self, frames: Tensor) -> Tensor:
        """Return frames as convolutions want them."""
        pixels = frames.to(self.dtype)
        pixels = pixels.mul_(IMAGE_SCALE) if frames.dtype == torch.uint8 else pixels
        return (pixels if pixels.dim() == 4 else pixels.unsqueeze(3)).permute(0, 3, 1, 2)


class ImageEmbedder(nn.Sequential):
    """`Image`, convolutions, `FlattenChannelsLast`, dense layers: (R, H, W) or (R, H, W, C) to features (R, width)."""

    def prepare(self, frames: Tensor) -> Tensor:
        """Return frames of a rollout as the first layer reads them again and again: in tiles, where it reads tiles."""
        image, layer, *_ = [*self._modules.values(), None]
        if not (isinstance(image, Image) and isinstance(layer, Convolution) and layer.reads_tiles):
            return frames
        return in_tiles(frames if frames.dim() == 4 else frames.unsqueeze(3), layer.kernel_size[0], layer.stride[0])


class FlattenChannelsLast(nn.Module):
    """(R, C, H, W) to (R, H * W * C), channel fastest, as TensorFlow counts them."""

    def forward(self, maps: Tensor) -> Tensor:
        """Return features (R, H * W * C)."""
        return maps.permute(0, 2, 3, 1).flatten(1)


class Vector(nn.Module):
    """Anything of shape (R, ...) to floats (R, width).

    Args:
        normalised: The width of vectors that are scaled by their running statistics; None: they are read as they are.
    """

    def __init__(self, normalised: int | None = None) -> None:
        super().__init__()
        self.dtype = torch.float32
        """What the layers behind it multiply in."""
        self.statistics = None if normalised is None else RunningStatistics(normalised)

    def forward(self, numbers: Tensor) -> Tensor:
        """Return vectors."""
        if self.statistics is None:
            return numbers.to(self.dtype).flatten(1)
        mean, deviation = self.statistics.mean_and_deviation()
        scaled = (numbers.float().flatten(1) - mean) / deviation
        return scaled.clamp(-MAX_DEVIATIONS, MAX_DEVIATIONS).to(self.dtype)


def is_image(part: ArraySpec) -> bool:
    """Tell whether an observation goes through convolutions.

    >>> is_image(ArraySpec((30, 40), np.uint8)), is_image(ArraySpec((7,), np.float32))
    (True, False)
    """
    return len(part.shape) == 3 or (len(part.shape) == 2 and np.dtype(part.dtype) == np.uint8)


def image_embedder(
    name: str, part: ArraySpec, architecture: Architecture, generator: torch.Generator
) -> tuple[nn.Module, int]:
    """Return the network over one image and the width of what it gives.

    Raises:
        SettingError: The convolutions leave nothing of an image this small.
    """
    height, width, *rest = part.shape
    channels = rest[0] if rest else 1
    layers: list[nn.Module] = [Image()]
    for filters, kernel, stride in architecture.convolutions:
        if min(height, width) < kernel:
            raise SettingError(
                "Observation '{name}' has shape {shape}; at {height} x {width} px the convolution of kernel "
                "{kernel} finds no room. Use smaller network.conv_kernels or fewer convolutions.",
                name=name,
                shape=part.shape,
                height=height,
                width=width,
                kernel=kernel,
            )
        layer = Convolution(channels, filters, kernel, stride, device="meta")
        allocate_weights(layer)
        start_weights(layer, architecture, generator, HIDDEN_GAIN[architecture.activation])
        # Not `contiguous`, which leaves a kernel of one channel as it is; convolutions go by the weights' strides.
        layer.weight.data = torch.empty_like(layer.weight, memory_format=torch.channels_last).copy_(layer.weight.data)
        layers += [layer, activation(architecture)]
        height, width, channels = (height - kernel) // stride + 1, (width - kernel) // stride + 1, filters
    size = height * width * channels
    layers += [FlattenChannelsLast(), *dense_stack(size, architecture.image_units, architecture, generator)]
    return ImageEmbedder(*layers), architecture.image_units[-1] if architecture.image_units else size


def vector_embedder(
    name: str, part: ArraySpec, architecture: Architecture, generator: torch.Generator
) -> tuple[nn.Module, int]:
    """Return the network over one vector and the width of what it gives."""
    size = math.prod(part.shape)
    units = architecture.vector_units
    normalised = size if architecture.normalise and len(part.shape) == 1 else None
    return nn.Sequential(Vector(normalised), *dense_stack(size, units, architecture, generator)), units[
        -1
    ] if units else size


def dense_stack(
    width: int, units: tuple[int, ...], architecture: Architecture, generator: torch.Generator
) -> nn.Sequential:
    """Return dense layers with an activation after each."""
    gain = HIDDEN_GAIN[architecture.activation]
    layers: list[nn.Module] = []
    for before, after in pairwise((width, *units)):
        layers += [dense(before, after, architecture, generator, gain), activation(architecture)]
    return nn.Sequential(*layers)


def dense(width: int, units: int, architecture: Architecture, generator: torch.Generator, gain: float) -> nn.Linear:
    """Return one dense layer with its first weights."""
    layer = nn.Linear(width, units, device="meta")
    allocate_weights(layer)
    start_weights(layer, architecture, generator, gain)
    return layer


def allocate_weights(layer: nn.Module) -> None:
    """Give a layer that was made on the device "meta" room for weights, which are drawn afterwards.

    As PyTorch's `skip_init`, without the half second of imports that its way costs every start (PyTorch 2.13).
    """
    for name, part in list(layer.named_parameters()):
        setattr(layer, name, nn.Parameter(torch.empty(part.shape)))


def activation(architecture: Architecture) -> nn.Module:
    """Return the non-linearity behind a layer; it writes over what that layer gave, which nobody asks for again."""
    return nn.Tanh() if architecture.activation == "tanh" else nn.ReLU(inplace=True)


@torch.no_grad()
def start_weights(
    layer: nn.Linear | nn.Conv2d, architecture: Architecture, generator: torch.Generator, gain: float
) -> None:
    """Give a layer its first weights: orthogonal with a gain, or Glorot uniform; biases start at 0."""
    if architecture.initialisation == "glorot":
        nn.init.xavier_uniform_(layer.weight, generator=generator)
    else:
        nn.init.orthogonal_(layer.weight, gain, generator=generator)
    if layer.bias is not None:
        nn.init.zeros_(layer.bias)


@torch.no_grad()
def normalise_columns(layer: nn.Linear, length: float, generator: torch.Generator) -> None:
    """Draw a dense layer's weights anew: normal, then what feeds each output scaled to this length (Euclidean)."""
    nn.init.normal_(layer.weight, generator=generator)
    layer.weight.mul_(length / layer.weight.norm(dim=1, keepdim=True))
