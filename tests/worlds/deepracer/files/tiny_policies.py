"""Policies of AWS's shapes that are small enough to reckon by hand, drawn from a seed."""

import numpy as np

from racecraft.formats.policy_layers import (
    CONTINUOUS,
    DISCRETE,
    SAC,
    Convolution,
    DenseLayer,
    NetworkLayers,
    PolicyLayers,
    SensorLayers,
)

CAMERA, LIDAR = "FRONT_FACING_CAMERA", "LIDAR"
OUTPUTS = {DISCRETE: 5, CONTINUOUS: 2, SAC: 2}


def tiny_policy(kind, lidar_layers=True, shrink=1):
    """A camera of 4 x 5 places with two layers over each, a LiDAR of eight numbers, and three layers over both."""
    chance = np.random.default_rng(5)

    def drawn(*shape):
        return chance.normal(0, 0.3, shape).astype(np.float32)

    def dense(inputs, units):
        return DenseLayer(drawn(inputs, units), drawn(units))

    def network(outputs):
        size, stride = (30 // shrink, 40 // shrink), 30 // shrink  # (120 - 30) / 30 + 1 = 4, (160 - 40) / 30 + 1 = 5
        first = Convolution(drawn(*size, 1, 2), drawn(2), stride)
        eye = SensorLayers(CAMERA, (120, 160, 1), (first, Convolution(drawn(1, 1, 2, 3), drawn(3), 1)),
                           (dense(60, 4),), shrink)  # fmt: skip
        ear = SensorLayers(LIDAR, (8,), (), (dense(8, 3),) if lidar_layers else ())
        return NetworkLayers((eye, ear), (dense(7 if lidar_layers else 12, 6), dense(6, 7)), dense(7, outputs))

    outputs = OUTPUTS[kind]
    made = network(outputs)
    return PolicyLayers(
        kind, made, drawn(2) if kind == CONTINUOUS else None, dense(7, outputs) if kind == SAC else None,
        None if kind == SAC else network(1),
    )  # fmt: skip


def numbers_of(network):
    """All that a network is made of, to be compared."""
    sensors = [
        (one.name, one.shape, one.shrink, [(*map(np.ndarray.tolist, (layer.kernel, layer.bias)), layer.stride)
                                           for layer in one.convolutions],
         [(layer.kernel.tolist(), layer.bias.tolist()) for layer in one.dense])
        for one in network.sensors
    ]  # fmt: skip
    dense = [(layer.kernel.tolist(), layer.bias.tolist()) for layer in (*network.trunk, network.head)]
    return sensors, dense
