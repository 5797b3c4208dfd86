"""Protobuf messages, built at run time from a table of fields. Begin with `message_classes`, then `parsed`.

No generated code: that ties a program to the protobuf release that made it. The table becomes a descriptor in a private
pool, so that two packages that describe the same messages do not clash. Works with protobuf 4 to 7, which is imported
when the first table is built.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

_MAX_VARINT_BYTES = 10


class MessageError(ValueError):
    """Bytes are no such message; the text says what was found where."""


def message_classes(package: str, table: Mapping[str, str]) -> dict[str, Any]:
    """Return the class of each message, by name.

    Args:
        package: The package that the messages' full names begin with.
        table: The fields of each message, one word a field: number:name:type. `*` before a type marks a repeated field,
            `{}` a map from string to a message, `/group` behind it a member of a oneof. A type is a message of the
            table or a scalar of proto3. Enums are declared as int32: the bytes are the same, and a number from a later
            version is no error.

    >>> pair = message_classes("example", {"Pair": "1:left:int32 2:names:*string"})["Pair"]
    >>> pair(left=150, names=["a"]).SerializeToString().hex()
    '089601120161'
    """
    from google.protobuf import descriptor_pb2, descriptor_pool, message_factory

    file = descriptor_pb2.FileDescriptorProto(name=f"racecraft_{package}.proto", package=package, syntax="proto3")
    for name, fields in table.items():
        _describe(file.message_type.add(name=name), fields, package, table)
    pool = descriptor_pool.DescriptorPool()
    pool.AddSerializedFile(file.SerializeToString())
    return {name: message_factory.GetMessageClass(pool.FindMessageTypeByName(f"{package}.{name}")) for name in table}


def parsed(kind: Any, data: bytes | memoryview) -> Any:
    """Return the message of a class that bytes hold; fields that the table does not name are passed over.

    Raises:
        MessageError: The bytes end in the middle of a field, or are no message.
    """
    from google.protobuf.message import DecodeError

    try:
        return kind.FromString(bytes(data))
    except DecodeError as error:
        raise MessageError(f"{len(data)} bytes are no {kind.DESCRIPTOR.name} ({error})") from error


def read_varint(data: bytes | memoryview, at: int) -> tuple[int, int]:
    """Return (value, place behind it) of the varint at a place; values are unsigned, 64 bits.

    Raises:
        MessageError: The bytes end within it, or it goes on for more than ten.
    """
    value = 0
    for step in range(_MAX_VARINT_BYTES):
        if at + step >= len(data):
            raise MessageError(f"the bytes end in the middle of a number at byte {at}")
        byte = data[at + step]
        value |= (byte & 0x7F) << (7 * step)
        if byte < 0x80:
            return value & 0xFFFFFFFFFFFFFFFF, at + step + 1
    raise MessageError(f"a number of more than {_MAX_VARINT_BYTES} bytes at byte {at}")


def varint(value: int) -> bytes:
    """Return a number from 0 up as a varint.

    >>> varint(300).hex()
    'ac02'
    """
    out = bytearray()
    while value >= 0x80:
        out.append(value & 0x7F | 0x80)
        value >>= 7
    out.append(value)
    return bytes(out)


def _describe(message: Any, fields: str, package: str, table: Mapping[str, str]) -> None:
    """Fill one message's descriptor from its line of the table."""
    oneof_index: dict[str, int] = {}
    for word in fields.split():
        number, name, kind = word.split(":")
        kind, _, oneof = kind.partition("/")
        field = message.field.add(name=name, number=int(number))
        field.label = field.LABEL_REPEATED if kind[0] in "*{" else field.LABEL_OPTIONAL
        if kind.startswith("{}"):
            entry = _map_entry(message, name)
            field.type, field.type_name = field.TYPE_MESSAGE, f".{package}.{message.name}.{entry.name}"
            _set_type(entry.field[1], kind[2:], package, table)
        else:
            _set_type(field, kind.lstrip("*"), package, table)
        if oneof:
            if oneof not in oneof_index:
                oneof_index[oneof] = len(message.oneof_decl)
                message.oneof_decl.add(name=oneof)
            field.oneof_index = oneof_index[oneof]


def _map_entry(message: Any, field_name: str) -> Any:
    """Add the hidden entry message that protobuf keeps for a map and return it; the type of its value is still open."""
    name = "".join(word[0].upper() + word[1:] for word in field_name.split("_")) + "Entry"
    entry = message.nested_type.add(name=name)
    entry.options.map_entry = True
    entry.field.add(name="key", number=1, label=1, type="TYPE_STRING")
    entry.field.add(name="value", number=2, label=1)
    return entry


def _set_type(field: Any, kind: str, package: str, table: Mapping[str, str]) -> None:
    if kind in table:
        field.type, field.type_name = field.TYPE_MESSAGE, f".{package}.{kind}"
    else:
        field.type = getattr(field, f"TYPE_{kind.upper()}")
