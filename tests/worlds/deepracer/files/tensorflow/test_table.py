"""Tables of keys and values, byte by byte: what LevelDB's description of the format says, worked out by hand."""

import struct

import pytest

from racecraft.formats.protobuf_messages import MessageError, read_varint, varint
from racecraft.worlds.deepracer.files.tensorflow.table import (
    BLOCK_BYTES,
    RESTART_EVERY,
    masked_crc32c,
    read_table,
    write_table,
)


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


def put(content, kind=b"\0"):
    """A block with what stands behind it."""
    return content + kind + struct.pack("<I", masked_crc32c(content + kind))


def block(*rows, restarts=(0,)):
    """A block's content from (shared, new key, value)."""
    told = b"".join(bytes([shared, len(new), len(value)]) + new + value for shared, new, value in rows)
    return told + struct.pack(f"<{len(restarts) + 1}I", *restarts, len(restarts))


def table(content):
    """A table of one data block, whatever that holds."""
    out = put(content)
    place = len(out)
    pointers = block((0, b"z", bytes([0, len(content)])))
    return out + put(pointers) + bytes([0, 0, place, len(pointers)]).ljust(40, b"\0") + MAGIC_BYTES


MAGIC_BYTES = bytes.fromhex("57fb808b247547db")
"""The last eight bytes of every table, by LevelDB's description."""


def test_a_table_of_one_entry_byte_by_byte():
    """A data block of 13 bytes, five bytes behind it, the empty block of statistics, the pointers, the footer."""
    rows = "00 01 01 61 31" + "00000000 01000000"
    nothing = "00000000 01000000"
    pointers = "00 01 02 61 00 0d" + "00000000 01000000"
    footer = bytes.fromhex("12 08" + "1f 0e").ljust(40, b"\0") + MAGIC_BYTES
    expected = b"".join(put(bytes.fromhex(part)) for part in (rows, nothing, pointers)) + footer
    assert write_table({b"a": b"1"}) == expected
    assert len(expected) == 18 + 13 + 19 + 48
    assert read_table(expected) == {b"a": b"1"}


def pointers_of(data):
    """Return the rows of the index and where full keys stand in it, as the footer says where it lies."""
    numbers, at = [], 0
    for _ in range(4):
        number, at = read_varint(data[-48:], at)
        numbers.append(number)
    return block_at(data, *numbers[2:])


@pytest.mark.parametrize(("size", "blocks"), [(4090, [b"b"]), (4091, [b"a", b"b"])])
def test_a_block_is_closed_as_soon_as_it_holds_4096_bytes(size, blocks):
    """Of the first entry five bytes are no value: what is shared, the key's length, two of the value's, the key."""
    rows, restarts = pointers_of(write_table({b"a": bytes(size), b"b": b"2"}))
    assert [key for _, _, key, _ in rows] == blocks
    first = size + 5 + 8 if len(blocks) == 2 else size + 5 + 5 + 8
    assert rows[0][3] == varint(0) + varint(first)
    assert [shared for _, shared, _, _ in rows] == [0] * len(rows), "every pointer has its key whole"
    assert list(restarts) == [row[0] for row in rows]


GOOD = {
    "no entry": (block(), {}),
    "no entry and no full key": (bytes(4), {}),
    "a key that goes on": (block((0, b"a", b"1"), (1, b"b", b"2")), {b"a": b"1", b"ab": b"2"}),
    "a value of nothing": (block((0, b"ab", b"1"), (1, b"c", b"")), {b"ab": b"1", b"ac": b""}),
}


@pytest.mark.parametrize("case", GOOD)
def test_blocks_of_others_are_read(case):
    content, expected = GOOD[case]
    assert read_table(table(content)) == expected


BAD = {
    "three bytes": (bytes(3), "a block of fewer than 4 bytes"),
    "more full keys than room": (struct.pack("<I", 1), "a block of 4 bytes claims 1 full keys"),
    "more shared than there is": (block((0, b"a", b"1"), (2, b"b", b"2")), "an entry at byte 8 reaches beyond"),
    "shared with nothing": (block((1, b"a", b"1")), "an entry at byte 3 reaches beyond its block"),
    "a value beyond the end": (b"\0\1\2a1" + bytes(4) + b"\1\0\0\0", "an entry at byte 3 reaches beyond its block"),
    "a key beyond the end": (b"\0\3\0a1" + bytes(4) + b"\1\0\0\0", "an entry at byte 3 reaches beyond its block"),
}


@pytest.mark.parametrize("case", BAD)
def test_a_block_that_claims_what_it_has_not_is_refused(case):
    content, letter = BAD[case]
    with pytest.raises(MessageError, match=letter):
        read_table(table(content))


def test_the_end_of_a_table_has_48_bytes_and_its_mark():
    for data in (b"", MAGIC_BYTES, bytes(39) + MAGIC_BYTES, write_table({})[:-1], bytes(100)):
        with pytest.raises(MessageError, match="the end of a table is missing"):
            read_table(data)
    with pytest.raises(MessageError, match="a block of 0 bytes at byte 0 reaches beyond the end"):
        read_table(bytes(40) + MAGIC_BYTES)


def test_as_many_entries_are_read_as_there_may_be_and_no_more(monkeypatch):
    monkeypatch.setattr("racecraft.worlds.deepracer.files.tensorflow.table.MAX_ENTRIES", 3)
    assert len(read_table(write_table(keys(3)))) == 3
    with pytest.raises(MessageError, match="more than 3 entries"):
        read_table(write_table(keys(4)))
