"""A TensorFlow graph as named nodes: `model.pb`, and the graph in a `.meta` file. Begin with `read_graph`.

A frozen graph holds its weights as `Const` nodes; in a `.meta` file they are variables, whose values lie in the
checkpoint. What the nodes compute is `arithmetic.py`'s affair.

A graph that is read lies in memory as a whole: its file, its message and its arrays.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from racecraft.contract.errors import InputFileError
from racecraft.contract.message import Message
from racecraft.contract.world import Array
from racecraft.formats.protobuf_messages import MessageError, parsed
from racecraft.formats.user_file import read_user_file
from racecraft.worlds.deepracer.files.tensorflow import messages
from racecraft.worlds.deepracer.files.tensorflow.tensors import (
    STRING,
    read_shape,
    read_tensor,
    write_shape,
    write_tensor,
)

PRODUCER = 27
"""Version of the graphs that TensorFlow 1.12 wrote, AWS's trainer of years; every later one reads it."""
VARIABLE_ENDS = ("/kernel", "/bias")
MAX_NODES = 200_000
MAX_FILE_BYTES = 2**29
"""Twice what AWS's largest network takes, two eyes of 230 MB."""
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
    expected = "the .meta file of a TensorFlow checkpoint"
    try:
        message = parsed(messages.load().MetaGraphDef, _content(path))
    except MessageError as error:
        raise GraphError(path, Message("damaged ({error})", error=error), expected) from error
    if not message.HasField("graph_def"):
        raise GraphError(path, "it holds no graph", expected)
    return _graph(message.graph_def, path)


def graph_in(data: bytes, path: str | Path) -> Graph:
    """Return the graph in the bytes of a `GraphDef`.

    Args:
        data: The bytes.
        path: Where they come from, for the error.

    Raises:
        GraphError: They are no graph.
    """
    try:
        return _graph(parsed(messages.load().GraphDef, data), path)
    except MessageError as error:
        raise GraphError(path, Message("damaged, or no graph ({error})", error=error), KIND) from error


def _content(path: str | Path) -> bytes:
    return read_user_file(path, GraphError, KIND, max_bytes=MAX_FILE_BYTES)


def _graph(message: Any, path: str | Path) -> Graph:
    nodes: dict[str, Node] = {}
    try:
        if len(message.node) > MAX_NODES:
            raise MessageError(f"more than {MAX_NODES} nodes")
        for number, part in enumerate(message.node):
            if not part.name or not part.op:
                raise MessageError(f"node {number} has no name or no operation")
            if part.name in nodes:
                raise MessageError(f"two nodes are called {part.name!r}")
            nodes[part.name] = _node(part)
    except MessageError as error:
        raise GraphError(path, Message("damaged, or no graph ({error})", error=error), KIND) from error
    if not nodes:
        raise GraphError(path, "it holds no node", KIND)
    return Graph(nodes.values())


def _node(message: Any) -> Node:
    read = {entry.key: _attribute(entry.value) for entry in message.attr}
    attributes = {key: value for key, value in read.items() if value is not None}
    return Node(message.name, message.op, tuple(message.input), attributes)


def _attribute(message: Any) -> Any:
    """Return an attribute's value; None for an array of texts, as summaries and savers hold in a `.meta` file."""
    kind = message.WhichOneof("value")
    value: Any = getattr(message, kind) if kind else None
    if kind == "list":
        return list(value.i)
    if kind == "type":
        return NumberType(value)
    if kind == "shape":
        return Shape(read_shape(value))
    if kind == "tensor":
        return None if value.dtype in (0, STRING) else read_tensor(value)
    return value


def write_graph(graph: Graph) -> bytes:
    """Return a graph as the bytes of a `.pb` file; the same graph gives the same bytes."""
    message = messages.load().GraphDef()
    _write(message, graph.nodes.values())
    return bytes(message.SerializeToString())


def write_meta_graph(graph: Graph) -> bytes:
    """Return a frozen graph as the bytes of a `.meta` file, where its weights are variables without values."""
    message = messages.load().MetaGraphDef()
    nodes = [_as_variable(node) if node.name.endswith(VARIABLE_ENDS) else node for node in graph.nodes.values()]
    _write(message.graph_def, nodes)
    return bytes(message.SerializeToString())


def _write(into: Any, nodes: Iterable[Node]) -> None:
    for node in nodes:
        part = into.node.add(name=node.name, op=node.op, input=node.inputs)
        for key, value in sorted(node.attributes.items()):
            _write_attribute(part.attr.add(key=key).value, value)
    into.versions.producer = PRODUCER


def _write_attribute(into: Any, value: Any) -> None:
    if isinstance(value, bool):
        into.b = value
    elif isinstance(value, int):
        into.i = value
    elif isinstance(value, float):
        into.f = value
    elif isinstance(value, bytes):
        into.s = value
    elif isinstance(value, NumberType):
        into.type = value.code
    elif isinstance(value, Shape):
        write_shape(into.shape, value.sizes)
    elif isinstance(value, np.ndarray):
        write_tensor(into.tensor, value)
    else:
        into.list.SetInParent()
        into.list.i.extend(value)


def _as_variable(node: Node) -> Node:
    value = node.attributes["value"]
    attributes = {"dtype": node.attributes["dtype"], "shape": Shape(value.shape), "container": b"", "shared_name": b""}
    return Node(node.name, "VariableV2", (), attributes)
