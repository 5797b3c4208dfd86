"""A policy's weights under the names that AWS's trainer gave them, written and read. Begin with `layers_from`.

Which names there are is told in `policy_layers.py`.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping

import numpy as np

from racecraft.contract.world import Array
from racecraft.formats.policy_layers import (
    CONTINUOUS,
    DISCRETE,
    IMAGE,
    SAC,
    Convolution,
    DenseLayer,
    NetworkLayers,
    PolicyLayers,
    PolicyLayersError,
    SensorLayers,
    flat_size,
    flattened_size,
    is_pixel,
)
from racecraft.worlds.deepracer.files.policy_layers import (
    HEADS,
    KNOWN_STRIDES,
    LAST_LAYERS,
    MIDDLEWARE,
    POLICY_SCOPES,
    RESCALER,
    VALUE_LAYER,
    VALUE_SCOPE,
)
from racecraft.worlds.deepracer.files.sensor_names import CAMERAS, LIDARS

_LAYER = re.compile(r"(Conv2d|Dense)_(\d+)")
_OTHERS = ("/target/", "/q/online/", "/v/online/")
"""Networks beside the policy and its own critic: slow copies, and the three critics of SAC."""
_MOMENTS = ("/Adam", "/Adam_1")
"""What an optimiser remembers of each weight."""


def is_of_policy(name: str) -> bool:
    """Tell whether weights of a name may belong to the policy or to PPO's critic.

    >>> is_of_policy("main_level/agent/q/online/network_0/q_values_head_0/dense/kernel")
    False
    """
    return not name.endswith(_MOMENTS) and not any(other in name for other in _OTHERS)


def arrays_of(policy: PolicyLayers) -> dict[str, Array]:
    """Return a policy's weights, and its critic's, under AWS's names: what a checkpoint holds."""
    scope, head = POLICY_SCOPES[policy.kind], HEADS[policy.kind]
    arrays: dict[str, Array] = {f"{scope}/{RESCALER}": np.ones((), np.float32)}
    arrays |= _named_network(scope, policy.network, f"{head}/{LAST_LAYERS[policy.kind]}", policy.kind)
    if policy.log_std is not None:
        arrays[f"{scope}/{head}/policy_log_std"] = policy.log_std[None]
    if policy.log_std_head is not None:
        arrays |= _named(f"{scope}/{head}/dense_1", policy.log_std_head)
    if policy.critic is not None:
        arrays[f"{VALUE_SCOPE}/{RESCALER}"] = np.ones((), np.float32)
        arrays |= _named_network(VALUE_SCOPE, policy.critic, VALUE_LAYER, policy.kind)
    return {name: np.ascontiguousarray(array, np.float32).reshape(np.shape(array)) for name, array in arrays.items()}


def layers_from(
    arrays: Mapping[str, Array], strides: Mapping[str, int], shrink: int = 1, lidars: Mapping[str, int] | None = None
) -> PolicyLayers:
    """Return the policy that weights under AWS's names make up.

    Args:
        arrays: A checkpoint's, or a frozen graph's constants.
        strides: Of convolutions, by the name of their kernels; empty where no graph tells them.
        shrink: Pixels averaged to one before the first convolution.
        lidars: How many numbers each LiDAR tells, as far as a graph says it; one without layers is in no weights.

    Raises:
        PolicyLayersError: There is no policy among them, or its layers do not fit together.
    """
    kind, scope = _find_policy(arrays)
    head_scope = f"{scope}/{HEADS[kind]}"
    known = lidars or {}
    network = _network(arrays, scope, _dense_at(arrays, f"{head_scope}/{LAST_LAYERS[kind]}"), strides, shrink, known)
    if kind != SAC:
        log_std = arrays.get(f"{head_scope}/policy_log_std") if kind == CONTINUOUS else None
        value_scope = scope.removesuffix("network_1") + "network_0"
        critic = None
        if f"{value_scope}/{VALUE_LAYER}/kernel" in arrays:
            twins = {name.replace(scope, value_scope): stride for name, stride in strides.items()}
            head = _dense_at(arrays, f"{value_scope}/{VALUE_LAYER}")
            critic = _network(arrays, value_scope, head, {**twins, **strides}, shrink, known)
        policy = PolicyLayers(kind, network, None if log_std is None else _numbers(log_std).ravel(), None, critic)
    else:
        inner = _unnamed(arrays, head_scope)
        if not inner:
            raise PolicyLayersError(
                "{head_scope}: holds no dense layer before policy_mean; expected AWS's SAC head.", head_scope=head_scope
            )
        actions = network.head.kernel.shape[1]
        log_std_head = inner[1] if len(inner) > 1 and inner[1].kernel.shape[1] == actions else None
        network = NetworkLayers(network.sensors, (*network.trunk, inner[0]), network.head, network.activation)
        policy = PolicyLayers(kind, network, None, log_std_head)
    for part in (policy.network, policy.critic):
        if part is not None:
            _require_fit(part)
    return policy


def _find_policy(arrays: Iterable[str]) -> tuple[str, str]:
    """Return (kind, scope) of the policy that is trained, not of its slow copy."""
    for kind in (DISCRETE, CONTINUOUS, SAC):
        end = f"/{HEADS[kind]}/{LAST_LAYERS[kind]}/kernel"
        found = sorted(name for name in arrays if name.endswith(end) and "/target/" not in name)
        if found:
            return kind, found[0].removesuffix(end)
    some = ", ".join(sorted(arrays)[:3]) or "nothing"
    raise PolicyLayersError(
        "there is no policy of a DeepRacer car among its weights ({some} …); expected names like "
        "{policy_scopes}/ppo_head_0/policy_fc/kernel.",
        some=some,
        policy_scopes=POLICY_SCOPES[DISCRETE],
    )


def _network(
    arrays: Mapping[str, Array],
    scope: str,
    head: DenseLayer,
    strides: Mapping[str, int],
    shrink: int,
    lidars: Mapping[str, int],
) -> NetworkLayers:
    below = {name[len(scope) + 1 :].split("/")[0] for name in arrays if name.startswith(f"{scope}/")}
    sensors = sorted((below & {*CAMERAS, *LIDARS}) | set(lidars))
    if not sensors:
        raise PolicyLayersError(
            "{scope}: holds no sensor's layers ({below}); expected one of {cameras}.",
            scope=scope,
            below=", ".join(sorted(below)),
            cameras=", ".join(CAMERAS),
        )
    trunk = tuple(layer for _, layer in _ordered(arrays, f"{scope}/{MIDDLEWARE}") if isinstance(layer, DenseLayer))
    embedded = (
        _sensor(arrays, scope, name, strides, shrink) if name in below else SensorLayers(name, (lidars[name],))
        for name in sensors
    )
    return NetworkLayers(tuple(embedded), trunk, head)


def _sensor(
    arrays: Mapping[str, Array], scope: str, name: str, strides: Mapping[str, int], shrink: int
) -> SensorLayers:
    layers = _ordered(arrays, f"{scope}/{name}")
    kernels = [(place, layer) for place, layer in layers if isinstance(layer, Convolution)]
    dense = [layer for _, layer in layers if isinstance(layer, DenseLayer)]
    if not kernels:
        if not dense:
            raise PolicyLayersError(
                "{scope}/{name}: holds no layers; expected convolutions or dense layers.", scope=scope, name=name
            )
        return SensorLayers(name, (int(dense[0].kernel.shape[0]),), (), tuple(dense))
    known = KNOWN_STRIDES.get(tuple((layer.kernel.shape[0], layer.kernel.shape[3]) for _, layer in kernels))
    convolutions = []
    for number, (place, layer) in enumerate(kernels):
        stride = strides.get(f"{place}/kernel", known[number] if known else 0)
        if stride < 1:
            raise PolicyLayersError(
                "{place}: its stride is not known, and the network is none of AWS's; expected the .meta file beside "
                "the checkpoint, or the frozen graph.",
                place=place,
            )
        convolutions.append(Convolution(layer.kernel, layer.bias, stride))
    while dense and dense[0].kernel.shape[0] == convolutions[-1].kernel.shape[3]:
        pixel = dense.pop(0)  # nothing is flattened yet
        convolutions.append(Convolution(pixel.kernel[None, None], pixel.bias, 1))
    channels = int(convolutions[0].kernel.shape[2])
    return SensorLayers(name, (*IMAGE, channels), tuple(convolutions), tuple(dense), shrink)


def _ordered(arrays: Mapping[str, Array], scope: str) -> list[tuple[str, Convolution | DenseLayer]]:
    """Return a scope's layers with their names, by number; a convolution's stride is still open (0)."""
    numbers = {}
    for name in arrays:
        match = _LAYER.fullmatch(name[len(scope) + 1 :].removesuffix("/kernel")) if name.startswith(scope) else None
        if match and name.endswith("/kernel"):
            numbers[int(match[2])] = f"{scope}/{match[0]}"
    layers: list[tuple[str, Convolution | DenseLayer]] = []
    for number in sorted(numbers):
        place = numbers[number]
        kernel, bias = _pair(arrays, place)
        layers.append((place, Convolution(kernel, bias, 0) if kernel.ndim == 4 else DenseLayer(kernel, bias)))
    return layers


def _unnamed(arrays: Mapping[str, Array], scope: str) -> list[DenseLayer]:
    """Return a head's layers without a name of their own, "dense", "dense_1", …, in their order."""
    found = {}
    for name in arrays:
        match = re.fullmatch(r"dense(?:_(\d+))?/kernel", name[len(scope) + 1 :]) if name.startswith(scope) else None
        if match:
            found[int(match[1] or 0)] = name.removesuffix("/kernel")
    return [_dense_at(arrays, found[number]) for number in sorted(found)]


def _dense_at(arrays: Mapping[str, Array], place: str) -> DenseLayer:
    kernel, bias = _pair(arrays, place)
    if kernel.ndim != 2:
        raise PolicyLayersError(
            "{place}/kernel has shape {shape}; expected (inputs, units).", place=place, shape=kernel.shape
        )
    return DenseLayer(kernel, bias)


def _pair(arrays: Mapping[str, Array], place: str) -> tuple[Array, Array]:
    """Return a layer's kernel and bias, checked."""
    for part in ("kernel", "bias"):
        if f"{place}/{part}" not in arrays:
            raise PolicyLayersError(
                "{place}: has no {part}; expected kernel and bias of every layer.", place=place, part=part
            )
    kernel, bias = _numbers(arrays[f"{place}/kernel"]), _numbers(arrays[f"{place}/bias"])
    if kernel.ndim not in (2, 4) or bias.shape != kernel.shape[-1:]:
        raise PolicyLayersError(
            "{place}: kernel has shape {shape} and bias {shape_2}; they do not fit.",
            place=place,
            shape=kernel.shape,
            shape_2=bias.shape,
        )
    return kernel, bias


def _numbers(array: Array) -> Array:
    numbers = np.asarray(array, np.float32)
    if not np.isfinite(numbers).all():
        raise PolicyLayersError("weights that are no finite numbers; expected a policy whose training did not diverge.")
    return numbers


def _require_fit(network: NetworkLayers) -> None:
    """Refuse layers whose sizes do not follow from one another."""
    for sensor in network.sensors:
        channels = sensor.shape[-1]
        for layer in sensor.convolutions:
            if layer.kernel.shape[2] != channels:
                raise PolicyLayersError(
                    "{name}: a convolution reads {shape} channels where {channels} arrive.",
                    name=sensor.name,
                    shape=layer.kernel.shape[2],
                    channels=channels,
                )
            channels = layer.kernel.shape[3]
        _require_chain(sensor.name, flattened_size(sensor), sensor.dense)
    width = sum(flat_size(sensor) for sensor in network.sensors)
    _require_chain(MIDDLEWARE, width, (*network.trunk, network.head))


def _require_chain(place: str, width: int, layers: Iterable[DenseLayer]) -> None:
    for layer in layers:
        if layer.kernel.shape[0] != width:
            raise PolicyLayersError(
                "{place}: a dense layer reads {shape} numbers where {width} arrive; expected images "
                "of {image} x {image_2} px and AWS's layers.",
                place=place,
                shape=layer.kernel.shape[0],
                width=width,
                image=IMAGE[1],
                image_2=IMAGE[0],
            )
        width = int(layer.kernel.shape[1])


def _named_network(scope: str, network: NetworkLayers, last: str, kind: str) -> dict[str, Array]:
    arrays: dict[str, Array] = {}
    for sensor in network.sensors:
        for number, layer in enumerate(sensor.convolutions):
            if is_pixel(layer):  # AWS's trainer knows it as a dense layer
                pixel = DenseLayer(layer.kernel[0, 0], layer.bias)
                arrays |= _named(f"{scope}/{sensor.name}/Dense_{2 * number}", pixel)
            else:
                arrays |= _named(f"{scope}/{sensor.name}/Conv2d_{2 * number}", layer)
        for number, dense in enumerate(sensor.dense, len(sensor.convolutions)):
            arrays |= _named(f"{scope}/{sensor.name}/Dense_{2 * number}", dense)
    middle = network.trunk[:-1] if kind == SAC else network.trunk
    for number, dense in enumerate(middle):
        arrays |= _named(f"{scope}/{MIDDLEWARE}/Dense_{2 * number}", dense)
    if kind == SAC:
        arrays |= _named(f"{scope}/{HEADS[SAC]}/dense", network.trunk[-1])
    return arrays | _named(f"{scope}/{last}", network.head)


def _named(place: str, layer: Convolution | DenseLayer) -> dict[str, Array]:
    return {f"{place}/kernel": layer.kernel, f"{place}/bias": layer.bias}
