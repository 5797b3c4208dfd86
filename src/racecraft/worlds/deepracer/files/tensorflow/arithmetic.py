"""What a graph computes, in NumPy: the operations that networks of cars are made of. Begin with `GraphFunction`.

It is the judge of what we export and of what we import: the graph itself answers, beside our own network. Only nodes on
which the asked output depends are looked at, each once; an operation that we do not know is refused by name.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view

from racecraft.contract.errors import UserInputError
from racecraft.contract.world import Array
from racecraft.worlds.deepracer.files.tensorflow.graph import Graph, Node
from racecraft.worlds.deepracer.files.tensorflow.tensors import dtype_of

MAX_NUMBERS = 2**28
"""In one result: a gigabyte of float32."""
VARIABLES = ("VariableV2", "VarHandleOp", "Variable")


class GraphArithmeticError(UserInputError):
    """A graph cannot be computed: an unknown operation, a node that is missing, sizes that do not fit."""


class GraphFunction:
    """One output of a graph as a function of its inputs.

    Args:
        graph: The graph.
        output: Name of the node that is asked.
        variables: Values of variables by name, where the graph is not frozen.

    Raises:
        GraphArithmeticError: There is no such node, one that it needs is missing, they run in a circle, or one does
            what we do not know.
    """

    def __init__(self, graph: Graph, output: str, variables: Mapping[str, Array] | None = None) -> None:
        self.graph, self.output, self._variables = graph, output, dict(variables or {})
        self.order = ancestors(graph, output)
        """The nodes that take part, each behind those it reads."""
        for node in self.order:
            if node.op not in _OPERATIONS and node.op not in ("Placeholder", "Const", *VARIABLES):
                raise GraphArithmeticError(
                    "{name}: the operation {op} is not known here; expected a network of convolutions and "
                    "dense layers, as AWS trains.",
                    name=node.name,
                    op=node.op,
                )

    @property
    def inputs(self) -> dict[str, tuple[int, ...]]:
        """Names and shapes of the placeholders; -1 is a size that is left open."""
        open_ones = [node for node in self.order if node.op == "Placeholder"]
        return {node.name: getattr(node.attributes.get("shape"), "sizes", ()) for node in open_ones}

    def __call__(self, fed: Mapping[str, Array]) -> Array:
        """Return the output for arrays by placeholder.

        Raises:
            GraphArithmeticError: A placeholder is not fed, or sizes do not fit.
        """
        values: dict[str, Any] = {}
        last_reader = {name: place for place, node in enumerate(self.order) for name in _data_inputs(node)}
        for place, node in enumerate(self.order):
            values[node.name] = self._value(node, fed, values)
            for name in _data_inputs(node):
                if last_reader[name] == place:
                    values.pop(name, None)
        return np.asarray(values[self.output])

    def _value(self, node: Node, fed: Mapping[str, Array], values: Mapping[str, Any]) -> Any:
        if node.op == "Placeholder":
            if node.name not in fed:
                raise GraphArithmeticError("{name}: nothing is fed to it; expected an array.", name=node.name)
            return np.asarray(fed[node.name], np.float32)
        if node.op == "Const":
            return node.attributes["value"]
        if node.op in VARIABLES:
            if node.name not in self._variables:
                raise GraphArithmeticError(
                    "{name}: the checkpoint holds no such variable; expected its values.", name=node.name
                )
            return self._variables[node.name]
        try:
            with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
                result = _OPERATIONS[node.op](node, [values[name] for name in _data_inputs(node)])
        except (ValueError, IndexError, KeyError, TypeError) as error:
            raise GraphArithmeticError(
                "{name}: {op} cannot be computed ({error}); expected sizes that fit.",
                name=node.name,
                op=node.op,
                error=error,
            ) from error
        return result


def ancestors(graph: Graph, output: str) -> list[Node]:
    """Return the nodes an output depends on, each behind those it reads.

    Raises:
        GraphArithmeticError: One is missing, or they run in a circle.
    """
    order: dict[str, Node] = {}
    path: set[str] = set()
    waiting = [(output, False)]
    while waiting:
        name, is_done = waiting.pop()
        if is_done:
            order[name] = graph.nodes[name]
            continue
        if name in order:
            continue
        if name not in graph.nodes:
            raise GraphArithmeticError(
                "{name}: the graph holds no such node; expected one that is read there.", name=name
            )
        if name in path:
            raise GraphArithmeticError("{name}: the graph reads itself in a circle; expected a network.", name=name)
        path.add(name)
        waiting.append((name, True))
        waiting += [(read, False) for read in _data_inputs(graph.nodes[name])]
    return list(order.values())


def _data_inputs(node: Node) -> list[str]:
    """Return what a node reads, without what must only come before it and without the number of an output."""
    return [name.split(":")[0] for name in node.inputs if not name.startswith("^")]


def _both(function: Callable[[Any, Any], Any]) -> Callable[[Node, Sequence[Any]], Any]:
    def apply(_: Node, read: Sequence[Any]) -> Any:
        _require_memory(np.broadcast_shapes(np.shape(read[0]), np.shape(read[1])))
        return function(read[0], read[1])

    return apply


def _each(function: Callable[[Any], Any]) -> Callable[[Node, Sequence[Any]], Any]:
    return lambda _, read: function(read[0])


def _matmul(node: Node, read: Sequence[Any]) -> Any:
    left, right = (
        part.T if node.attributes.get(f"transpose_{side}") else part for part, side in zip(read, "ab", strict=True)
    )
    _require_memory((left.shape[0], right.shape[1]))
    return left @ right


def _conv(node: Node, read: Sequence[Any]) -> Any:
    _require_channels_last(node)
    maps, kernel = read
    strides, dilations = node.attributes["strides"], node.attributes.get("dilations") or [1, 1, 1, 1]
    if any(step != 1 for step in dilations):
        raise ValueError(f"dilations {dilations}")
    windows = _windows(node, maps, kernel.shape[:2], strides, 0.0)
    _require_memory((*windows.shape[:3], kernel.shape[3]))
    _require_memory((windows.shape[1] * windows.shape[2], *kernel.shape[:3]))
    flat = kernel.reshape(-1, kernel.shape[3])
    result = np.empty((*windows.shape[:3], kernel.shape[3]), np.result_type(maps, kernel))
    for place, row in enumerate(windows):  # all laid out at once would be gigabytes
        patches = row.transpose(0, 1, 3, 4, 2).reshape(-1, math.prod(kernel.shape[:3]))
        result[place] = (patches @ flat).reshape(result.shape[1:])
    return result


def _average(node: Node, read: Sequence[Any]) -> Any:
    _require_channels_last(node)
    size, strides = node.attributes["ksize"], node.attributes["strides"]
    if node.attributes["padding"] != b"VALID":
        raise ValueError("averages with padding")
    return _windows(node, read[0], size[1:3], strides, 0.0).mean(axis=(4, 5), dtype=np.float32)


def _windows(node: Node, maps: Array, size: Sequence[int], strides: Sequence[int], fill: float) -> Array:
    """Return what each place sees, (N, rows, columns, C, height, width)."""
    if node.attributes["padding"] == b"SAME":
        pads = [
            max((-(-length // step) - 1) * step + window - length, 0)
            for length, window, step in zip(maps.shape[1:3], size, strides[1:3], strict=True)
        ]
        around = [(pad // 2, pad - pad // 2) for pad in pads]
        _require_memory(tuple(n + pad for n, pad in zip(maps.shape, (0, *pads, 0), strict=True)))
        maps = np.pad(maps, [(0, 0), *around, (0, 0)], constant_values=fill)
    return sliding_window_view(maps, tuple(size), axis=(1, 2))[:, :: strides[1], :: strides[2]]


def _strided_slice(node: Node, read: Sequence[Any]) -> Any:
    array, begin, end, step = read
    masks = {name: int(node.attributes.get(f"{name}_mask", 0)) for name in ("begin", "end", "shrink_axis")}
    if node.attributes.get("new_axis_mask") or node.attributes.get("ellipsis_mask"):
        raise ValueError("a slice with new axes")
    index: list[Any] = []
    for axis in range(len(begin)):
        if masks["shrink_axis"] >> axis & 1:
            index.append(int(begin[axis]))
            continue
        first = None if masks["begin"] >> axis & 1 else int(begin[axis])
        last = None if masks["end"] >> axis & 1 else int(end[axis])
        index.append(slice(first, last, int(step[axis])))
    return np.asarray(array)[tuple(index)]


def _softmax(_: Node, read: Sequence[Any]) -> Any:
    shifted = np.exp(read[0] - read[0].max(axis=-1, keepdims=True))
    return shifted / shifted.sum(axis=-1, keepdims=True)


def _reshape(_: Node, read: Sequence[Any]) -> Any:
    return np.reshape(read[0], tuple(int(size) for size in np.ravel(read[1])))


def _gather(_: Node, read: Sequence[Any]) -> Any:
    return np.take(read[0], read[1], axis=int(read[2]) if len(read) > 2 else 0)


def _prod(node: Node, read: Sequence[Any]) -> Any:
    axes = tuple(int(axis) for axis in np.ravel(read[1]))
    keep = bool(node.attributes.get("keep_dims", False))
    return np.prod(read[0], axis=axes, keepdims=keep, dtype=np.asarray(read[0]).dtype)


def _squeeze(node: Node, read: Sequence[Any]) -> Any:
    axes = tuple(node.attributes.get("squeeze_dims") or ())
    return np.squeeze(read[0], axis=axes or None)


def _tile(_: Node, read: Sequence[Any]) -> Any:
    times = [int(count) for count in read[1]]
    _require_memory(tuple(size * count for size, count in zip(read[0].shape, times, strict=True)))
    return np.tile(read[0], times)


def _cast(node: Node, read: Sequence[Any]) -> Any:
    return np.asarray(read[0]).astype(dtype_of(node.attributes["DstT"].code))


def _require_memory(shape: tuple[int, ...]) -> None:
    if math.prod(shape) > MAX_NUMBERS:
        raise ValueError(f"a result of shape {shape} is too large")


def _require_channels_last(node: Node) -> None:
    if node.attributes.get("data_format", b"NHWC") != b"NHWC":
        raise ValueError(f"data format {node.attributes['data_format']!r}")


_OPERATIONS: Mapping[str, Callable[[Node, Sequence[Any]], Any]] = {
    **dict.fromkeys(("Identity", "StopGradient", "ReadVariableOp", "PlaceholderWithDefault"), _each(np.asarray)),
    **dict.fromkeys(("Add", "AddV2", "BiasAdd"), _both(np.add)),
    "Sub": _both(np.subtract),
    "Mul": _both(np.multiply),
    "RealDiv": _both(np.divide),
    "Maximum": _both(np.maximum),
    "Minimum": _both(np.minimum),
    "Relu": _each(lambda x: np.maximum(x, 0)),
    "Tanh": _each(np.tanh),
    "Exp": _each(np.exp),
    "Sigmoid": _each(lambda x: 1 / (1 + np.exp(-x))),
    "Softmax": _softmax,
    "MatMul": _matmul,
    "Conv2D": _conv,
    "AvgPool": _average,
    "Reshape": _reshape,
    "Shape": _each(lambda x: np.array(np.shape(x), np.int32)),
    "StridedSlice": _strided_slice,
    "Pack": lambda node, read: np.stack(read, axis=int(node.attributes.get("axis", 0))),
    "ConcatV2": lambda node, read: np.concatenate(read[:-1], axis=int(read[-1])),
    "GatherV2": _gather,
    "Prod": _prod,
    "Transpose": lambda node, read: np.transpose(read[0], [int(axis) for axis in read[1]]),
    "ExpandDims": lambda node, read: np.expand_dims(read[0], int(read[1])),
    "Squeeze": _squeeze,
    "Tile": _tile,
    "Cast": _cast,
}
"""What is known; the other names of TensorFlow's are not needed by any network of a car."""
