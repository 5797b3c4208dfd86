"""A car's policy as plain layers, under the names that AWS's trainer gave its weights. Begin with `PolicyLayers`.

Every layer of AWS's networks is counted together with the non-linearity behind it, so numbers go up by two::

    main_level/agent/main/online/network_1/            PPO's policy; network_0 beside it is the critic
        FRONT_FACING_CAMERA/Conv2d_0/kernel  …/bias    convolutions of a sensor, then its dense layers (Dense_6 …)
        middleware_fc_embedder/Dense_0/kernel          over all sensors together, laid end to end by their sorted names
        ppo_head_0/policy_fc/kernel                    choices; policy_mean and policy_log_std for two ranges
    main_level/agent/policy/online/network_0/
        sac_policy_head_0/dense/kernel  policy_mean    SAC's: one more dense layer within the head

A dense layer that AWS put behind convolutions works on each place of the picture by itself, for nothing was flattened
yet: it is a convolution of one pixel, and is one here.

Source: facts: deepracer.md 8.2, deepracer-systems.md B8; names from a `.meta` file that AWS's console wrote in 2023;
Coach `embedder.py` (flattens last), `ppo_head.py`; simapp `sac_head.py`, `custom_architectures.py`.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from racecraft.contract.errors import UserInputError
from racecraft.contract.world import Array

IMAGE = (120, 160)
"""Rows and columns of what a car's camera gives to the network, px."""
DISCRETE, CONTINUOUS, SAC = "discrete", "continuous", "sac"
POLICY_SCOPES = {
    DISCRETE: "main_level/agent/main/online/network_1",
    CONTINUOUS: "main_level/agent/main/online/network_1",
    SAC: "main_level/agent/policy/online/network_0",
}
INPUT_SCOPES = {kind: scope.replace("network_1", "network_0") for kind, scope in POLICY_SCOPES.items()}
"""Where the placeholders stand: the first network makes them, the second reads them."""
HEADS = {DISCRETE: "ppo_head_0", CONTINUOUS: "ppo_head_0", SAC: "sac_policy_head_0"}
LAST_LAYERS = {DISCRETE: "policy_fc", CONTINUOUS: "policy_mean", SAC: "policy_mean"}
MIDDLEWARE = "middleware_fc_embedder"
VALUE_SCOPE = "main_level/agent/main/online/network_0"
VALUE_LAYER = "v_values_head_0/output"
LIDAR_UNITS = (256, 256)
"""Dense layers over any LiDAR."""
RESCALER = "gradients_from_head_0-0_rescalers"
"""A number beside each network: 1, as no head's gradient is rescaled."""
KNOWN_STRIDES: Mapping[tuple[tuple[int, int], ...], tuple[int, ...]] = {
    ((8, 32), (4, 64), (3, 64)): (4, 2, 1),
    ((5, 32), (3, 32), (3, 64), (3, 64)): (2, 1, 2, 1),
    ((8, 32), (4, 32), (4, 64), (3, 64)): (4, 2, 2, 1),
    ((3, 32), (3, 64), (3, 64), (3, 128), (3, 128)): (1, 2, 1, 2, 1),
}
"""Strides of AWS's networks by the (kernel, filters) of their convolutions, where no graph tells them."""


class PolicyLayersError(UserInputError):
    """Weights do not make up a network of AWS's kind; whoever knows the file puts its name before the letter."""


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
                f"{sensor.name}: a convolution of {high} x {wide} px finds no room at {rows} x {columns} px; expected "
                f"a network for images of {IMAGE[1]} x {IMAGE[0]} px."
            )
        rows, columns = (rows - high) // layer.stride + 1, (columns - wide) // layer.stride + 1
    return rows * columns * channels


def is_pixel(layer: Convolution) -> bool:
    """Tell whether a convolution works on each place by itself."""
    return layer.kernel.shape[:2] == (1, 1)


def require_aws_network(policy: PolicyLayers) -> None:
    """Refuse what AWS's trainer could not go on with.

    Raises:
        PolicyLayersError: The letter says what of it.
    """
    if policy.kind == SAC:
        raise PolicyLayersError(
            "the policy was learned by sac, whose critics are others at AWS; expected one of ppo. --to car takes it."
        )
    if policy.critic is None:
        raise PolicyLayersError(
            "it has no critic of its own that sees what the policy sees; expected one of ppo with "
            "network.privileged_critic=false and network.separate_networks=true, as the preset aws has. --to car takes "
            "it as it is."
        )
    for sensor in policy.network.sensors:
        row = tuple(
            (layer.kernel.shape[0], layer.kernel.shape[3]) for layer in sensor.convolutions if not is_pixel(layer)
        )
        dense = tuple(layer.kernel.shape[1] for layer in sensor.dense)
        is_known = row in KNOWN_STRIDES and not dense if sensor.is_image else dense == LIDAR_UNITS
        if sensor.shrink != 1 or not is_known:
            raise PolicyLayersError(
                f"its network for {sensor.name} is none of AWS's three, or sees smaller frames; expected one that was "
                "trained with --preset aws. --to car takes it as it is."
            )


def head_layers(policy: PolicyLayers) -> tuple[tuple[DenseLayer, ...], tuple[DenseLayer, ...]]:
    """Return the trunk's layers that AWS keeps in the middleware, and those it keeps in the head (SAC's last)."""
    trunk = policy.network.trunk
    return (trunk[:-1], trunk[-1:]) if policy.kind == SAC else (trunk, ())
