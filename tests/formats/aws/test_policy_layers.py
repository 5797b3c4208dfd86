"""The strides of AWS's networks, which no file of weights tells, by hand; weights written and read."""

import numpy as np
import pytest

from racecraft.formats.aws.policy_layers import (
    CONTINUOUS,
    KNOWN_STRIDES,
    DenseLayer,
    NetworkLayers,
    PolicyLayers,
    SensorLayers,
)
from racecraft.formats.aws.policy_weights import _sensor, arrays_of, layers_from

NETWORKS = {
    "one camera, shallow": ([32, 8, 4], [64, 4, 2], [64, 3, 1]),
    "one camera, neither": ([32, 5, 2], [32, 3, 1], [64, 3, 2], [64, 3, 1]),
    "one camera, deep": ([32, 8, 4], [32, 4, 2], [64, 4, 2], [64, 3, 1]),
    "two cameras, all but shallow": ([32, 3, 1], [64, 3, 2], [64, 3, 1], [128, 3, 2], [128, 3, 1]),
}
"""Filters, kernel and stride of each layer (facts: networks; simapp's network settings)."""


@pytest.mark.parametrize("layers", NETWORKS.values(), ids=NETWORKS)
def test_every_network_of_aws_is_known_by_its_kernels_and_filters(layers):
    assert KNOWN_STRIDES[tuple((kernel, filters) for filters, kernel, _ in layers)] == tuple(s for *_, s in layers)


def test_there_are_no_others():
    assert len(KNOWN_STRIDES) == len(NETWORKS)


def test_a_policy_of_two_ranges_comes_back_with_how_widely_it_explores():
    rng = np.random.default_rng(1)

    def dense(inputs, units):
        return DenseLayer(rng.random((inputs, units), np.float32), rng.random(units, np.float32))

    network = NetworkLayers((SensorLayers("LIDAR", (64,), (), (dense(64, 8),)),), (dense(8, 4),), dense(4, 2))
    policy = PolicyLayers(CONTINUOUS, network, np.array([-0.5, -1.0], np.float32))
    back = layers_from(arrays_of(policy), {})
    assert back.log_std.tolist() == [-0.5, -1.0]
    np.testing.assert_array_equal(back.network.head.kernel, network.head.kernel)


def test_a_convolution_that_moves_by_one_pixel_is_read():
    """Two cameras' network begins with one; a graph that says so, and the table of what AWS had."""
    name = "FRONT_FACING_CAMERA"
    filters, kernels, strides = zip(*NETWORKS["two cameras, all but shallow"], strict=True)
    arrays, scope, channels = {}, f"main_level/agent/main/online/network_1/{name}", 2
    for number, (filter_, kernel) in enumerate(zip(filters, kernels, strict=True)):
        arrays[f"{scope}/Conv2d_{number}/kernel"] = np.zeros((kernel, kernel, channels, filter_), np.float32)
        arrays[f"{scope}/Conv2d_{number}/bias"] = np.zeros(filter_, np.float32)
        channels = filter_
    told = {f"{scope}/Conv2d_{number}/kernel": stride for number, stride in enumerate(strides)}
    for known in ({}, told):
        layers = _sensor(arrays, scope.rpartition("/")[0], name, known, 1)
        assert [layer.stride for layer in layers.convolutions] == [1, 2, 1, 2, 1]
