"""Each operation of a graph beside NumPy, PyTorch or a sum by hand, as TensorFlow's pages describe it."""

import numpy as np
import pytest
import torch

from racecraft.worlds.deepracer.files.tensorflow import arithmetic
from racecraft.worlds.deepracer.files.tensorflow.arithmetic import GraphArithmeticError, GraphFunction
from racecraft.worlds.deepracer.files.tensorflow.graph import Graph, Node, NumberType, Shape

LINE = np.array([-2, -0.5, 0, 0.5, 3], np.float32)
ROWS = np.arange(6, dtype=np.float32).reshape(2, 3)
CUBE = np.arange(24, dtype=np.float32).reshape(2, 3, 4)
WHOLE = np.array([[2, 3], [4, 5]], np.int32)


def computed(op, *read, **attributes):
    """Return what one operation makes of constants."""
    nodes = [Node(f"c{place}", "Const", (), {"value": np.asarray(one)}) for place, one in enumerate(read)]
    asked = Node("y", op, tuple(node.name for node in nodes), attributes)
    return GraphFunction(Graph([*nodes, asked]), "y")({})


def ints(*numbers):
    return np.array(numbers, np.int32)


OPERATIONS = [
    ("Identity", (ROWS,), {}, ROWS),
    ("AddV2", (ROWS, np.float32(1)), {}, [[1, 2, 3], [4, 5, 6]]),
    ("BiasAdd", (ROWS, LINE[:3]), {}, [[-2, 0.5, 2], [1, 3.5, 5]]),
    ("Sub", (LINE, np.float32(1)), {}, [-3, -1.5, -1, -0.5, 2]),
    ("Mul", (ROWS, LINE[2:]), {}, [[0, 0.5, 6], [0, 2, 15]]),
    ("RealDiv", (LINE, np.float32(2)), {}, [-1, -0.25, 0, 0.25, 1.5]),
    ("RealDiv", (LINE[2:], np.float32(0)), {}, [np.nan, np.inf, np.inf]),
    ("Maximum", (LINE, np.float32(0.25)), {}, [0.25, 0.25, 0.25, 0.5, 3]),
    ("Relu", (LINE,), {}, [0, 0, 0, 0.5, 3]),
    ("Tanh", (LINE,), {}, torch.tanh(torch.tensor(LINE)).numpy()),
    ("Exp", (np.float32([0, 1, 1000]),), {}, [1, np.e, np.inf]),
    ("Sigmoid", (LINE,), {}, torch.sigmoid(torch.tensor(LINE)).numpy()),
    ("Sigmoid", (np.float32([-1000, 1000]),), {}, [0, 1]),
    ("Softmax", (CUBE[:, :2] ** 2,), {}, torch.softmax(torch.tensor(CUBE[:, :2] ** 2), -1).numpy()),
    ("Softmax", (np.float32([1000, 1000]),), {}, [0.5, 0.5]),
    ("MatMul", (ROWS, ROWS.T.copy()), {}, [[5, 14], [14, 50]]),
    ("MatMul", (ROWS, ROWS), {"transpose_b": True}, [[5, 14], [14, 50]]),
    ("Reshape", (ROWS, ints(3, -1)), {}, [[0, 1], [2, 3], [4, 5]]),
    ("Reshape", (ROWS, np.int32(-1)), {}, [0, 1, 2, 3, 4, 5]),
    ("Shape", (CUBE,), {}, [2, 3, 4]),
    ("Pack", (ROWS[0], ROWS[1]), {}, [[0, 1, 2], [3, 4, 5]]),
    ("Pack", (ROWS[0], ROWS[1]), {"axis": 1}, [[0, 3], [1, 4], [2, 5]]),
    ("ConcatV2", (ROWS, ROWS[:, :1], ROWS[:, 2:], np.int32(-1)), {}, [[0, 1, 2, 0, 2], [3, 4, 5, 3, 5]]),
    ("GatherV2", (ROWS, ints(2, 0), np.int32(1)), {}, [[2, 0], [5, 3]]),
    ("Prod", (WHOLE, np.int32(1)), {}, [6, 20]),
    ("Prod", (WHOLE, ints(0, 1)), {}, 120),
    ("Prod", (WHOLE, ints(1)), {"keep_dims": True}, [[6], [20]]),
    ("Transpose", (CUBE, ints(0, 2, 1)), {}, CUBE.swapaxes(1, 2)),
    ("ExpandDims", (ROWS, np.int32(-1)), {}, ROWS.reshape(2, 3, 1)),
    ("Squeeze", (ROWS.reshape(1, 2, 1, 3),), {}, ROWS),
    ("Squeeze", (ROWS.reshape(1, 2, 1, 3),), {"squeeze_dims": [2]}, ROWS.reshape(1, 2, 3)),
    ("Tile", (ROWS, ints(2, 1)), {}, [[0, 1, 2], [3, 4, 5], [0, 1, 2], [3, 4, 5]]),
    ("Cast", (LINE,), {"DstT": NumberType(3)}, [-2, 0, 0, 0, 3]),
    ("Cast", (LINE,), {"DstT": NumberType(10)}, [True, True, False, True, True]),
    ("StridedSlice", (LINE, ints(1), ints(4), ints(2)), {}, [-0.5, 0.5]),
    ("StridedSlice", (LINE, ints(1), ints(3), ints(1)), {"begin_mask": 1}, [-2, -0.5, 0]),
    ("StridedSlice", (LINE, ints(1), ints(3), ints(1)), {"end_mask": 1}, [-0.5, 0, 0.5, 3]),
    ("StridedSlice", (LINE, ints(3), ints(4), ints(1)), {"shrink_axis_mask": 1}, 0.5),
    ("StridedSlice", (CUBE, ints(1, 1, 1), ints(2, 3, 2), ints(1, 1, 1)), {}, [[[17], [21]]]),
    ("StridedSlice", (CUBE, ints(1, 1, 1), ints(2, 3, 2), ints(1, 1, 1)), {"shrink_axis_mask": 5}, [17, 21]),
    ("StridedSlice", (CUBE, ints(1, 1, 1), ints(2, 3, 2), ints(1, 1, 1)), {"begin_mask": 6}, CUBE[1:2, :3, :2]),
]


@pytest.mark.parametrize(("op", "read", "attributes", "expected"), OPERATIONS)
def test_an_operation_computes_what_tensorflows_page_says(op, read, attributes, expected):
    result = computed(op, *read, **attributes)
    assert result.shape == np.shape(expected)
    np.testing.assert_allclose(result, expected, rtol=1e-6)


def test_numbers_stay_of_their_type():
    """Sizes that are computed from sizes are whole numbers still, or nothing could be shaped by them."""
    assert computed("Prod", WHOLE, ints(0)).dtype == np.int32
    assert computed("Shape", CUBE).dtype == np.int32
    assert computed("Cast", LINE, DstT=NumberType(9)).dtype == np.int64
    assert computed("Sigmoid", LINE).dtype == computed("Relu", LINE).dtype == np.float32
    averaged = computed("AvgPool", CUBE[..., None], ksize=[1, 1, 1, 1], strides=[1] * 4, padding=b"VALID")
    assert averaged.dtype == np.float32


def drawn(*shape):
    return np.random.default_rng(4).integers(-4, 5, shape).astype(np.float32)


def convolved(maps, kernel, strides, before, after):
    """PyTorch's answer for maps (N, rows, columns, C) with so many rows and columns of zeros around."""
    padded = np.pad(maps, [(0, 0), *zip(before, after, strict=True), (0, 0)])
    laid = torch.tensor(padded.transpose(0, 3, 1, 2)), torch.tensor(kernel.transpose(3, 2, 0, 1))
    return torch.nn.functional.conv2d(*laid, stride=strides).numpy().transpose(0, 2, 3, 1)


@pytest.mark.parametrize(
    ("size", "window", "strides", "before", "after"),
    [
        ((5, 6), (3, 2), (2, 1), (1, 0), (1, 1)),  # an uneven rest lies behind
        ((6, 5), (3, 4), (1, 3), (1, 1), (1, 1)),
        ((4, 4), (1, 1), (2, 2), (0, 0), (0, 0)),  # steps that are wider than the window
    ],
)
def test_a_convolution_pads_as_tensorflow_does(size, window, strides, before, after):
    """Under SAME there are ceil(length / stride) places; "Notes on padding" on `tf.nn`'s page."""
    maps, kernel = drawn(2, *size, 3), drawn(*window, 3, 4)
    told = {"strides": [1, *strides, 1]}
    same = computed("Conv2D", maps, kernel, padding=b"SAME", **told)
    assert same.shape == (2, -(-size[0] // strides[0]), -(-size[1] // strides[1]), 4)
    np.testing.assert_allclose(same, convolved(maps, kernel, strides, before, after), atol=1e-4)
    if all(length >= seen for length, seen in zip(size, window, strict=True)):
        valid = computed("Conv2D", maps, kernel, padding=b"VALID", **told)
        np.testing.assert_allclose(valid, convolved(maps, kernel, strides, (0, 0), (0, 0)), atol=1e-4)


def test_an_average_is_that_of_each_window():
    maps = drawn(2, 4, 7, 2)
    told = computed("AvgPool", maps, ksize=[1, 2, 3, 1], strides=[1, 1, 2, 1], padding=b"VALID")
    laid = torch.tensor(maps.transpose(0, 3, 1, 2))
    expected = torch.nn.functional.avg_pool2d(laid, (2, 3), (1, 2)).numpy().transpose(0, 2, 3, 1)
    np.testing.assert_allclose(told, expected, atol=1e-5)


PICTURE, KERNEL = np.zeros((1, 4, 4, 1), np.float32), np.zeros((2, 2, 1, 1), np.float32)
FLAT = {"strides": [1, 1, 1, 1], "padding": b"VALID"}
REFUSED = [
    ("Conv2D", (PICTURE, KERNEL), {**FLAT, "dilations": [1, 2, 2, 1]}, "dilations"),
    ("Conv2D", (PICTURE, KERNEL), {**FLAT, "data_format": b"NCHW"}, "data format b'NCHW'"),
    ("AvgPool", (PICTURE,), {**FLAT, "ksize": [1, 2, 2, 1], "padding": b"SAME"}, "averages with padding"),
    ("StridedSlice", (LINE, ints(0), ints(1), ints(1)), {"new_axis_mask": 1}, "new axes"),
    ("Cast", (LINE,), {"DstT": NumberType(7)}, "type 7"),
    ("Reshape", (ROWS, ints(4)), {}, "Reshape cannot be computed"),
]


@pytest.mark.parametrize(("op", "read", "attributes", "words"), REFUSED)
def test_what_is_not_known_of_an_operation_is_refused(op, read, attributes, words):
    with pytest.raises(GraphArithmeticError, match=rf"y: .*{words}"):
        computed(op, *read, **attributes)


ROOMS = [  # the most numbers that are held at once, and what holds them
    (16, "Conv2D", (drawn(1, 3, 3, 1), drawn(2, 2, 1, 1)), FLAT),  # four windows of four
    (64, "Conv2D", (drawn(4, 3, 3, 1), drawn(2, 2, 1, 1)), {**FLAT, "padding": b"SAME"}),  # four padded pictures
    (8, "MatMul", (drawn(2, 9), drawn(9, 4)), {}),
    (6, "Tile", (drawn(2, 1), ints(1, 3)), {}),
]


@pytest.mark.parametrize(("most", "op", "read", "attributes"), ROOMS)
def test_no_more_numbers_are_held_at_once_than_there_may_be(monkeypatch, most, op, read, attributes):
    monkeypatch.setattr(arithmetic, "MAX_NUMBERS", most)
    computed(op, *read, **attributes)
    monkeypatch.setattr(arithmetic, "MAX_NUMBERS", most - 1)
    with pytest.raises(GraphArithmeticError, match="too large"):
        computed(op, *read, **attributes)


def test_a_graph_is_gone_through_once_each_node_behind_those_it_reads():
    """Outputs have numbers, and `^name` must only come before; who is read twice and by two is there for both."""
    graph = Graph([
        Node("y", "Sub", ("twice:0", "both")), Node("both", "Add", ("twice", "x")), Node("aside", "Relu", ("x",)),
        Node("twice", "Mul", ("x", "x", "^aside")), Node("x", "Placeholder", (), {"shape": Shape((-1, 2))}),
    ])  # fmt: skip
    function = GraphFunction(graph, "y")
    order = [node.name for node in function.order]
    assert sorted(order) == ["both", "twice", "x", "y"], "nobody reads what is aside"
    assert order.index("x") < order.index("twice") < order.index("both") < order.index("y")
    assert function.inputs == {"x": (-1, 2)}
    told = function({"x": np.array([[2, 200]], np.uint8)})
    assert told.tolist() == [[-2, -200]], "what is fed as bytes is reckoned in float32"


@pytest.mark.parametrize("op", ["VariableV2", "VarHandleOp"])
def test_variables_have_the_values_that_are_given(op):
    graph = Graph([Node("v", op), Node("read", "ReadVariableOp", ("v",)), Node("y", "Add", ("read", "v"))])
    assert GraphFunction(graph, "y", {"v": LINE})({}).tolist() == [-4, -1, 0, 1, 6]
    with pytest.raises(GraphArithmeticError, match="v: the checkpoint holds no such variable"):
        GraphFunction(graph, "y", {"w": LINE})({})


def test_a_placeholder_that_is_not_fed_is_named():
    with pytest.raises(GraphArithmeticError, match="x: nothing is fed to it"):
        GraphFunction(Graph([Node("x", "Placeholder"), Node("y", "Relu", ("x",))]), "y")({"z": LINE})
