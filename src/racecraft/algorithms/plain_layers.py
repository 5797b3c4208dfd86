"""Between our policies and plain layers under AWS's names: what goes to a car, and what comes from AWS's trainer.

Begin with `layers_of`, which tells a policy's layers, and `policy_of`, which makes a policy of them. A convolution's
weights lie (filters, channels, rows, columns) here and (rows, columns, channels, filters) there, a dense layer's
transposed; flattened images are counted channel fastest in both. None of it needs torch.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from racecraft.algorithms.architecture import NONE, Architecture, architecture_from
from racecraft.algorithms.policy_spec import PolicySpec, architecture_values
from racecraft.algorithms.weight_init import fresh_critics, fresh_spread, init_critic
from racecraft.contract.errors import UserInputError
from racecraft.contract.world import Array, ArraySpec, ContinuousActions, DiscreteActions
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
)

PROBABILITY_FLOOR = 1e-8
"""AWS's: no choice is ever less likely (facts: deepracer.md 8.2)."""
ALGORITHMS = {DISCRETE: "ppo", CONTINUOUS: "ppo", SAC: "sac"}
ACTORS = ("ppo", "reinforce", "es", "bc")
"""Algorithms whose policy has a body and a head of its own."""
WORTHS = ("dqn", "apex")
"""Algorithms that learn what each choice is worth; as logits, worths choose alike: the best is the likeliest."""


class NoPlainLayersError(UserInputError):
    """A policy is made of more than convolutions and dense layers, or of others than AWS's files can name."""


@dataclass(frozen=True)
class ForeignPolicy:
    """A policy made of a file's layers."""

    spec: PolicySpec
    weights: dict[str, Array]
    notes: tuple[str, ...]
    """What the file did not hold and begins anew, a clause each."""


def layers_of(spec: PolicySpec, weights: Mapping[str, Any], sensors: Sequence[str] = ()) -> PolicyLayers:
    """Return the layers of a policy, and of its critic where that sees what the policy sees.

    Args:
        spec: What the weights are.
        weights: Arrays by name, as a checkpoint holds them.
        sensors: AWS's names of what is seen, in the order of our sorted ones; empty: ours.

    Raises:
        NoPlainLayersError: The message says what of it no car's file can hold.
    """
    kind = require_plain_layers(spec)
    architecture = architecture_from(spec.network)
    names = tuple(sensors) or tuple(sorted(spec.visible))
    if spec.algorithm in WORTHS:
        return PolicyLayers(kind, _value_layers(spec, architecture, weights, names))
    body, trunk, last = ("policy_body", "policy_body.trunk", "policy_head")
    if kind == SAC:
        count = 2 * len(architecture.trunk_units)
        body, trunk, last = "eyes", "actor", f"actor.{count}"
    network = _network_of(spec, architecture, weights, names, (body, trunk, last))
    if kind == SAC:
        actions = network.head.bias.shape[0] // 2
        mean, spread = (
            DenseLayer(network.head.kernel[:, part], network.head.bias[part])
            for part in (slice(None, actions), slice(actions, None))
        )
        return PolicyLayers(SAC, replace(network, head=mean), None, spread)
    log_std = np.asarray(weights["log_std"], np.float32) if kind == CONTINUOUS else None
    critic = None
    if "critic_body.trunk.0.weight" in weights and architecture.separate_networks and not _is_privileged(spec):
        critic = _network_of(spec, architecture, weights, names, ("critic_body", "critic_body.trunk", "value_head"))
    return PolicyLayers(kind, network, log_std, None, critic)


def policy_of(
    layers: PolicyLayers, observations: Mapping[str, ArraySpec], actions: DiscreteActions | ContinuousActions
) -> ForeignPolicy:
    """Return the policy that layers make up, for what a world shows.

    What the file does not hold (a lone graph has no critic) begins anew, from a seed of its own.

    Args:
        layers: As a file told them.
        observations: What the world shows, privileged parts included, by the names of the layers' sensors.
        actions: What the world obeys.

    Raises:
        PolicyLayersError: The layers see or decide something else.
    """
    _require_same_world(layers, observations, actions)
    architecture = _architecture_of(layers.network)
    values = architecture_values(architecture)
    if layers.kind != SAC:
        values |= {"distribution": "gaussian", "probability_floor": PROBABILITY_FLOOR}
    spec = PolicySpec(ALGORITHMS[layers.kind], dict(observations), actions, values)
    weights = _weights_of(layers)
    return ForeignPolicy(spec, {**_initial_weights(layers, weights, actions), **weights}, _missing_layers(layers))


def require_plain_layers(spec: PolicySpec) -> str:
    """Return the kind of a policy's layers: DISCRETE, CONTINUOUS or SAC.

    Raises:
        NoPlainLayersError: The message says what of it no car's file can hold, and how to train without.
    """
    kinds = dict.fromkeys(ACTORS, CONTINUOUS if isinstance(spec.actions, ContinuousActions) else DISCRETE)
    kinds |= {"sac": SAC} | dict.fromkeys(WORTHS, DISCRETE)
    if spec.algorithm not in kinds:
        raise NoPlainLayersError(
            "the policy learned by {algorithm}; expected one of {kinds}, whose networks "
            "are known to be layers that a car's software can run. Train with one of them.",
            algorithm=spec.algorithm,
            kinds=", ".join(sorted(kinds)),
        )
    architecture = architecture_from(spec.network)
    beyond = {
        f"network.stack_size={spec.stack_size}": spec.stack_size > 1,
        f"network.memory={architecture.memory}": architecture.memory != NONE,
        f"network.encoder={architecture.encoder}": architecture.encoder is not None,
        "network.normalise=true": architecture.normalise,
        f"ppo.distribution={spec.network.get('distribution')}": spec.network.get("distribution", "gaussian")
        != "gaussian",
    }
    for setting, is_so in beyond.items():
        if is_so:
            hint = "Train with --set network.stack_size=1." if "stack_size" in setting else "Train without it."
            raise NoPlainLayersError(
                "the policy was trained with {setting}; expected convolutions and dense layers over one frame, which "
                "is all that a car's software knows. {hint}",
                setting=setting,
                hint=hint,
            )
    return kinds[spec.algorithm]


def _is_privileged(spec: PolicySpec) -> bool:
    return architecture_from(spec.network).privileged_critic and len(spec.visible) < len(spec.observations)


def _network_of(
    spec: PolicySpec,
    architecture: Architecture,
    weights: Mapping[str, Any],
    names: Sequence[str],
    places: tuple[str, str, str],
) -> NetworkLayers:
    body, trunk, last = places
    sensors = []
    for number, (ours, theirs) in enumerate(zip(sorted(spec.visible), names, strict=True)):
        part, place = spec.visible[ours], f"{body}.embedders.{number}"
        layers = []
        is_seen = len(part.shape) > 1
        shape = (*part.shape, 1) if len(part.shape) == 2 else part.shape
        for layer, (_, _, stride) in enumerate(architecture.convolutions if is_seen else ()):
            kernel = np.asarray(weights[f"{place}.{1 + 2 * layer}.weight"], np.float32).transpose(2, 3, 1, 0)
            layers.append(Convolution(kernel, np.asarray(weights[f"{place}.{1 + 2 * layer}.bias"]), stride))
        first = 2 + 2 * len(architecture.convolutions) if is_seen else 1
        units = architecture.image_units if is_seen else architecture.vector_units
        dense = tuple(_dense(weights, f"{place}.{first + 2 * layer}") for layer in range(len(units)))
        sensors.append(SensorLayers(theirs, shape, tuple(layers), dense, _shrink_of(shape) if is_seen else 1))
    middle = tuple(_dense(weights, f"{trunk}.{2 * layer}") for layer in range(len(architecture.trunk_units)))
    seen = tuple(replace(one, shape=(*IMAGE, one.shape[2])) if one.is_image else one for one in sensors)
    return NetworkLayers(seen, middle, _dense(weights, last), architecture.activation)


def _value_layers(
    spec: PolicySpec, architecture: Architecture, weights: Mapping[str, Any], names: Sequence[str]
) -> NetworkLayers:
    """Return the layers that tell what each choice is worth.

    Of two streams, what a moment is worth stays away: it is the same for every choice, so likelihoods are the same.
    """
    places = ("body", "body.trunk")
    if not (spec.network.get("dueling") and architecture.trunk_units):
        return _network_of(spec, architecture, weights, names, (*places, "choices.0"))
    before = replace(architecture, trunk_units=architecture.trunk_units[:-1])
    network = _network_of(spec, before, weights, names, (*places, "choices.2"))
    return replace(network, trunk=(*network.trunk, _dense(weights, "choices.0")))


def _shrink_of(shape: tuple[int, ...]) -> int:
    """Return how many of the car's pixels, across and down, one of these is.

    Raises:
        NoPlainLayersError: The car's image does not divide into them.
    """
    rows, columns = shape[:2]
    if IMAGE[0] % rows or IMAGE[1] % columns or IMAGE[0] // rows != IMAGE[1] // columns:
        raise NoPlainLayersError(
            "the policy sees {columns} x {rows} px; expected {image} x {image_2} as the car's camera gives, or a "
            "size that this divides into squares, such as 80 x 60 or 40 x 30. Train with such camera.width and "
            "camera.height.",
            columns=columns,
            rows=rows,
            image=IMAGE[1],
            image_2=IMAGE[0],
        )
    return IMAGE[0] // rows


def _dense(weights: Mapping[str, Any], place: str) -> DenseLayer:
    kernel = np.asarray(weights[f"{place}.weight"], np.float32)
    return DenseLayer(np.ascontiguousarray(kernel.T), np.asarray(weights[f"{place}.bias"], np.float32))


def _architecture_of(network: NetworkLayers) -> Architecture:
    """Return the row of figures of a file's layers.

    Raises:
        PolicyLayersError: Its sensors are not alike, as one row must serve all images.
    """
    images = [sensor for sensor in network.sensors if sensor.is_image]
    vectors = [sensor for sensor in network.sensors if not sensor.is_image]
    if len(images) > 1 or len(vectors) > 1:
        raise PolicyLayersError("there is more than one camera or LiDAR; expected at most one of each.")
    return Architecture(
        convolutions=tuple(
            (layer.kernel.shape[3], layer.kernel.shape[0], layer.stride) for one in images for layer in one.convolutions
        ),
        image_units=tuple(layer.kernel.shape[1] for one in images for layer in one.dense),
        vector_units=tuple(layer.kernel.shape[1] for one in vectors for layer in one.dense),
        trunk_units=tuple(layer.kernel.shape[1] for layer in network.trunk),
        activation=network.activation,
        separate_networks=True,
        privileged_critic=False,
        initialisation="glorot",
    )


def _weights_of(layers: PolicyLayers) -> dict[str, Array]:
    """Return the weights that a file told, by our names: views of them, for copies would double a large network."""
    if layers.kind == SAC:
        head, spread = layers.network.head, layers.log_std_head
        if spread is None:
            spread = DenseLayer(np.zeros_like(head.kernel), np.full_like(head.bias, -1.0))
        both = DenseLayer(np.hstack([head.kernel, spread.kernel]), np.hstack([head.bias, spread.bias]))
        last = f"actor.{2 * len(layers.network.trunk)}"
        return _named(replace(layers.network, head=both), "eyes", "actor", last)
    weights = _named(layers.network, "policy_body", "policy_body.trunk", "policy_head")
    if layers.log_std is not None:
        weights["log_std"] = np.asarray(layers.log_std, np.float32)
    if layers.critic is not None:
        weights |= _named(layers.critic, "critic_body", "critic_body.trunk", "value_head")
    return weights


def _named(network: NetworkLayers, body: str, trunk: str, last: str) -> dict[str, Array]:
    weights: dict[str, Array] = {}
    for number, sensor in enumerate(network.sensors):
        place = f"{body}.embedders.{number}"
        for layer, convolution in enumerate(sensor.convolutions):
            weights[f"{place}.{1 + 2 * layer}.weight"] = convolution.kernel.transpose(3, 2, 0, 1)
            weights[f"{place}.{1 + 2 * layer}.bias"] = np.array(convolution.bias)
        first = 2 + 2 * len(sensor.convolutions) if sensor.is_image else 1
        for layer, dense in enumerate(sensor.dense):
            weights |= _named_dense(dense, f"{place}.{first + 2 * layer}")
    for layer, dense in enumerate(network.trunk):
        weights |= _named_dense(dense, f"{trunk}.{2 * layer}")
    return weights | _named_dense(network.head, last)


def _named_dense(layer: DenseLayer, place: str) -> dict[str, Array]:
    return {f"{place}.weight": layer.kernel.T, f"{place}.bias": np.array(layer.bias)}


def _require_same_world(
    layers: PolicyLayers, observations: Mapping[str, ArraySpec], actions: DiscreteActions | ContinuousActions
) -> None:
    seen = sorted((name, part) for name, part in observations.items() if not part.privileged)
    sensors = layers.network.sensors
    if [_numbers_of(part) for _, part in seen] != [_numbers_there(sensor) for sensor in sensors]:
        there = ", ".join(f"{sensor.name} {sensor.shape}" for sensor in sensors)
        here = ", ".join(f"{name} {part.shape}" for name, part in seen)
        raise PolicyLayersError(
            "its network sees {there}; expected {here}, as model_metadata.json says.", there=there, here=here
        )
    is_box = isinstance(actions, ContinuousActions)
    width = len(actions.low) if isinstance(actions, ContinuousActions) else actions.count
    outputs = layers.network.head.bias.shape[0]
    if is_box != (layers.kind != DISCRETE) or width != outputs:
        here = f"{width} numbers of two ranges" if is_box else f"{width} actions of a list"
        whose = {DISCRETE: f"chooses among {outputs}", CONTINUOUS: f"gives {outputs} numbers", SAC: f"gives {outputs}"}
        raise PolicyLayersError(
            "its network {whose} ({kind}); expected {here}, as model_metadata.json says. Give the "
            "metadata that it was trained with.",
            whose=whose[layers.kind],
            kind=layers.kind,
            here=here,
        )


def _numbers_of(part: ArraySpec) -> tuple[int, bool]:
    """Return how many channels an image has, or numbers a vector, and which of both it is."""
    is_seen = len(part.shape) > 1
    return (part.shape[2] if len(part.shape) == 3 else 1) if is_seen else part.shape[0], is_seen


def _numbers_there(sensor: SensorLayers) -> tuple[int, bool]:
    return sensor.shape[-1], sensor.is_image


def _initial_weights(
    layers: PolicyLayers, weights: Mapping[str, Array], actions: DiscreteActions | ContinuousActions
) -> dict[str, Array]:
    """Return first weights of what the layers do not tell."""
    if layers.kind != SAC:
        return fresh_spread(actions) | (init_critic(weights) if layers.critic is None else {})
    trunk = tuple(int(layer.kernel.shape[1]) for layer in layers.network.trunk)
    seen = sum(flat_size(sensor) for sensor in layers.network.sensors)
    return fresh_critics(weights, seen + int(layers.network.head.kernel.shape[1]), trunk)


def _missing_layers(layers: PolicyLayers) -> tuple[str, ...]:
    notes = []
    if layers.kind == SAC:
        notes.append("the critics begin anew: AWS's SAC judges states as well as actions, ours actions alone")
        if layers.log_std_head is None:
            notes.append("how widely it explores begins anew: a frozen graph holds only what it is sure of")
    elif layers.critic is None:
        notes.append("the critic begins anew: a frozen graph holds the policy alone")
    if layers.kind == CONTINUOUS and layers.log_std is None:
        notes.append("how widely it explores begins anew: a frozen graph holds only what it is sure of")
    return tuple(notes)
