"""The strides of AWS's networks, which no file of weights tells, by hand; weights written and read."""

import numpy as np
import pytest

from racecraft.formats.policy_layers import (
    CONTINUOUS,
    SAC,
    Convolution,
    DenseLayer,
    NetworkLayers,
    PolicyLayers,
    PolicyLayersError,
    SensorLayers,
    flat_size,
    flattened_size,
)
from racecraft.worlds.deepracer.files.policy_layers import KNOWN_STRIDES, require_aws_network
from racecraft.worlds.deepracer.files.policy_weights import _sensor, arrays_of, layers_from

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


def images(kernels, shrink=1, sizes=(120, 160, 1), dense=()):
    """A camera with convolutions of (rows, columns, filters, stride), and dense layers of (inputs, units)."""
    layers, channels = [], sizes[2]
    for high, wide, filters, stride in kernels:
        layers.append(Convolution(np.broadcast_to(np.float32(0), (high, wide, channels, filters)), None, stride))
        channels = filters
    behind = tuple(DenseLayer(np.broadcast_to(np.float32(0), shape), None) for shape in dense)
    return SensorLayers("FRONT_FACING_CAMERA", sizes, tuple(layers), behind, shrink)


def aws(name):
    return images([(kernel, kernel, filters, stride) for filters, kernel, stride in NETWORKS[name]])


FLAT = [  # (first - kernel) / stride + 1, rounded down, layer by layer
    (aws("one camera, shallow"), 11 * 16 * 64),  # 29 x 39, 13 x 18
    (aws("one camera, neither"), 25 * 35 * 64),  # 58 x 78, 56 x 76, 27 x 37
    (aws("one camera, deep"), 3 * 6 * 64),  # 29 x 39, 13 x 18, 5 x 8
    (aws("two cameras, all but shallow"), 25 * 35 * 128),  # 118 x 158, 58 x 78, 56 x 76, 27 x 37
    (images([(6, 3, 2, 1)], shrink=2, sizes=(13, 7, 2)), 2),  # a row and a column are left over
    (images([(10, 20, 2, 50)], sizes=(60, 70, 1)), 2 * 2 * 2),
]


@pytest.mark.parametrize(("sensor", "size"), FLAT)
def test_so_many_numbers_leave_the_convolutions(sensor, size):
    assert flattened_size(sensor) == flat_size(sensor) == size


def test_so_many_numbers_leave_a_sensor():
    assert flat_size(images([(120, 160, 7, 1)], dense=[(7, 9), (9, 4)])) == 4
    lidar = SensorLayers("LIDAR", (64,))
    assert (flat_size(lidar), flattened_size(lidar), lidar.is_image, images([]).is_image) == (64, 64, False, True)


@pytest.mark.parametrize("kernels", [[(1, 161, 2, 1)], [(8, 8, 2, 4), (30, 1, 2, 1)]])
def test_a_convolution_larger_than_its_picture_is_refused(kernels):
    where = "120 x 160 px" if len(kernels) == 1 else "29 x 39 px"
    with pytest.raises(
        PolicyLayersError, match=f"{kernels[-1][0]} x {kernels[-1][1]} px finds no room at {where}; .* 160 x 120 px"
    ):
        flattened_size(images(kernels))


def lidar(*units):
    return SensorLayers("LIDAR", (64,), (), tuple(DenseLayer(np.zeros((1, unit)), None) for unit in units))


PIXEL = Convolution(np.zeros((1, 1, 64, 32)), None, 1)
SHALLOW = aws("one camera, shallow")
TAKEN = {
    "each of AWS's networks": [aws(name) for name in NETWORKS],
    "any LiDAR's two layers": [SHALLOW, lidar(256, 256)],
    "a layer over each place": [SensorLayers("FRONT_FACING_CAMERA", (120, 160, 1), (*SHALLOW.convolutions, PIXEL))],
}
REFUSED = {
    "another network": [images([(8, 8, 32, 4), (4, 4, 64, 2)])],
    "a dense layer behind it": [
        SensorLayers(SHALLOW.name, SHALLOW.shape, SHALLOW.convolutions, (DenseLayer(np.zeros((11264, 5)), None),))
    ],
    "smaller frames": [SensorLayers(SHALLOW.name, SHALLOW.shape, SHALLOW.convolutions, (), 2)],
    "a LiDAR of one layer": [SHALLOW, lidar(256)],
}


def policy_of(sensors, kind="discrete", with_critic=True):
    network = NetworkLayers(tuple(sensors), (), DenseLayer(np.zeros((1, 1)), None))
    return PolicyLayers(kind, network, critic=network if with_critic else None)


@pytest.mark.parametrize("case", TAKEN)
def test_awss_own_networks_can_go_on_at_aws(case):
    require_aws_network(policy_of(TAKEN[case]))


@pytest.mark.parametrize("case", REFUSED)
def test_other_networks_cannot(case):
    with pytest.raises(PolicyLayersError, match=f"its network for {REFUSED[case][-1].name} is none of AWS's three"):
        require_aws_network(policy_of(REFUSED[case]))


def test_neither_can_a_policy_of_sac_or_one_without_a_critic():
    with pytest.raises(PolicyLayersError, match="learned by sac"):
        require_aws_network(policy_of([SHALLOW], SAC))
    with pytest.raises(PolicyLayersError, match="it has no critic of its own"):
        require_aws_network(policy_of([SHALLOW], with_critic=False))
