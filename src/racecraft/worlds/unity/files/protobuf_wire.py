"""Protobuf's bytes without protobuf: enough to read files whose messages are known by number.

Begin at `read_fields`. A message is a row of fields, each a number, a kind and a value: a varint, four or eight bytes,
or a length and that many bytes (protobuf.dev, "Encoding").
"""

from __future__ import annotations

import struct
from collections.abc import Iterator

import numpy as np

from racecraft.contract.world import Array

VARINT, EIGHT_BYTES, BYTES, FOUR_BYTES = 0, 1, 2, 5


class Fields(dict[int, list[int | bytes]]):
    """A message's values by field number, in the order of the file; readers give proto3's default where none stands."""

    def whole(self, number: int) -> int:
        """Return an int32, enum or bool."""
        value = self[number][-1] if number in self else 0
        if isinstance(value, bytes):
            raise ValueError(f"field {number} should be a whole number and is {len(value)} bytes")
        return _signed(value)

    def decimal(self, number: int) -> float:
        """Return a float."""
        value: float = struct.unpack("<f", self._sized(number, 4))[0] if number in self else 0.0
        return value

    def data(self, number: int) -> bytes:
        """Return bytes, or a nested message's."""
        value = self[number][-1] if number in self else b""
        if not isinstance(value, bytes):
            raise ValueError(f"field {number} should be bytes and is the number {value}")
        return value

    def text(self, number: int) -> str:
        """Return a string."""
        return self.data(number).decode("utf-8", errors="replace")

    def messages(self, number: int) -> list[Fields]:
        """Return nested messages."""
        parts = self.get(number, [])
        if not all(isinstance(part, bytes) for part in parts):
            raise ValueError(f"field {number} should be messages and holds numbers")
        return [read_fields(part) for part in parts if isinstance(part, bytes)]

    def wholes(self, number: int) -> list[int]:
        """Return repeated int32s, enums or bools, packed or not."""
        found: list[int] = []
        for value in self.get(number, []):
            found += [_signed(one) for one in _varints(value)] if isinstance(value, bytes) else [_signed(value)]
        return found

    def decimals(self, number: int) -> Array:
        """Return repeated floats, float32 (n,), packed or not: both are four bytes each."""
        parts = [part for part in self.get(number, []) if isinstance(part, bytes)]
        data = b"".join(parts)
        if len(parts) != len(self.get(number, [])) or len(data) % 4:
            raise ValueError(f"field {number} should be floats of four bytes each and is not")
        return np.frombuffer(data, "<f4").astype(np.float32)

    def _sized(self, number: int, size: int) -> bytes:
        data = self.data(number)
        if len(data) != size:
            raise ValueError(f"field {number} should be {size} bytes and is {len(data)}")
        return data


def read_fields(data: bytes) -> Fields:
    r"""Return the fields of a message.

    Raises:
        ValueError: The bytes are cut, or no protobuf message.

    >>> read_fields(b"\x08\x96\x01").whole(1)
    150
    """
    fields, at = Fields(), 0
    while at < len(data):
        key, at = read_varint(data, at)
        number, kind = key >> 3, key & 7
        value: int | bytes
        if kind == VARINT:
            value, at = read_varint(data, at)
        elif kind in (BYTES, FOUR_BYTES, EIGHT_BYTES):
            size, at = read_varint(data, at) if kind == BYTES else ({FOUR_BYTES: 4, EIGHT_BYTES: 8}[kind], at)
            if size > len(data) - at:
                raise ValueError(f"field {number} claims {size} bytes where {len(data) - at} are left")
            value, at = data[at : at + size], at + size
        else:
            raise ValueError(f"field {number} is of kind {kind}, which no message here uses")
        if number == 0:
            raise ValueError("a field has the number 0")
        fields.setdefault(number, []).append(value)
    return fields


def read_varint(data: bytes, at: int) -> tuple[int, int]:
    """Return a varint, its lowest 64 bits as protobuf's own readers take them, and the place behind it.

    Raises:
        ValueError: The bytes end in it, or it is longer than ten bytes.
    """
    number = 0
    for place in range(10):
        if at >= len(data):
            raise ValueError("the bytes end in the middle of a number")
        byte = data[at]
        at += 1
        number |= (byte & 0x7F) << (7 * place)
        if byte < 0x80:
            return number & 0xFFFF_FFFF_FFFF_FFFF, at
    raise ValueError("a number is longer than ten bytes")


def _varints(data: bytes) -> Iterator[int]:
    at = 0
    while at < len(data):
        number, at = read_varint(data, at)
        yield number


def _signed(number: int) -> int:
    """Return a varint as the int32 or int64 that it was: negative ones are written as 64 bits."""
    return number - 2**64 if number >= 2**63 else number
