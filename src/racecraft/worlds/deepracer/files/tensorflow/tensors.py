"""An array in a message: TensorFlow's `TensorProto`, its shapes and its number types. Begin with `read_tensor`.

Source: facts: TensorFlow's `tensor.proto`, `tensor_shape.proto`, `types.proto` (field numbers, codes of types).
"""

from __future__ import annotations

import math
import struct

import numpy as np

from racecraft.contract.world import Array
from racecraft.worlds.deepracer.files.tensorflow.wire import (
    Value,
    WireError,
    as_bytes,
    as_number,
    as_signed,
    bytes_field,
    fields,
    read_varint,
    varint_field,
)

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
MOST_DIMENSIONS = 8
MOST_BYTES = 2**31
"""Of one array: a message can hold no more."""

_REPEATED = {FLOAT: 5, DOUBLE: 6, INT32: 7, INT64: 10, BOOL: 11}
"""Fields that hold numbers one by one, by type."""


def read_tensor(message: memoryview) -> Array:
    """Return the array in a `TensorProto`; where numbers stand one by one, the last one fills what is left.

    Raises:
        WireError: A type we do not read, a size that is too large, or other bytes than the shape asks for.
    """
    code, content = 0, memoryview(b"")
    shape: tuple[int, ...] = ()
    singles: list[float | int] = []
    repeated: list[tuple[int, Value]] = []
    for number, value in fields(message):
        if number == 1:
            code = as_number(value, "an array's type")
        elif number == 2:
            shape = read_shape(as_bytes(value, "an array's shape"))
        elif number == 4:
            content = as_bytes(value, "an array's content")
        elif number in _REPEATED.values():
            repeated.append((number, value))
    dtype = dtype_of(code)
    count = count_of(shape, dtype)
    if len(content):
        if len(content) != count * dtype.itemsize:
            raise WireError(f"an array of shape {shape} holds {len(content)} bytes, not {count * dtype.itemsize}")
        return np.frombuffer(content, dtype).reshape(shape)
    for number, value in repeated:
        if number == _REPEATED.get(code):
            singles += _numbers(code, value)
    if len(singles) > count:
        raise WireError(f"an array of shape {shape} holds {len(singles)} numbers")
    array = np.zeros(count, dtype)
    if singles:
        array[: len(singles)] = singles
        array[len(singles) :] = singles[-1]
    return array.reshape(shape)


def write_tensor(array: Array) -> bytes:
    """Return an array as a `TensorProto`."""
    array = little_endian(array)
    head = varint_field(1, CODES[array.dtype]) + bytes_field(2, write_shape(array.shape))
    return head + bytes_field(4, array.tobytes())


def little_endian(array: Array) -> Array:
    """Return an array whose bytes lie as TensorFlow's files have them; where they do already, itself."""
    array = np.asarray(array)
    return array.astype(array.dtype.newbyteorder("<"), copy=False)


def read_shape(message: memoryview) -> tuple[int, ...]:
    """Return a `TensorShapeProto`'s sizes; -1 is one that is left open.

    Raises:
        WireError: More dimensions than any array of a car's network has.
    """
    sizes: list[int] = []
    for number, value in fields(message):
        if number != 2:
            continue
        size = 0
        for inner, told in fields(as_bytes(value, "a dimension")):
            size = as_signed(told, "a size") if inner == 1 else size
        sizes.append(size)
        if len(sizes) > MOST_DIMENSIONS:
            raise WireError(f"a shape of more than {MOST_DIMENSIONS} dimensions")
    return tuple(sizes)


def write_shape(shape: tuple[int, ...]) -> bytes:
    """Return sizes as a `TensorShapeProto`; -1 leaves one open."""
    return b"".join(bytes_field(2, varint_field(1, size)) for size in shape)


def dtype_of(code: int) -> np.dtype[np.generic]:
    """Return NumPy's type of TensorFlow's code.

    Raises:
        WireError: A type that we do not read.
    """
    code = code - REFERENCE if code > REFERENCE else code
    if code not in TYPES:
        raise WireError(f"an array of TensorFlow's type {code}; numbers and booleans are read")
    return TYPES[code]


def count_of(shape: tuple[int, ...], dtype: np.dtype[np.generic]) -> int:
    """Return how many numbers a shape holds.

    Raises:
        WireError: A size is negative, or all together are too large.
    """
    if any(size < 0 for size in shape) or math.prod(shape) * dtype.itemsize > MOST_BYTES:
        raise WireError(f"an array of shape {shape}; expected sizes from 0 up and at most {MOST_BYTES >> 30} GiB")
    return math.prod(shape)


def _numbers(code: int, value: Value) -> list[float | int]:
    """Return the numbers of a repeated field, packed or not."""
    if isinstance(value, int):
        width = {FLOAT: "<f", DOUBLE: "<d"}.get(code)
        if width is None:
            return [as_signed(value, "a number")]
        (single,) = struct.unpack(width, value.to_bytes(struct.calcsize(width), "little"))
        return [single]
    if code in (FLOAT, DOUBLE):
        dtype = TYPES[code]
        if len(value) % dtype.itemsize:
            raise WireError(f"{len(value)} bytes of packed numbers of {dtype.itemsize} bytes each")
        return list(np.frombuffer(value, dtype).tolist())
    numbers: list[float | int] = []
    at = 0
    while at < len(value):
        number, at = read_varint(value, at)
        numbers.append(as_signed(number, "a number"))
    return numbers
