"""Protocol-buffer messages as fields, for the few messages of TensorFlow that we read and write. Begin with `fields`.

A message is a row of (number, value): a varint is an int, everything with a length is a view on the bytes, numbers of
fixed width are ints of 32 or 64 bits. What a field means is its reader's affair.

Source: facts: the encoding page of the protocol-buffers documentation.
"""

from __future__ import annotations

import struct
from collections.abc import Iterator

VARINT, FIXED64, LENGTH, FIXED32 = 0, 1, 2, 5
_MOST_VARINT_BYTES = 10


class WireError(ValueError):
    """Bytes that are no such message; the text says what was found where."""


Value = int | memoryview


def fields(message: memoryview | bytes) -> Iterator[tuple[int, Value]]:
    """Yield (number, value) of every field, in the order of the file.

    Raises:
        WireError: The bytes end in the middle of a field, or are no message.

    >>> [(number, value) for number, value in fields(varint_field(1, 300) + varint_field(2, 7))]
    [(1, 300), (2, 7)]
    """
    view, at = memoryview(message), 0
    while at < len(view):
        key, at = read_varint(view, at)
        number, kind = key >> 3, key & 7
        if number == 0:
            raise WireError(f"field number 0 at byte {at}")
        if kind == VARINT:
            value, at = read_varint(view, at)
            yield number, value
            continue
        if kind == LENGTH:
            length, at = read_varint(view, at)
        elif kind in (FIXED32, FIXED64):
            length = 4 if kind == FIXED32 else 8
        else:
            raise WireError(f"field {number} is of the unknown wire type {kind} at byte {at}")
        if length > len(view) - at:
            raise WireError(f"field {number} claims {length} bytes at byte {at}, {len(view) - at} are left")
        part = view[at : at + length]
        at += length
        yield number, part if kind == LENGTH else int.from_bytes(part, "little")


def read_varint(view: memoryview | bytes, at: int) -> tuple[int, int]:
    """Return (value, place behind it) of the varint at a place; values are taken as unsigned, 64 bits.

    Raises:
        WireError: The bytes end within it, or it goes on for more than ten.
    """
    value = 0
    for step in range(_MOST_VARINT_BYTES):
        if at + step >= len(view):
            raise WireError(f"the bytes end in the middle of a number at byte {at}")
        byte = view[at + step]
        value |= (byte & 0x7F) << (7 * step)
        if byte < 0x80:
            return value & 0xFFFFFFFFFFFFFFFF, at + step + 1
    raise WireError(f"a number of more than {_MOST_VARINT_BYTES} bytes at byte {at}")


def as_number(value: Value, what: str) -> int:
    """Return a field's unsigned number.

    Raises:
        WireError: The field holds bytes.
    """
    if not isinstance(value, int):
        raise WireError(f"{what} is bytes where a number belongs")
    return value


def as_signed(value: Value, what: str) -> int:
    """Return a field's number as int64, where negative ones wrap round.

    >>> as_signed(2**64 - 1, "a size")
    -1
    """
    number = as_number(value, what)
    return number - (1 << 64) if number >> 63 else number


def as_bytes(value: Value, what: str) -> memoryview:
    """Return a field's bytes.

    Raises:
        WireError: The field holds a number.
    """
    if isinstance(value, int):
        raise WireError(f"{what} is a number where bytes belong")
    return value


def as_text(value: Value, what: str) -> str:
    """Return a field's text.

    Raises:
        WireError: The field holds a number, or bytes that are no UTF-8.
    """
    try:
        return bytes(as_bytes(value, what)).decode("utf-8")
    except UnicodeDecodeError as error:
        raise WireError(f"{what} is no UTF-8 text") from error


def as_float(value: Value, what: str) -> float:
    """Return a field of fixed width as float32."""
    (number,) = struct.unpack("<f", struct.pack("<I", as_number(value, what) & 0xFFFFFFFF))
    return float(number)


def varint(value: int) -> bytes:
    """Return a number as a varint; negative ones wrap round at 64 bits.

    >>> varint(300).hex(), len(varint(-1))
    ('ac02', 10)
    """
    value &= 0xFFFFFFFFFFFFFFFF
    out = bytearray()
    while value >= 0x80:
        out.append(value & 0x7F | 0x80)
        value >>= 7
    out.append(value)
    return bytes(out)


def varint_field(number: int, value: int) -> bytes:
    """Return a field with a number."""
    return varint(number << 3 | VARINT) + varint(value)


def bytes_field(number: int, value: bytes | str) -> bytes:
    """Return a field with bytes, a text, or a message that is already written."""
    data = value.encode() if isinstance(value, str) else value
    return varint(number << 3 | LENGTH) + varint(len(data)) + data


def fixed32_field(number: int, value: int) -> bytes:
    """Return a field of 32 bits."""
    return varint(number << 3 | FIXED32) + struct.pack("<I", value)


def float_field(number: int, value: float) -> bytes:
    """Return a field with a float32."""
    return varint(number << 3 | FIXED32) + struct.pack("<f", value)
