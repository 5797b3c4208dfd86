"""A TensorFlow graph as named nodes: `model.pb`, and the graph in a `.meta` file. Begin with `read_graph`.

A frozen graph holds its weights as `Const` nodes; in a `.meta` file they are variables, whose values lie in the
checkpoint. What the nodes compute is `arithmetic.py`'s affair.

Source: facts: TensorFlow's `graph.proto`, `node_def.proto`, `attr_value.proto`, `versions.proto`, `meta_graph.proto`.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from racecraft.contract.errors import InputFileError
from racecraft.contract.world import Array
from racecraft.formats.mapped_file import map_file
from racecraft.formats.user_file import require_content, require_regular_file
from racecraft.worlds.deepracer.files.tensorflow.tensors import (
    dtype_of,
    read_shape,
    read_tensor,
    write_shape,
    write_tensor,
)
from racecraft.worlds.deepracer.files.tensorflow.wire import (
    WireError,
    as_bytes,
    as_float,
    as_number,
    as_signed,
    as_text,
    bytes_field,
    fields,
    float_field,
    read_varint,
    varint,
    varint_field,
)

PRODUCER = 27
"""Version of the graphs that TensorFlow 1.12 wrote, AWS's trainer of years; every later one reads it."""
VARIABLE_ENDS = ("/kernel", "/bias")
MOST_NODES = 200_000
MOST_FILE_BYTES = 2**31 - 1
"""Protocol buffers end there."""
KIND = "a frozen graph of TensorFlow, such as agent/model.pb"


class GraphError(InputFileError):
    """A graph file is missing, damaged, too large, or none."""


@dataclass(frozen=True)
class NumberType:
    """A number type as an attribute: TensorFlow's code."""

    code: int


@dataclass(frozen=True)
class Shape:
    """A shape as an attribute; -1 leaves a size open."""

    sizes: tuple[int, ...]


@dataclass(frozen=True)
class Node:
    """One operation."""

    name: str
    op: str
    inputs: tuple[str, ...] = ()
    """Names of the nodes it reads, "name:1" for a second output, "^name" for one that must only come before."""
    attributes: Mapping[str, Any] = field(default_factory=dict)
    """Arrays, `NumberType`, `Shape`, numbers, booleans, bytes, and lists of numbers."""


class Graph:
    """Nodes by name, in the order of the file."""

    def __init__(self, nodes: Iterable[Node]) -> None:
        self.nodes = {node.name: node for node in nodes}

    def constants(self) -> dict[str, Array]:
        """Return the arrays of a frozen graph, by name."""
        arrays = {node.name: node.attributes.get("value") for node in self.nodes.values() if node.op == "Const"}
        return {name: value for name, value in arrays.items() if isinstance(value, np.ndarray)}


def read_graph(path: str | Path) -> Graph:
    """Read a frozen graph.

    Raises:
        GraphError: There is no such file, or it holds something else.
    """
    return graph_in(_content(path), path)


def read_meta_graph(path: str | Path) -> Graph:
    """Read the graph of a `.meta` file.

    Raises:
        GraphError: There is no such file, or it holds something else.
    """
    content = _content(path)
    try:
        for number, value in fields(content):
            if number == 2:
                return graph_in(as_bytes(value, "the graph"), path)
    except WireError as error:
        raise GraphError(path, f"damaged ({error})", "the .meta file of a TensorFlow checkpoint") from error
    raise GraphError(path, "it holds no graph", "the .meta file of a TensorFlow checkpoint")


def graph_in(message: memoryview | bytes, path: str | Path) -> Graph:
    """Return the graph in a `GraphDef`.

    Args:
        message: The bytes.
        path: Where they come from, for the letter.

    Raises:
        GraphError: They are no graph.
    """
    nodes: dict[str, Node] = {}
    try:
        for number, value in fields(message):
            if number != 1:
                continue
            node = _node(as_bytes(value, "a node"))
            if not node.name or not node.op:
                raise WireError(f"node {len(nodes)} has no name or no operation")
            if node.name in nodes:
                raise WireError(f"two nodes are called {node.name!r}")
            if len(nodes) >= MOST_NODES:
                raise WireError(f"more than {MOST_NODES} nodes")
            nodes[node.name] = node
    except WireError as error:
        raise GraphError(path, f"damaged, or no graph ({error})", KIND) from error
    if not nodes:
        raise GraphError(path, "it holds no node", KIND)
    return Graph(nodes.values())


def write_graph(graph: Graph) -> bytes:
    """Return a graph as the bytes of a `.pb` file; the same graph gives the same bytes."""
    nodes = [bytes_field(1, _written(node)) for node in graph.nodes.values()]
    return b"".join([*nodes, bytes_field(4, varint_field(1, PRODUCER))])


def write_meta_graph(graph: Graph) -> bytes:
    """Return a frozen graph as the bytes of a `.meta` file, where its weights are variables without values."""
    nodes = [_as_variable(node) if node.name.endswith(VARIABLE_ENDS) else node for node in graph.nodes.values()]
    return bytes_field(2, write_graph(Graph(nodes)))


def _as_variable(node: Node) -> Node:
    value = node.attributes["value"]
    told = {"dtype": node.attributes["dtype"], "shape": Shape(value.shape), "container": b"", "shared_name": b""}
    return Node(node.name, "VariableV2", (), told)


def _content(path: str | Path) -> memoryview:
    path = Path(path)
    require_regular_file(path, GraphError, KIND)
    try:
        size = path.stat().st_size
        if size > MOST_FILE_BYTES:
            raise GraphError(path, f"{size} bytes long", f"{KIND}, under 2 GiB")
        content = map_file(path)
    except OSError as error:
        raise GraphError(path, f"cannot be read ({error.strerror})", KIND) from error
    require_content(path, bytes(content[:4096]), GraphError, KIND)
    return content


def _node(message: memoryview) -> Node:
    name = op = ""
    inputs: list[str] = []
    attributes: dict[str, Any] = {}
    for number, value in fields(message):
        if number == 1:
            name = as_text(value, "a node's name")
        elif number == 2:
            op = as_text(value, "a node's operation")
        elif number == 3:
            inputs.append(as_text(value, "a node's input"))
        elif number == 5:
            key, attribute = "", None
            for inner, told in fields(as_bytes(value, "an attribute")):
                if inner == 1:
                    key = as_text(told, "an attribute's name")
                elif inner == 2:
                    attribute = _attribute(as_bytes(told, f"attribute {key}"))
            if attribute is not None:
                attributes[key] = attribute
    return Node(name, op, tuple(inputs), attributes)


def _attribute(message: memoryview) -> Any:
    for number, value in fields(message):
        if number == 1:
            return _list(as_bytes(value, "a list"))
        if number == 2:
            return bytes(as_bytes(value, "bytes"))
        if number == 3:
            return as_signed(value, "a number")
        if number == 4:
            return as_float(value, "a number")
        if number == 5:
            return bool(as_number(value, "a boolean"))
        if number == 6:
            return NumberType(as_number(value, "a type"))
        if number == 7:
            return Shape(read_shape(as_bytes(value, "a shape")))
        if number == 8:
            return _tensor_or_none(as_bytes(value, "an array"))
    return None


def _tensor_or_none(message: memoryview) -> Array | None:
    """Return an array; None for one of texts, as summaries and savers hold in a `.meta` file."""
    for number, value in fields(message):
        if number == 1 and as_number(value, "an array's type") not in (0, 7):
            dtype_of(as_number(value, "an array's type"))
            return read_tensor(message)
    return None


def _list(message: memoryview) -> list[int]:
    numbers: list[int] = []
    for number, value in fields(message):
        if number == 3 and isinstance(value, int):
            numbers.append(as_signed(value, "a number"))
        elif number == 3:
            at = 0
            while at < len(packed := as_bytes(value, "numbers")):
                one, at = read_varint(packed, at)
                numbers.append(as_signed(one, "a number"))
    return numbers


def _written(node: Node) -> bytes:
    parts = [bytes_field(1, node.name), bytes_field(2, node.op)]
    parts += [bytes_field(3, name) for name in node.inputs]
    for key, value in sorted(node.attributes.items()):
        parts.append(bytes_field(5, bytes_field(1, key) + bytes_field(2, _written_attribute(value))))
    return b"".join(parts)


def _written_attribute(value: Any) -> bytes:
    if isinstance(value, bool):
        return varint_field(5, int(value))
    if isinstance(value, int):
        return varint_field(3, value)
    if isinstance(value, float):
        return float_field(4, value)
    if isinstance(value, bytes):
        return bytes_field(2, value)
    if isinstance(value, NumberType):
        return varint_field(6, value.code)
    if isinstance(value, Shape):
        return bytes_field(7, write_shape(value.sizes))
    if isinstance(value, np.ndarray):
        return bytes_field(8, write_tensor(value))
    return bytes_field(1, bytes_field(3, b"".join(varint(number) for number in value)))
