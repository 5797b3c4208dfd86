"""A network as settings and as a row of figures: what each setting becomes, and what a file that names little means."""

from dataclasses import asdict

import pytest

from racecraft.algorithms.architecture import Architecture, NetworkConfig, architecture_from, architecture_of
from racecraft.contract.errors import SettingError


def test_what_a_policys_file_does_not_name_is_a_plain_network_of_two_layers():
    """A row in a checkpoint may lack what was thought of later; it means what it meant when it was written."""
    assert asdict(architecture_from({})) == {
        "convolutions": (), "image_units": (), "vector_units": (), "trunk_units": (64, 64), "activation": "relu",
        "separate_networks": False, "privileged_critic": True, "initialisation": "orthogonal", "encoder": None,
        "policy": None, "normalise": False, "memory": "none", "memory_units": 0,
    }  # fmt: skip


def test_lists_of_a_file_become_tuples_however_deep_and_what_is_unknown_is_passed_over():
    told = {"convolutions": [[4, 3, 1], [8, 2, 2]], "trunk_units": [], "activation": "tanh", "colour": "red"}
    row = architecture_from(told)
    assert row == Architecture(((4, 3, 1), (8, 2, 2)), trunk_units=(), activation="tanh")
    assert hash(row) == hash(architecture_from(told))


def test_convolutions_are_rows_of_filters_kernel_and_stride_and_layers_behind_them_are_the_trunk():
    row = architecture_of(NetworkConfig((4, 8, 9), (5, 3, 2), (2, 1, 3), hidden_units=(12, 11)))
    assert row.convolutions == ((4, 5, 2), (8, 3, 1), (9, 2, 3))
    assert row.trunk_units == (12, 11)


def test_units_of_a_memory_count_where_there_is_one():
    assert architecture_of(NetworkConfig(memory_units=7)).memory_units == 0
    row = architecture_of(NetworkConfig(memory="gru", memory_units=7))
    assert (row.memory, row.memory_units) == ("gru", 7)


@pytest.mark.parametrize("lengths", [(1, 2, 2), (2, 1, 2), (2, 2, 1)])
def test_convolutions_of_which_a_figure_is_missing_are_refused_with_their_counts(lengths):
    filters, kernels, strides = ((3,) * count for count in lengths)
    with pytest.raises(SettingError, match="have {}, {} and {} entries".format(*lengths)):
        architecture_of(NetworkConfig(filters, kernels, strides))
    assert architecture_of(NetworkConfig((), (), ())).convolutions == ()
