"""Tables of keys and values, byte by byte: what LevelDB's description of the format says, worked out by hand."""

import struct

import pytest

from racecraft.formats.protobuf_messages import MessageError, read_varint
from racecraft.worlds.deepracer.files.tensorflow.table import BLOCK_BYTES, masked_crc32c, read_table, write_table


def block_at(data, begin, size):
    """Return the rows of a block as (place, shared, new, value), and where full keys stand."""
    content = data[begin : begin + size]
    assert data[begin + size] == 0, "not compressed"
    (count,) = struct.unpack("<I", content[-4:])
    restarts = struct.unpack(f"<{count}I", content[-4 - 4 * count : -4])
    rows, at = [], 0
    while at < size - 4 - 4 * count:
        shared, new, length = content[at : at + 3]  # all below 128: a byte each
        rows.append((at, shared, content[at + 3 : at + 3 + new], content[at + 3 + new : at + 3 + new + length]))
        at += 3 + new + length
    return rows, list(restarts)


def numbers_in(data):
    numbers, at = [], 0
    while at < len(data):
        number, at = read_varint(data, at)
        numbers.append(number)
    return numbers


def test_pointers_bear_a_blocks_last_key_and_in_it_every_sixteenth_stands_whole():
    """Others look a key up by halves, among pointers and then among the keys that stand whole."""
    many = {f"layer/{number:03}".encode(): bytes(100) for number in range(300)}
    data, found = write_table(many), []
    pointers, places = block_at(data, *numbers_in(data[-48:-8])[2:4])
    assert places == [place for place, *_ in pointers], "each pointer's key is whole"
    for _, shared, last, handle in pointers:
        rows, places = block_at(data, *numbers_in(handle))
        assert ({row[1] for row in rows[::16]}, places) == ({0}, [row[0] for row in rows[::16]])
        for _, common, new, _ in rows:
            found.append((found[-1] if found else b"")[:common] + new)
        assert (shared, last) == (0, found[-1])
    assert found == list(many)


def keys(count):
    return {f"layer/{number:03}".encode(): bytes([number]) for number in range(count)}


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


GOOD = {
    "no entry": (block(), {}),
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
    "a value beyond the end": (b"\0\1\2a1" + bytes(4) + b"\1\0\0\0", "an entry at byte 3 reaches beyond its block"),
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
