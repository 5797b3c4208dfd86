"""Graphs and checkpoints that are none, are damaged, or were made to do harm: each is refused by a letter."""

import shutil
from pathlib import Path

import numpy as np
import pytest
from tests.worlds.deepracer.files.tensorflow.wire import bytes_field, varint_field

from racecraft.contract.errors import UserInputError
from racecraft.formats.protobuf_messages import parsed, read_varint, varint
from racecraft.worlds.deepracer.files.policy_graph import policy_in, read_policy_graph
from racecraft.worlds.deepracer.files.tensorflow.arithmetic import GraphArithmeticError, GraphFunction
from racecraft.worlds.deepracer.files.tensorflow.checkpoint import TensorFlowCheckpointError, read_checkpoint
from racecraft.worlds.deepracer.files.tensorflow.graph import (
    Graph,
    GraphError,
    Node,
    NumberType,
    Shape,
    read_graph,
    write_graph,
)
from racecraft.worlds.deepracer.files.tensorflow.messages import load
from racecraft.worlds.deepracer.files.tensorflow.table import write_table
from racecraft.worlds.deepracer.files.tensorflow.tensors import read_shape

SPECIMENS = Path(__file__).with_name("specimens") / "discrete"
PLACEHOLDER = Node("x", "Placeholder", (), {"dtype": NumberType(1), "shape": Shape((-1, 2))})

ZERO = b"\x2d\0\0\0\0"
"""A single number of an array."""
FAR_HANDLE = b"\0\0" + varint(2**60) + b"\1\0"


def node(name, op, inputs=(), **attributes):
    return Node(name, op, tuple(inputs), attributes)


def tensor(shape, content, code=1):
    dims = b"".join(bytes_field(2, varint_field(1, size)) for size in shape)
    return bytes_field(8, varint_field(1, code) + bytes_field(2, dims) + bytes_field(4, content))


def const(value):
    attribute = bytes_field(5, bytes_field(1, "value") + bytes_field(2, value))
    return bytes_field(1, bytes_field(1, "c") + bytes_field(2, "Const") + attribute)


BAD_GRAPHS = {
    "no file": (None, "there is no such file"),
    "empty": (b"", "the file is empty"),
    "a text": (b"I am no graph at all, I am a letter.", "damaged, or no graph"),
    "cut short": ((SPECIMENS / "model_3.pb").read_bytes()[:9000], "damaged, or no graph"),
    "an endless number": (b"\xff" * 40, "damaged, or no graph"),
    "a length beyond the end": (b"\x0a" + varint(2**40), "damaged, or no graph"),
    "field number 0": (b"\x02\x01a", "damaged, or no graph"),
    "a number for a node": (varint_field(1, 7), "it holds no node"),
    "a name of no UTF-8": (bytes_field(1, bytes_field(1, b"\xff\xfe")), "damaged, or no graph"),
    "a node without operation": (bytes_field(1, bytes_field(1, "a")), "no operation"),
    "two nodes of one name": (write_graph(Graph([PLACEHOLDER])) * 2, "two nodes are called 'x'"),
    "an array larger than its bytes": (const(tensor((1000, 1000), b"\0" * 8)), "holds 8 bytes, not 4000000"),
    "an array of 2^60 numbers": (const(tensor((2**30, 2**30), b"")), "at most 2 GiB"),
    "an array filled by one number into gigabytes": (
        const(bytes_field(8, varint_field(1, 1) + bytes_field(2, bytes_field(2, varint_field(1, 2**40))) + ZERO)),
        "at most 2 GiB",
    ),
}  # fmt: skip


@pytest.mark.parametrize("case", BAD_GRAPHS)
def test_a_bad_graph_is_refused_by_a_letter(tmp_path, case):
    content, words = BAD_GRAPHS[case]
    path = tmp_path / "model.pb"
    if content is not None:
        path.write_bytes(content)
    with pytest.raises(GraphError) as caught:
        read_graph(path)
    assert words in str(caught.value)
    assert str(path) in str(caught.value)
    assert "expected" in str(caught.value)


FROZEN = read_graph(SPECIMENS / "model_3.pb")
ONLINE = "main_level/agent/main/online/network_1"


def frozen_with(**changed):
    """The specimen with some of its constants changed, by the end of their names; None takes one away."""
    nodes = []
    for one in FROZEN.nodes.values():
        key = next((end for end in changed if one.name.endswith(end.replace("__", "/"))), None)
        if key is None or one.op != "Const":
            nodes.append(one)
        elif changed[key] is not None:
            nodes.append(Node(one.name, one.op, one.inputs, {**one.attributes, "value": changed[key]}))
    return Graph(nodes)


NO_POLICY = {
    "no weights": (Graph([PLACEHOLDER]), "holds no weights"),
    "another program's weights": (
        Graph([node("dense/kernel", "Const", value=np.zeros((2, 2), np.float32))]), "no policy of a DeepRacer car"
    ),
    "not frozen": (
        Graph([node(f"{ONLINE}/ppo_head_0/policy_fc/kernel", "VariableV2")]), "is a variable"
    ),
    "a bias that does not fit": (frozen_with(policy_fc__bias=np.zeros(3, np.float32)), "do not fit"),
    "a kernel larger than the image": (
        frozen_with(Conv2d_0__kernel=np.zeros((200, 200, 1, 2), np.float32)), "finds no room"
    ),
    "channels that do not follow": (
        frozen_with(Conv2d_2__kernel=np.zeros((3, 3, 9, 3), np.float32)), "9 channels where 2 arrive"
    ),
    "a padded convolution": (
        Graph([
            Node(one.name, one.op, one.inputs, {**one.attributes, "padding": b"SAME"}) if one.op == "Conv2D" else one
            for one in FROZEN.nodes.values()
        ]),
        "padding",
    ),
}  # fmt: skip


@pytest.mark.parametrize("case", NO_POLICY)
def test_a_graph_without_a_cars_policy_says_what_is_missing(case):
    graph, words = NO_POLICY[case]
    with pytest.raises(GraphError) as caught:
        policy_in(graph, "model.pb")
    assert words in str(caught.value)


WRONG_SUMS = {
    "a circle": (Graph([node("y", "Relu", ["z"]), node("z", "Relu", ["y"])]), "in a circle"),
    "a missing node": (Graph([node("y", "Relu", ["gone"])]), "holds no such node"),
    "an operation that runs code": (Graph([PLACEHOLDER, node("y", "PyFunc", ["x"])]), "PyFunc is not known"),
    "a file that is read": (Graph([PLACEHOLDER, node("y", "ReadFile", ["x"])]), "ReadFile is not known"),
    "sizes that do not fit": (
        Graph([PLACEHOLDER, node("w", "Const", value=np.zeros((3, 3), np.float32)), node("y", "MatMul", ["x", "w"])]),
        "cannot be computed",
    ),
    "a bomb of tiles": (
        Graph([PLACEHOLDER, node("n", "Const", value=np.array([1, 2**30], np.int32)), node("y", "Tile", ["x", "n"])]),
        "too large",
    ),
    "a bomb of sums": (
        Graph([
            node("a", "Const", value=np.zeros((2**15, 1), np.float32)),
            node("b", "Const", value=np.zeros((1, 2**15), np.float32)), node("y", "Add", ["a", "b"]),
        ]),
        "too large",
    ),
}  # fmt: skip


@pytest.mark.parametrize("case", WRONG_SUMS)
def test_what_cannot_be_computed_is_refused_by_name(case):
    graph, words = WRONG_SUMS[case]
    with pytest.raises(GraphArithmeticError) as caught:
        GraphFunction(graph, "y")({"x": np.zeros((1, 2), np.float32)})
    assert words in str(caught.value)


def _without(name):
    return lambda folder: (folder / name).unlink()


def _edited(name, edit):
    def spoil(folder):
        data = bytearray((folder / name).read_bytes())
        edit(data)
        (folder / name).write_bytes(bytes(data))

    return spoil


def _flip(place):
    def edit(data):
        data[place] ^= 0x40

    return edit


INDEX, DATA = "3_Step-700.ckpt.index", "3_Step-700.ckpt.data-00000-of-00001"
BAD_CHECKPOINTS = {
    "no index": (_without(INDEX), "there is no such file"),
    "an index cut short": (_edited(INDEX, lambda data: data.__delitem__(slice(500, None))), "the end of a table"),
    "a flipped bit in the index": (_edited(INDEX, _flip(40)), "checksum"),
    "a flipped bit in the weights": (_edited(DATA, _flip(6000)), "the checksum of"),
    "weights cut short": (_edited(DATA, lambda data: data.__delitem__(slice(9000, None))), "ends before"),
    "a block beyond the end": (
        _edited(INDEX, lambda data: data.__setitem__(slice(-48, -35), FAR_HANDLE)), "beyond the end"
    ),
    "a block packed by snappy": (
        lambda folder: _pack_by_snappy(folder / INDEX), "compressed in way 1"
    ),
}  # fmt: skip


def _pack_by_snappy(path):
    """Set the byte behind the block of pointers that says how it is packed."""
    data, numbers, at = bytearray(path.read_bytes()), [], 0
    for _ in range(4):  # two handles: statistics, pointers
        number, at = read_varint(data[-48:], at)
        numbers.append(number)
    data[numbers[2] + numbers[3]] = 1
    path.write_bytes(bytes(data))


@pytest.mark.parametrize("case", BAD_CHECKPOINTS)
def test_a_bad_checkpoint_is_refused_by_a_letter(tmp_path, case):
    spoil, words = BAD_CHECKPOINTS[case]
    folder = tmp_path / "model"
    shutil.copytree(SPECIMENS, folder)
    assert read_checkpoint(folder / "3_Step-700.ckpt")
    spoil(folder)
    with pytest.raises(TensorFlowCheckpointError) as caught:
        read_checkpoint(folder / "3_Step-700.ckpt")
    assert words in str(caught.value)


def test_any_bytes_at_all_end_in_a_letter_or_in_a_graph(tmp_path):
    """Hundreds of spoilt copies of a real graph: whatever comes of them, it is no traceback."""
    whole = np.frombuffer((SPECIMENS / "model_3.pb").read_bytes(), np.uint8)
    rng, path, refused = np.random.default_rng(0), tmp_path / "model.pb", 0
    for _ in range(300):
        spoilt = whole.copy()
        places = rng.integers(0, len(whole), 20)
        spoilt[places] = rng.integers(0, 256, 20)
        path.write_bytes(spoilt.tobytes())
        try:
            policy, function = read_policy_graph(path)
            function(dict.fromkeys(function.inputs, np.zeros((1, 120, 160, 1), np.float32)))
        except UserInputError:
            refused += 1
    assert refused > 50


def test_a_checkpoint_of_a_big_endian_machine_is_refused(tmp_path):
    head = varint_field(1, 1) + varint_field(2, 1)
    (tmp_path / "m.ckpt.index").write_bytes(write_table({b"": head}))
    with pytest.raises(TensorFlowCheckpointError, match="big-endian"):
        read_checkpoint(tmp_path / "m.ckpt")


def test_a_dimension_whose_size_is_left_out_is_none_and_an_open_one_is_open():
    """Protocol buffers leave a number out that is 0."""
    dims = bytes_field(2, b"") + bytes_field(2, varint_field(1, 3)) + bytes_field(2, varint_field(1, -1))
    assert read_shape(parsed(load().TensorShapeProto, dims)) == (0, 3, -1)


def test_a_graph_of_as_many_nodes_as_there_may_be_is_read_and_of_more_is_not(tmp_path, monkeypatch):
    monkeypatch.setattr("racecraft.worlds.deepracer.files.tensorflow.graph.MAX_NODES", 2)
    nodes = [Node(name, "NoOp", (), {}) for name in "abc"]
    (tmp_path / "two.pb").write_bytes(write_graph(Graph(nodes[:2])))
    assert [*read_graph(tmp_path / "two.pb").nodes] == ["a", "b"]
    (tmp_path / "three.pb").write_bytes(write_graph(Graph(nodes)))
    with pytest.raises(GraphError, match="more than 2 nodes"):
        read_graph(tmp_path / "three.pb")
