"""A policy as plain layers, as files for other programs hold it. Begin with `PolicyLayers`."""

from __future__ import annotations

from dataclasses import dataclass

from racecraft.contract.errors import UserInputError
from racecraft.contract.world import Array

IMAGE = (120, 160)
"""Rows and columns of what a car's camera gives to the network, px."""
DISCRETE, CONTINUOUS, SAC = "discrete", "continuous", "sac"


class PolicyLayersError(UserInputError):
    """Weights do not make up such a network; whoever knows the file puts its name before the message."""


@dataclass(frozen=True)
class Convolution:
    """A convolution without padding, and its non-linearity."""

    kernel: Array
    """float32 (rows, columns, channels, filters)."""
    bias: Array
    """float32 (filters,)."""
    stride: int


@dataclass(frozen=True)
class DenseLayer:
    """A dense layer; all but a head's last have a non-linearity behind them."""

    kernel: Array
    """float32 (inputs, units)."""
    bias: Array
    """float32 (units,)."""


@dataclass(frozen=True)
class SensorLayers:
    """What one sensor's numbers go through by themselves."""

    name: str
    """As in model_metadata.json, such as FRONT_FACING_CAMERA."""
    shape: tuple[int, ...]
    """(rows, columns, channels) of an image, as the graph is fed; (numbers,) of a LiDAR."""
    convolutions: tuple[Convolution, ...] = ()
    dense: tuple[DenseLayer, ...] = ()
    """Behind the flattened convolutions."""
    shrink: int = 1
    """How many pixels, across and down, are averaged to one before the first convolution."""

    @property
    def is_image(self) -> bool:
        """Whether it is a camera."""
        return len(self.shape) == 3


@dataclass(frozen=True)
class NetworkLayers:
    """Sensors side by side, laid end to end, dense layers over them, and the last one."""

    sensors: tuple[SensorLayers, ...]
    """In the order of their sorted names."""
    trunk: tuple[DenseLayer, ...]
    head: DenseLayer
    activation: str = "relu"

    @property
    def shrink(self) -> int:
        """How many of the camera's pixels, across and down, are averaged to one; 1: none."""
        return max(sensor.shrink for sensor in self.sensors)


@dataclass(frozen=True)
class PolicyLayers:
    """A policy; with its critic where that is known, too."""

    kind: str
    """DISCRETE: the head gives logits of choices. CONTINUOUS: means in [-1, 1] units. SAC: means before the tanh."""
    network: NetworkLayers
    log_std: Array | None = None
    """CONTINUOUS: log of the standard deviations, float32 (A,); None: not in the file."""
    log_std_head: DenseLayer | None = None
    """SAC: the layer that gives them; None: not in the file."""
    critic: NetworkLayers | None = None
    """PPO's other network; None: not in the file."""


def flat_size(sensor: SensorLayers) -> int:
    """Return how many numbers leave a sensor's layers.

    Raises:
        PolicyLayersError: The convolutions find no room in the image.
    """
    if sensor.dense:
        return int(sensor.dense[-1].kernel.shape[1])
    return flattened_size(sensor)


def flattened_size(sensor: SensorLayers) -> int:
    """Return how many numbers leave a sensor's convolutions."""
    if not sensor.is_image:
        return sensor.shape[0]
    rows, columns, channels = sensor.shape[0] // sensor.shrink, sensor.shape[1] // sensor.shrink, sensor.shape[2]
    for layer in sensor.convolutions:
        high, wide, _, channels = layer.kernel.shape
        if min(rows - high, columns - wide) < 0:
            raise PolicyLayersError(
                "{name}: a convolution of {high} x {wide} px finds no room at {rows} x {columns} px; expected "
                "a network for images of {image} x {image_2} px.",
                name=sensor.name,
                high=high,
                wide=wide,
                rows=rows,
                columns=columns,
                image=IMAGE[1],
                image_2=IMAGE[0],
            )
        rows, columns = (rows - high) // layer.stride + 1, (columns - wide) // layer.stride + 1
    return rows * columns * channels


def is_pixel(layer: Convolution) -> bool:
    """Tell whether a convolution works on each place by itself."""
    return layer.kernel.shape[:2] == (1, 1)
