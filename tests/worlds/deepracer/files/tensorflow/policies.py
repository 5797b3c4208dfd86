"""Policies of AWS's shapes for these tests, drawn from a seed: layers, and the policy of ours that they are."""

import json
import math

import numpy as np
import torch

from racecraft.algorithms.networks import ActorCritic, Architecture
from racecraft.algorithms.plain_layers import layers_of
from racecraft.algorithms.policy_spec import PolicySpec, architecture_values
from racecraft.algorithms.registry import find_algorithm
from racecraft.algorithms.twin_critics import SoftActorCritic
from racecraft.contract.world import ContinuousActions, DiscreteActions
from racecraft.formats.policy_layers import Convolution, DenseLayer, NetworkLayers, PolicyLayers, SensorLayers
from racecraft.worlds.deepracer.env.race_spec import CAMERA_NAME
from racecraft.worlds.deepracer.env.sensors import STEREO, car_sensors

LISTED = DiscreteActions(5)
RANGES = ContinuousActions((-math.radians(30), 0.5), (math.radians(30), 2.0))
ROWS = {
    "shallow": Architecture(((32, 8, 4), (64, 4, 2), (64, 3, 1)), (), (256, 256), (512,)),
    "small": Architecture(((4, 6, 3), (8, 4, 2)), (), (), (16,)),
    "tiny": Architecture(((2, 24, 16), (3, 3, 2)), (4,), (5, 3), (6,)),
    "bare": Architecture(((2, 24, 16), (3, 3, 2)), (4,), (), (6,)),
}
SIZES = {"small": (30, 40)}


def layers_for(kind, network, sensors=(CAMERA_NAME,)):
    """Return (layers, greedy policy) with every weight drawn, heads and biases too."""
    row = Architecture(**{**vars_of(ROWS[network]), "separate_networks": True, "privileged_critic": False,
                          "initialisation": "glorot"})  # fmt: skip
    height, width = SIZES.get(network, (120, 160))
    seen = car_sensors(sensors).specs(width, height)
    actions = LISTED if kind == "discrete" else RANGES
    chance = torch.Generator().manual_seed(7)
    made = (SoftActorCritic if kind == "sac" else ActorCritic)(seen, actions, row, chance)
    weights = {
        name: value + 0.05 * torch.randn(value.shape, generator=chance) for name, value in made.state_dict().items()
    }
    told = {**architecture_values(row), "distribution": "gaussian", "probability_floor": 1e-8}
    spec = PolicySpec("sac" if kind == "sac" else "ppo", seen, actions, told)
    policy = find_algorithm(spec.algorithm).learner_class().load_policy(spec, weights)
    return layers_of(spec, {name: value.numpy() for name, value in weights.items()}, sorted(sensors)), policy


def two_eyed_layers(units, kind="discrete"):
    """Return AWS's largest network with its critic, drawn: five convolutions of two eyes, and so many units behind."""
    chance = np.random.default_rng(3)

    def drawn(*shape):
        return chance.random(shape, np.float32) * 0.02 - 0.01

    def network(outputs):
        filters, kernels, strides = (32, 64, 64, 128, 128), (3,) * 5, (1, 2, 1, 2, 1)
        channels = (2, *filters)
        eye = tuple(
            Convolution(drawn(kernel, kernel, channels[number], filters[number]), drawn(filters[number]), stride)
            for number, (kernel, stride) in enumerate(zip(kernels, strides, strict=True))
        )
        dense = DenseLayer(drawn(25 * 35 * 128, units), drawn(units))
        return NetworkLayers((SensorLayers(STEREO, (120, 160, 2), eye),), (dense,),
                             DenseLayer(drawn(units, outputs), drawn(outputs)))  # fmt: skip

    return PolicyLayers(kind, network(5), None, None, network(1))


def moments(sensors=(CAMERA_NAME,), network="tiny", count=4, seed=2):
    """Return what such a policy may see, drawn: whole bytes of images, distances of a LiDAR."""
    drawn = np.random.default_rng(seed)
    height, width = SIZES.get(network, (120, 160))
    return {
        name: drawn.integers(0, 256, (count, *part.shape)).astype(np.uint8)
        if len(part.shape) > 1
        else drawn.random((count, *part.shape)).astype(np.float32)
        for name, part in car_sensors(sensors).specs(width, height).items()
    }


def vars_of(row):
    return {name: getattr(row, name) for name in row.__dataclass_fields__}


def _write(path, **told):
    base = {"sensor": ["FRONT_FACING_CAMERA"], "neural_network": "DEEP_CONVOLUTIONAL_NETWORK_SHALLOW", "version": "5"}
    path.write_text(json.dumps({**base, **told}))


def write_listed(path, count=5, sensors=(CAMERA_NAME,)):
    space = [{"steering_angle": 30 - 10 * number, "speed": 1.0} for number in range(count)]
    _write(path, action_space=space, training_algorithm="clipped_ppo", action_space_type="discrete",
           sensor=list(sensors))  # fmt: skip


def write_ranges(path, algorithm="clipped_ppo", sensors=(CAMERA_NAME,)):
    space = {"steering_angle": {"low": -30, "high": 30}, "speed": {"low": 0.5, "high": 2.0}}
    _write(path, action_space=space, training_algorithm=algorithm, action_space_type="continuous",
           sensor=list(sensors))  # fmt: skip


METADATA = {
    "discrete": lambda path, **told: write_listed(path, **told),
    "continuous": write_ranges,
    "sac": lambda path, **told: write_ranges(path, "sac", **told),
}
