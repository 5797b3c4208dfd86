"""Files of arrays byte by byte, as safetensors' own description has them, and their digest by hand."""

import hashlib
import json
import struct

import numpy as np
import pytest

from racecraft.formats import tensor_file
from racecraft.formats.tensor_file import CheckpointError, digest, read_tensors, write_tensors

ARRAYS = {
    "c": np.array([[1, 2, 3]], np.int8), "b": np.array([1.5, -2], ">f4"), "a": np.float32([3]),
    "d": np.array([7], np.int64), "e": np.zeros((0, 4), np.float16), "f": np.array(True),
}  # fmt: skip


def header_of(data):
    (length,) = struct.unpack_from("<Q", data)
    assert length % 8 == 0, "so that numbers lie where processors like them"
    return json.loads(data[8 : 8 + length]), data[8 + length :]


def test_arrays_lie_from_the_largest_numbers_to_the_smallest_and_by_name(tmp_path):
    write_tensors(tmp_path / "t", "test", ARRAYS, {"n": [1]})
    header, content = header_of((tmp_path / "t").read_bytes())
    told = header.pop("__metadata__")
    assert told == {"format": "test", "version": "1", "digest": digest(read_tensors(tmp_path / "t", "test")[0]),
                    "card": '{"n": [1]}'}  # fmt: skip
    assert header == {
        "d": {"dtype": "I64", "shape": [1], "data_offsets": [0, 8]},
        "a": {"dtype": "F32", "shape": [1], "data_offsets": [8, 12]},
        "b": {"dtype": "F32", "shape": [2], "data_offsets": [12, 20]},
        "e": {"dtype": "F16", "shape": [0, 4], "data_offsets": [20, 20]},
        "c": {"dtype": "I8", "shape": [1, 3], "data_offsets": [20, 23]},
        "f": {"dtype": "BOOL", "shape": [], "data_offsets": [23, 24]},
    }
    assert list(header) == ["d", "a", "b", "e", "c", "f"]
    assert content == struct.pack("<q3f3bB", 7, 3, 1.5, -2, 1, 2, 3, 1)


@pytest.mark.parametrize("length", range(9))
def test_the_header_is_filled_up_whatever_its_length(tmp_path, length):
    write_tensors(tmp_path / "t", "x" * length, {"w": np.ones(1)}, None)
    data = (tmp_path / "t").read_bytes()
    (size,) = struct.unpack_from("<Q", data)
    assert size % 8 == 0
    assert len(data[8 : 8 + size].rstrip(b" ")) > size - 8, "and by no more than it needs"
    assert read_tensors(tmp_path / "t", "x" * length)[1] is None


def test_a_digest_is_over_names_types_shapes_and_bytes_in_the_order_of_names():
    arrays = {"b": np.array([[1, 2]], np.uint8), "a": np.float32([1.5])}
    text = b"a float32 (1,)\n" + struct.pack("<f", 1.5) + b"b uint8 (1, 2)\n\1\2"
    assert digest(arrays) == digest(dict(sorted(arrays.items()))) == hashlib.sha256(text).hexdigest()


def test_rows_that_lie_otherwise_are_written_as_if_they_did_not(tmp_path):
    lying = np.arange(60, dtype=np.float32).reshape(5, 4, 3)
    views = {"turned": lying.transpose(2, 0, 1), "back": lying[::-1, ::-1], "every": lying[:, 1, ::2]}
    views["flat"] = lying[:, 0, 0]
    write_tensors(tmp_path / "t", "test", views, {})
    read, _ = read_tensors(tmp_path / "t", "test")
    for name, view in views.items():
        np.testing.assert_array_equal(read[name], view)


def test_a_file_of_the_next_version_asks_for_a_newer_racecraft(tmp_path, monkeypatch):
    monkeypatch.setattr(tensor_file, "VERSION", 2)
    write_tensors(tmp_path / "t", "test", ARRAYS, {})
    monkeypatch.undo()
    with pytest.raises(CheckpointError, match="t: version 2; expected version 1. Upgrade racecraft"):
        read_tensors(tmp_path / "t", "test")
    with pytest.raises(CheckpointError, match="it says it is 'test'; expected a other in safetensors"):
        read_tensors(tmp_path / "t", "other")
