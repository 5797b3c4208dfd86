"""Sorted tables of keys and values, as LevelDB writes them: what a `.index` file is. Begin with `read_table`.

::

    data block …    index block: last key of each data block -> where it lies    footer (48 bytes)

A block is a row of (bytes shared with the key before, bytes that are new, bytes of value, the new bytes, the value),
then where the full keys stand, how many of them, one byte for the compression and a checksum over it all.

Source: facts: LevelDB's `table_format.md` and `crc32c.h` (the mask); TensorFlow's `lib/io/format.cc` writes the same.
"""

from __future__ import annotations

import struct
from collections.abc import Mapping

import google_crc32c

from racecraft.contract.world import Array
from racecraft.formats.protobuf_messages import MessageError, read_varint, varint

FOOTER_BYTES = 48
MAGIC = 0xDB4775248B80FB57
MAX_ENTRIES = 100_000
RESTART_EVERY = 16
BLOCK_BYTES = 4096
"""A data block is closed when it grows beyond this."""
_TRAILER = 5
_MASK = 0xA282EAD8


def masked_crc32c(data: bytes | Array) -> int:
    """Return the CRC-32C of bytes as LevelDB stores it: rotated by 15 bits, and a constant added.

    >>> hex(masked_crc32c(b"123456789"))
    '0xc78ab0e5'
    """
    crc = google_crc32c.value(data)
    return ((crc >> 15 | crc << 17) + _MASK) & 0xFFFFFFFF


def read_table(data: bytes) -> dict[bytes, bytes]:
    """Return the entries of a table, in their order.

    Raises:
        MessageError: The bytes are no such table, or damaged.
    """
    if len(data) < FOOTER_BYTES or struct.unpack("<Q", data[-8:])[0] != MAGIC:
        raise MessageError("the end of a table is missing")
    footer = memoryview(data)[-FOOTER_BYTES:]
    at = 0
    for _ in range(2):  # where the block of statistics lies: nothing of it is needed
        _, at = read_varint(footer, at)
    handle = footer[at:]
    entries: dict[bytes, bytes] = {}
    for _, place in _entries(_block(data, handle)):
        for key, value in _entries(_block(data, memoryview(place))):
            if len(entries) >= MAX_ENTRIES:
                raise MessageError(f"a table of more than {MAX_ENTRIES} entries")
            entries[key] = value
    return entries


def write_table(entries: Mapping[bytes, bytes]) -> bytes:
    """Return entries as a table; keys are sorted here."""
    out, index, block = bytearray(), [], _Block()
    for key in sorted(entries):
        block.add(key, entries[key])
        if len(block.data) >= BLOCK_BYTES:
            index.append((key, _put(out, block)))
            block = _Block()
    if block.count:
        index.append((max(entries), _put(out, block)))
    statistics = _put(out, _Block())
    pointers = _Block(restart_every=1)
    for key, handle in index:
        pointers.add(key, handle)
    footer = statistics + _put(out, pointers)
    return bytes(out) + footer.ljust(FOOTER_BYTES - 8, b"\0") + struct.pack("<Q", MAGIC)


def _block(data: bytes, handle: memoryview) -> memoryview:
    """Return the content of the block that a handle (offset, size) names."""
    offset, at = read_varint(handle, 0)
    size, _ = read_varint(handle, at)
    if offset + size + _TRAILER > len(data) - FOOTER_BYTES:
        raise MessageError(f"a block of {size} bytes at byte {offset} reaches beyond the end")
    content = memoryview(data)[offset : offset + size]
    kind, checksum = struct.unpack_from("<BI", data, offset + size)
    if kind != 0:
        raise MessageError(f"a block compressed in way {kind}; TensorFlow's own checkpoints are not compressed")
    if masked_crc32c(bytes(data[offset : offset + size + 1])) != checksum:
        raise MessageError(f"the checksum of the block at byte {offset} is wrong")
    return content


def _entries(block: memoryview) -> list[tuple[bytes, bytes]]:
    if len(block) < 4:
        raise MessageError("a block of fewer than 4 bytes")
    (restarts,) = struct.unpack_from("<I", block, len(block) - 4)
    end = len(block) - 4 - 4 * restarts
    if end < 0:
        raise MessageError(f"a block of {len(block)} bytes claims {restarts} full keys")
    entries, key, at = [], b"", 0
    while at < end:
        shared, at = read_varint(block, at)
        fresh, at = read_varint(block, at)
        length, at = read_varint(block, at)
        if shared > len(key) or at + fresh + length > end:
            raise MessageError(f"an entry at byte {at} reaches beyond its block")
        key = key[:shared] + bytes(block[at : at + fresh])
        at += fresh
        entries.append((key, bytes(block[at : at + length])))
        at += length
    return entries


class _Block:
    """A block being written."""

    def __init__(self, restart_every: int = RESTART_EVERY) -> None:
        self.data, self.count = bytearray(), 0
        self._every, self._restarts, self._key = restart_every, [0], b""

    def add(self, key: bytes, value: bytes) -> None:
        """Put an entry behind the others."""
        shared = 0
        if self.count and self.count % self._every == 0:
            self._restarts.append(len(self.data))
        elif self.count:
            limit = min(len(key), len(self._key))
            while shared < limit and key[shared] == self._key[shared]:
                shared += 1
        self.data += varint(shared) + varint(len(key) - shared) + varint(len(value)) + key[shared:] + value
        self._key, self.count = key, self.count + 1

    def finished(self) -> bytes:
        """Return the block's content."""
        return bytes(self.data) + struct.pack(f"<{len(self._restarts) + 1}I", *self._restarts, len(self._restarts))


def _put(out: bytearray, block: _Block) -> bytes:
    """Write a block and return its handle."""
    content = block.finished()
    handle = varint(len(out)) + varint(len(content))
    out += content + b"\0" + struct.pack("<I", masked_crc32c(content + b"\0"))
    return handle
