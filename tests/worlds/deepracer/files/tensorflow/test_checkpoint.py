"""Checkpoints of TensorFlow's from its own description of them: headers, entries, several data files."""

import numpy as np
import pytest
from tests.worlds.deepracer.files.tensorflow.wire import bytes_field, fixed32_field, shape_message, varint_field

from racecraft.worlds.deepracer.files.tensorflow import checkpoint
from racecraft.worlds.deepracer.files.tensorflow.checkpoint import (
    TensorFlowCheckpointError,
    read_checkpoint,
    write_checkpoint,
)
from racecraft.worlds.deepracer.files.tensorflow.table import masked_crc32c, read_table, write_table

ROW = np.array([1.5, -2, 3], np.float32)


def header(shards, *parts):
    return varint_field(1, shards) + b"".join(parts)


def entry(data, shape, code=1, shard=0, offset=0, size=None, checksum=None):
    """`BundleEntryProto`: 1 type, 2 shape, 3 shard, 4 offset, 5 size, 6 checksum; what is 0 is left out."""
    told = [varint_field(1, code), bytes_field(2, shape_message(shape))]
    told += [varint_field(number, value) for number, value in ((3, shard), (4, offset)) if value]
    told.append(varint_field(5, len(data) if size is None else size))
    return b"".join(told) + fixed32_field(6, masked_crc32c(data) if checksum is None else checksum)


def laid(folder, entries, *data, head=None):
    """Write a checkpoint of so many data files and return its name."""
    table = {b"": header(len(data)) if head is None else head, **entries}
    there = {key: value for key, value in table.items() if value is not None}
    (folder / "m.ckpt.index").write_bytes(write_table(there))
    for number, part in enumerate(data):
        (folder / f"m.ckpt.data-{number:05}-of-{len(data):05}").write_bytes(part)
    return folder / "m.ckpt"


def test_what_is_written_comes_back_whatever_way_it_lay(tmp_path):
    arrays = {
        "b": np.arange(6, dtype=np.int64).reshape(2, 3).T, "a": ROW, "big": np.array([1, 2], ">f8"),
        "none": np.zeros((0, 2), np.float32), "one": np.float32(7), "yes": np.array([True, False]),
    }  # fmt: skip
    write_checkpoint(tmp_path / "m.ckpt", arrays)
    for name in ("m.ckpt", "m.ckpt.index"):
        read = read_checkpoint(tmp_path / name)
        assert list(read) == sorted(arrays)
        for one, array in arrays.items():
            np.testing.assert_array_equal(read[one], array)
            assert read[one].dtype == np.asarray(array).dtype.newbyteorder("<")
    assert list(read_checkpoint(tmp_path / "m.ckpt", lambda name: "e" in name)) == ["none", "one", "yes"]


def test_arrays_lie_behind_each_other_in_the_order_of_their_names_and_the_index_says_where(tmp_path):
    """The header: one data file, and version 1 of what writes bundles (`VersionDef.producer`)."""
    write_checkpoint(tmp_path / "m.ckpt", {"b": np.int32([[7]]), "a": ROW})
    assert (tmp_path / "m.ckpt.data-00000-of-00001").read_bytes() == ROW.tobytes() + b"\7\0\0\0"
    assert read_table((tmp_path / "m.ckpt.index").read_bytes()) == {
        b"": bytes.fromhex("0801 1a020801"),
        b"a": entry(ROW.tobytes(), (3,)),
        b"b": entry(b"\7\0\0\0", (1, 1), code=3, offset=12),
    }


def test_the_index_is_written_last(tmp_path, monkeypatch):
    order = []
    monkeypatch.setattr(checkpoint, "write_atomic", lambda path, data: order.append(path))
    write_checkpoint(tmp_path / "m", {"a": ROW})
    assert order == [f"{tmp_path}/m.data-00000-of-00001", f"{tmp_path}/m.index"]


def test_arrays_are_found_in_several_data_files_and_texts_are_passed_over(tmp_path):
    """Seven is TensorFlow's number for texts, whose bytes nobody looks at."""
    first, second = b"....", ROW.tobytes()
    entries = {
        b"a": entry(second, (3,), shard=1), b"b": entry(second[4:], (2,), shard=1, offset=4),
        b"t": entry(first, (1,), code=7, checksum=1), b"u": entry(first, (4,), code=4),
    }  # fmt: skip
    read = read_checkpoint(laid(tmp_path, entries, first, second))
    assert {name: array.tolist() for name, array in read.items()} == {
        "a": [1.5, -2, 3], "b": [-2, 3], "u": [46, 46, 46, 46],
    }  # fmt: skip


ROW_BYTES = ROW.tobytes()
BAD = {
    "no header": ({b"": None}, "it has no header"),
    "no data file": ({b"": header(0)}, "it claims 0 data files"),
    "slices": ({b"a": entry(ROW_BYTES, (3,)) + bytes_field(7, b"")}, "a lies in slices"),
    "another shape": ({b"a": entry(ROW_BYTES, (4,))}, r"a of shape \(4,\) claims 12 bytes at 0 of data file 0"),
    "a file that is none": ({b"a": entry(ROW_BYTES, (3,), shard=1)}, "of data file 1"),
    "behind the end": ({b"a": entry(ROW_BYTES, (3,), offset=1)}, r"ends before a does \(byte 13\)"),
    "a name of no UTF-8": ({b"\xff": entry(ROW_BYTES, (3,))}, "damaged, or no index"),
    "a shape that ends early": ({b"a": varint_field(1, 1) + b"\x12\x05a"}, "5 bytes are no BundleEntryProto"),
}


@pytest.mark.parametrize("case", BAD)
def test_an_index_that_claims_what_is_not_there_is_refused(tmp_path, case):
    entries, letter = BAD[case]
    with pytest.raises(TensorFlowCheckpointError, match=letter):
        read_checkpoint(laid(tmp_path, entries, ROW_BYTES))


def test_an_index_that_cannot_be_read_or_is_too_large_is_refused(tmp_path, monkeypatch):
    (tmp_path / "folder.index").mkdir()
    with pytest.raises(TensorFlowCheckpointError, match=r"folder\.index: cannot be read \(Is a directory\)"):
        read_checkpoint(tmp_path / "folder")
    with pytest.raises(TensorFlowCheckpointError, match=r"gone\.index: there is no such file"):
        read_checkpoint(tmp_path / "gone")
    name = laid(tmp_path, {b"a": entry(ROW_BYTES, (3,))}, ROW_BYTES)
    size = (tmp_path / "m.ckpt.index").stat().st_size
    monkeypatch.setattr(checkpoint, "MAX_INDEX_BYTES", size)
    assert list(read_checkpoint(name)) == ["a"]
    monkeypatch.setattr(checkpoint, "MAX_INDEX_BYTES", size - 1)
    with pytest.raises(TensorFlowCheckpointError, match=rf"{size} bytes long; expected an index of a few kilobytes"):
        read_checkpoint(name)
