"""The strides of AWS's networks, which no file of weights tells, by hand."""

import pytest

from racecraft.formats.aws.policy_layers import KNOWN_STRIDES

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
