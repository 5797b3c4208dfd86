"""Tables of keys and values, byte by byte: what LevelDB's description of the format says, worked out by hand."""

import struct

import pytest

from racecraft.formats.tensorflow.table import BLOCK_BYTES, RESTART_EVERY, read_table, write_table


def block_at(data, begin, size):
    """Return the rows of a block as (shared, new, value) and where full keys stand."""
    content = data[begin : begin + size]
    assert data[begin + size] == 0, "not compressed"
    (count,) = struct.unpack("<I", content[-4:])
    restarts = struct.unpack(f"<{count}I", content[-4 - 4 * count : -4])
    rows, at = [], 0
    while at < size - 4 - 4 * count:
        shared, new, length = content[at : at + 3]  # all below 128: a byte each
        rows.append((at, shared, content[at + 3 : at + 3 + new], content[at + 3 + new : at + 3 + new + length]))
        at += 3 + new + length
    return rows, restarts


def keys(count):
    return {f"layer/{number:03}".encode(): bytes([number]) for number in range(count)}


@pytest.mark.parametrize(("count", "full"), [(1, [0]), (15, [0]), (16, [0]), (17, [0, 16]), (33, [0, 16, 32])])
def test_every_sixteenth_key_is_written_whole_and_the_others_by_what_is_new(count, full):
    assert RESTART_EVERY == 16
    data = write_table(keys(count))
    rows, restarts = block_at(data, 0, _first_size(data))
    assert len(rows) == count
    assert [number for number, row in enumerate(rows) if row[1] == 0] == full
    assert list(restarts) == [rows[number][0] for number in full]
    for number, (_, shared, new, value) in enumerate(rows):
        assert b"layer/%03d" % number == (b"layer/%03d" % (number - 1))[:shared] + new
        assert value == bytes([number])


def _first_size(data):
    """The size of the first block, from the index: its key, then a handle (where, how long) as two varints."""
    for size in range(1, len(data)):
        if data[size : size + 1] == b"\0" and size >= 8:
            (count,) = struct.unpack("<I", data[size - 4 : size])
            if 0 < count < 10 and data[size - 4 - 4 * count : size - 4 * count] == b"\0\0\0\0":
                return size
    raise AssertionError("no block")


def test_blocks_are_closed_where_they_grow_large_and_all_entries_come_back_sorted():
    many = {f"{number:04}".encode() * 3: bytes(100) for number in reversed(range(300))}
    data = write_table(many)
    assert len(data) > 5 * BLOCK_BYTES
    assert list(read_table(data).items()) == sorted(many.items())
    assert read_table(write_table({})) == {}
