"""Arrays in messages: by their bytes, or number by number as TensorFlow writes small ones."""

import struct

import numpy as np
import pytest
from tests.worlds.deepracer.files.tensorflow.wire import bytes_field, float_field, shape_message, varint_field

from racecraft.formats.protobuf_messages import MessageError, parsed, varint
from racecraft.worlds.deepracer.files.tensorflow.messages import load
from racecraft.worlds.deepracer.files.tensorflow.tensors import (
    count_of,
    dtype_of,
    read_shape,
    read_tensor,
    write_shape,
    write_tensor,
)

CODES = {
    "float32": 1, "float64": 2, "int32": 3, "uint8": 4, "int16": 5, "int8": 6, "int64": 9, "bool": 10, "float16": 19,
}  # fmt: skip
"""`DT_FLOAT` to `DT_HALF` in TensorFlow's `types.proto`."""


def tensor(data):
    return parsed(load().TensorProto, data)


def shape(data):
    return parsed(load().TensorShapeProto, data)


def message(code, sizes, *parts):
    return tensor(varint_field(1, code) + bytes_field(2, shape_message(sizes)) + b"".join(parts))


def written(array):
    into = load().TensorProto()
    write_tensor(into, array)
    return into.SerializeToString()


@pytest.mark.parametrize("name", CODES)
def test_every_type_has_its_code_and_comes_back(name):
    array = np.array([[0, 1, 1], [1, 0, 1]], name)
    data = written(array)
    assert data[:2] == bytes([0x08, CODES[name]])
    read = read_tensor(tensor(data))
    assert (read.dtype, read.tolist()) == (np.dtype(name), array.tolist())
    assert dtype_of(CODES[name]) == dtype_of(100 + CODES[name]) == np.dtype(name), "a variable itself, of TensorFlow 1"


def test_an_array_is_its_type_its_shape_and_its_bytes():
    """Fields 1, 2 and 4 of `tensor.proto`, worked out by hand."""
    expected = "0801" + "1208" + "12020802" + "12020801" + "2208" + "0000803f" + "000000c0"
    assert written(np.float32([[1], [-2]])).hex() == expected
    assert written(np.array([[1], [-2]], ">f4")).hex() == expected, "whatever way its bytes lie here"


def packed(*numbers):
    return b"".join(varint(number % 2**64) for number in numbers)


ONE_BY_ONE = {  # fields of `tensor.proto`: 5 float_val, 6 double_val, 7 int_val, 10 int64_val, 11 bool_val
    "floats": ("float32", [float_field(5, 1.5), float_field(5, -2), float_field(5, 3)], [1.5, -2, 3]),
    "packed floats": ("float32", [bytes_field(5, struct.pack("<3f", 1.5, -2, 3))], [1.5, -2, 3]),
    "doubles": ("float64", [b"\x31" + struct.pack("<d", number) for number in (0.1, -2, 3)], [0.1, -2, 3]),
    "ints": ("int32", [varint_field(7, 300), varint_field(7, -2), varint_field(7, 3)], [300, -2, 3]),
    "long ints": ("int64", [bytes_field(10, packed(2**40, -(2**40), 3))], [2**40, -(2**40), 3]),
    "booleans": ("bool", [bytes_field(11, packed(1, 0, 1))], [True, False, True]),
    "the last one fills": ("float32", [float_field(5, 1.5), float_field(5, -2)], [1.5, -2, -2]),
    "one fills all": ("int32", [varint_field(7, 4)], [4, 4, 4]),
    "none is nothing": ("int32", [], [0, 0, 0]),
}


@pytest.mark.parametrize("case", ONE_BY_ONE)
def test_numbers_that_stand_one_by_one_are_read(case):
    name, parts, expected = ONE_BY_ONE[case]
    read = read_tensor(message(CODES[name], (3,), *parts))
    assert (read.dtype, read.tolist()) == (np.dtype(name), expected)


def test_an_array_without_a_shape_is_one_number():
    read = read_tensor(message(1, (), float_field(5, 2.5)))
    assert (read.shape, read.item()) == ((), 2.5)
    assert read_tensor(message(1, (0, 3))).shape == (0, 3)


@pytest.mark.parametrize(
    ("spoilt", "letter"),
    [
        (message(1, (2,), bytes_field(4, b"\0" * 7)), r"of shape \(2,\) holds 7 bytes, not 8"),
        (message(3, (2,), bytes_field(7, b"\1\2\3")), r"of shape \(2,\) holds 3 numbers"),
        (message(7, (1,), bytes_field(8, b"a")), "type 7; numbers"),
    ],
)
def test_an_array_that_is_none_is_refused(spoilt, letter):
    with pytest.raises(MessageError, match=letter):
        read_tensor(spoilt)


def test_eight_dimensions_are_read_and_nine_are_not():
    """What is no dimension in a shape, such as its name, is passed over."""
    sizes = (1, 2, 3, 4, 5, 6, 7, 8)
    into = load().TensorShapeProto()
    write_shape(into, sizes)
    assert into.SerializeToString() == shape_message(sizes)
    assert read_shape(shape(varint_field(3, 1) + shape_message(sizes))) == sizes
    with pytest.raises(MessageError, match="more than 8 dimensions"):
        read_shape(shape(shape_message((*sizes, 1))))
    named = bytes_field(2, varint_field(1, 5) + bytes_field(2, b"name"))
    assert read_shape(shape(named)) == (5,)


def test_two_gibibytes_are_an_array_and_more_are_none():
    assert count_of((2**14, 2**15), np.dtype("f4")) == 2**29
    assert count_of((2**28,), np.dtype("f8")) == 2**28
    assert count_of((0, 2**40), np.dtype("f4")) == 0
    for shape, dtype in (((2**29 + 1,), "f4"), ((2**28 + 1,), "f8"), ((-1,), "f4"), ((2, -1), "f4")):
        with pytest.raises(MessageError, match="from 0 up and at most 2 GiB"):
            count_of(shape, np.dtype(dtype))
