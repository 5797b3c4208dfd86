"""An array in a message: TensorFlow's `TensorProto`, its shapes and its number types. Begin with `read_tensor`.

Source: facts: TensorFlow's `tensor.proto`, `tensor_shape.proto`, `types.proto` (field numbers, codes of types).
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from racecraft.contract.world import Array
from racecraft.formats.protobuf_messages import MessageError

FLOAT, DOUBLE, INT32, STRING, INT64, BOOL, HALF = 1, 2, 3, 7, 9, 10, 19
"""TensorFlow's codes of number types."""
REFERENCE = 100
"""What is added to a type's code where a variable of TensorFlow 1 is meant itself, not its value."""
TYPES: dict[int, np.dtype[np.generic]] = {
    FLOAT: np.dtype("<f4"), DOUBLE: np.dtype("<f8"), INT32: np.dtype("<i4"), INT64: np.dtype("<i8"),
    BOOL: np.dtype("?"), HALF: np.dtype("<f2"), 4: np.dtype("u1"), 5: np.dtype("<i2"), 6: np.dtype("i1"),
}  # fmt: skip
"""NumPy's types for those that we read."""
CODES = {dtype: code for code, dtype in TYPES.items()}
MAX_DIMENSIONS = 8
MAX_BYTES = 2**31
"""Of one array: a message can hold no more."""

_REPEATED = {FLOAT: "float_val", DOUBLE: "double_val", INT32: "int_val", INT64: "int64_val", BOOL: "bool_val"}
"""Fields that hold numbers one by one, by type."""


def read_tensor(message: Any) -> Array:
    """Return the array in a `TensorProto`; where numbers stand one by one, the last one fills what is left.

    Raises:
        MessageError: A type we do not read, a size that is too large, or other bytes than the shape asks for.
    """
    dtype, shape = dtype_of(message.dtype), read_shape(message.tensor_shape)
    count = count_of(shape, dtype)
    if content := message.tensor_content:
        if len(content) != count * dtype.itemsize:
            raise MessageError(f"an array of shape {shape} holds {len(content)} bytes, not {count * dtype.itemsize}")
        return np.frombuffer(content, dtype).reshape(shape)
    singles = getattr(message, _REPEATED[message.dtype]) if message.dtype in _REPEATED else ()
    if len(singles) > count:
        raise MessageError(f"an array of shape {shape} holds {len(singles)} numbers")
    array = np.zeros(count, dtype)
    if singles:
        array[: len(singles)] = singles
        array[len(singles) :] = singles[-1]
    return array.reshape(shape)


def write_tensor(into: Any, array: Array) -> None:
    """Write an array into a `TensorProto`."""
    array = little_endian(array)
    into.dtype, into.tensor_content = CODES[array.dtype], array.tobytes()
    write_shape(into.tensor_shape, array.shape)


def little_endian(array: Array) -> Array:
    """Return an array whose bytes lie as TensorFlow's files have them; where they do already, itself."""
    array = np.asarray(array)
    return array.astype(array.dtype.newbyteorder("<"), copy=False)


def read_shape(message: Any) -> tuple[int, ...]:
    """Return a `TensorShapeProto`'s sizes; -1 is one that is left open.

    Raises:
        MessageError: More dimensions than any array of a car's network has.
    """
    if len(message.dim) > MAX_DIMENSIONS:
        raise MessageError(f"a shape of more than {MAX_DIMENSIONS} dimensions")
    return tuple(dimension.size for dimension in message.dim)


def write_shape(into: Any, shape: tuple[int, ...]) -> None:
    """Write sizes into a `TensorShapeProto`; -1 leaves one open."""
    into.SetInParent()
    for size in shape:
        into.dim.add(size=size)


def dtype_of(code: int) -> np.dtype[np.generic]:
    """Return NumPy's type of TensorFlow's code.

    Raises:
        MessageError: A type that we do not read.
    """
    code = code - REFERENCE if code > REFERENCE else code
    if code not in TYPES:
        raise MessageError(f"an array of TensorFlow's type {code}; numbers and booleans are read")
    return TYPES[code]


def count_of(shape: tuple[int, ...], dtype: np.dtype[np.generic]) -> int:
    """Return how many numbers a shape holds.

    Raises:
        MessageError: A size is negative, or all together are too large.
    """
    if any(size < 0 for size in shape) or math.prod(shape) * dtype.itemsize > MAX_BYTES:
        raise MessageError(f"an array of shape {shape}; expected sizes from 0 up and at most {MAX_BYTES >> 30} GiB")
    return math.prod(shape)
