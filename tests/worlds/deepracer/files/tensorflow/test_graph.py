"""Graphs byte by byte: nodes, every kind of attribute, and the `.meta` file around them."""

import numpy as np
import pytest
from tests.worlds.deepracer.files.tensorflow.wire import bytes_field, varint_field

from racecraft.worlds.deepracer.files.tensorflow.graph import (
    Graph,
    GraphError,
    Node,
    NumberType,
    Shape,
    graph_in,
    read_graph,
    read_meta_graph,
    write_graph,
    write_meta_graph,
)


def test_a_graph_is_its_nodes_and_the_version_of_who_wrote_it():
    """Fields of `node_def.proto` and `graph.proto`, worked out by hand; 27 is what TensorFlow 1.12 wrote."""
    node = "0a0178" + "12024f70" + "1a0161" + "1a025e62" + "2a07" + "0a016b" + "12022801"
    graph = Graph([Node("x", "Op", ("a", "^b"), {"k": True})])
    assert write_graph(graph).hex() == f"0a{len(node) // 2:02x}" + node + "2202081b"


ATTRIBUTES = {  # fields of `attr_value.proto`
    "2801": True, "2800": False, "1807": 7, "1800": 0, "18ffffffffffffffffff01": -1, "250000c03f": 1.5,
    "120556414c4944": b"VALID", "1200": b"", "3001": NumberType(1), "3067": NumberType(103),
    "3a11" + "120b08ffffffffffffffffff01" + "12020802": Shape((-1, 2)), "3a00": Shape(()), "0a051a0301ac02": [1, 300],
    "0a00": [], "0a0c1a0affffffffffffffffff01": [-1],
}  # fmt: skip


def attributes_of(*written):
    """Return what a node with attributes of these bytes, called a, b and so on, is read as."""
    named = zip("abc", written, strict=False)
    parts = b"".join(bytes_field(5, bytes_field(1, name) + bytes_field(2, part)) for name, part in named)
    return graph_in(bytes_field(1, bytes_field(1, "x") + bytes_field(2, "Op") + parts), "g").nodes["x"].attributes


@pytest.mark.parametrize("written", ATTRIBUTES)
def test_every_kind_of_attribute_is_written_and_read(written):
    value = ATTRIBUTES[written]
    parts = bytes_field(1, "x") + bytes_field(2, "Op")
    told = bytes_field(5, bytes_field(1, "a") + bytes_field(2, bytes.fromhex(written)))
    assert write_graph(Graph([Node("x", "Op", (), {"a": value})])).startswith(bytes_field(1, parts + told))
    read = attributes_of(bytes.fromhex(written))["a"]
    assert read == value
    assert type(read) is type(value)


def test_an_array_is_read_and_a_list_of_texts_or_of_nothing_is_passed_over():
    array = np.float32([[1, 2]])
    graph = graph_in(write_graph(Graph([Node("x", "Const", (), {"value": array}), Node("y", "Op")])), "g")
    np.testing.assert_array_equal(graph.constants()["x"], array)
    assert list(graph.constants()) == ["x"]
    texts = bytes_field(8, varint_field(1, 7) + bytes_field(8, b"text"))
    nothing = bytes_field(8, varint_field(1, 0))
    assert attributes_of(texts, nothing, b"") == {}


def test_a_list_may_have_each_number_for_itself_or_hold_others_beside():
    """`ListValue`: 3 are numbers, packed or not; 6 are types, which nobody here asks for."""
    single = bytes_field(1, varint_field(3, 1) + varint_field(3, -2))
    types = bytes_field(1, varint_field(6, 1) + bytes_field(2, b"text"))
    assert attributes_of(single, types) == {"a": [1, -2], "b": []}


def test_a_meta_graph_has_variables_where_weights_were(tmp_path):
    weights = {"dtype": NumberType(1), "value": np.zeros((2, 3), np.float32)}
    nodes = [Node(f"d/{name}", "Const", (), weights) for name in ("kernel", "bias", "size")]
    nodes.append(Node("y", "MatMul", ("x", "d/kernel"), {"transpose_a": False}))
    (tmp_path / "m.meta").write_bytes(bytes_field(1, b"whatever") + write_meta_graph(Graph(nodes)))
    read = read_meta_graph(tmp_path / "m.meta").nodes
    assert [node.op for node in read.values()] == ["VariableV2", "VariableV2", "Const", "MatMul"]
    assert read["d/kernel"].attributes == {
        "dtype": NumberType(1), "shape": Shape((2, 3)), "container": b"", "shared_name": b"",
    }  # fmt: skip
    assert read["y"] == nodes[3]


@pytest.mark.parametrize(
    ("content", "letter"),
    [
        (varint_field(1, 2), r"m\.meta: it holds no graph; expected the \.meta file"),
        (b"\x12\x05a", r"m\.meta: damaged \(3 bytes are no MetaGraphDef .*; expected the \.meta file"),
    ],
)
def test_a_meta_file_without_a_graph_is_refused(tmp_path, content, letter):
    (tmp_path / "m.meta").write_bytes(content)
    with pytest.raises(GraphError, match=letter):
        read_meta_graph(tmp_path / "m.meta")


def test_a_file_of_as_many_bytes_as_there_may_be_is_read_and_a_larger_one_is_not(tmp_path, monkeypatch):
    path = tmp_path / "model.pb"
    path.write_bytes(write_graph(Graph([Node("x", "NoOp")])))
    monkeypatch.setattr("racecraft.worlds.deepracer.files.tensorflow.graph.MAX_FILE_BYTES", path.stat().st_size)
    assert list(read_graph(path).nodes) == ["x"]
    path.write_bytes(path.read_bytes() + b"\x28\x01")
    with pytest.raises(GraphError, match="more than 0 MiB"):
        read_graph(path)


def test_attributes_are_written_in_the_order_of_their_names_whatever_order_they_came_in():
    """A shorter name comes before a longer one that begins with it."""
    told = {"Tshape": NumberType(3), "T": NumberType(1), "N": 2}
    written = [write_graph(Graph([Node("x", "Op", (), dict(some))])) for some in (told.items(), reversed(told.items()))]
    assert written[0] == written[1]
    places = [written[0].index(bytes_field(1, name)) for name in ("N", "T", "Tshape")]
    assert places == sorted(places)
