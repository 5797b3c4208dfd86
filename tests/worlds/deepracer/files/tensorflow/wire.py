"""Fields of messages, byte by byte: what protobuf makes of a table is held against these."""

import struct

from racecraft.formats.protobuf_messages import varint


def varint_field(number, value):
    """Return a field with a number; negative ones wrap round at 64 bits."""
    return varint(number << 3) + varint(value % 2**64)


def bytes_field(number, value):
    """Return a field with bytes, a text, or a message that is already written."""
    data = value.encode() if isinstance(value, str) else value
    return varint(number << 3 | 2) + varint(len(data)) + data


def fixed32_field(number, value):
    """Return a field of 32 bits."""
    return varint(number << 3 | 5) + struct.pack("<I", value)


def float_field(number, value):
    """Return a field with a float32."""
    return varint(number << 3 | 5) + struct.pack("<f", value)


def shape_message(sizes):
    """Return a `TensorShapeProto`."""
    return b"".join(bytes_field(2, varint_field(1, size)) for size in sizes)
