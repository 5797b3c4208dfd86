"""Arrays and a card in one safetensors file: nothing in it can run code, and damage is noticed.

The format is safetensors', which reads what is written here; `racecraft.formats.checkpoint` says what is kept in it.
A digest over all arrays stands in the header: a damaged file is refused instead of driven.
"""

from __future__ import annotations

import hashlib
import json
import struct
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import safetensors
import safetensors.numpy

from racecraft.contract.errors import InputFileError
from racecraft.contract.message import Message
from racecraft.contract.world import Array
from racecraft.formats.atomic import atomic_file
from racecraft.formats.json_text import parse_json
from racecraft.formats.user_file import read_regular

VERSION = 1
_HEADER_MULTIPLE = 8
"""Bytes to whose multiple the header is filled up, so that numbers lie where processors like them."""
_TYPES = {
    "|b1": "BOOL", "|u1": "U8", "|i1": "I8", "<u2": "U16", "<i2": "I16", "<u4": "U32", "<i4": "I32",
    "<u8": "U64", "<i8": "I64", "<f2": "F16", "<f4": "F32", "<f8": "F64",
}  # fmt: skip
"""NumPy's names of number types, and safetensors' own."""


class CheckpointError(InputFileError):
    """A checkpoint is missing, damaged, or of another kind."""


def write_tensors(path: str | Path, kind: str, arrays: Mapping[str, Array], card: Any) -> None:
    """Write arrays and a card, whole or not at all.

    Args:
        path: Where to.
        kind: What the file says it is.
        arrays: By name; booleans, integers and floats of any shape.
        card: Plain JSON values.

    Raises:
        OutputFileError: The file cannot be written.
    """
    laid = _in_order_of_size({name: _as_stored(array) for name, array in arrays.items()})
    metadata = {"format": kind, "version": str(VERSION), "digest": digest(laid), "card": json.dumps(card)}
    with atomic_file(path) as part, open(part, "wb") as file:
        file.write(_header(laid, metadata))
        for array in laid.values():
            file.write(_bytes_of(array))


def read_tensors(path: Path, kind: str) -> tuple[dict[str, Array], Any]:
    """Return arrays and card.

    Raises:
        CheckpointError: The file is missing, damaged, or of another kind or version.
    """
    expected = Message("a {kind} in safetensors", kind=kind)
    try:
        data = read_regular(path)
    except FileNotFoundError:
        raise CheckpointError(path, "there is no such file", expected) from None
    except OSError as error:
        raise CheckpointError(
            path, Message("the file cannot be read ({strerror})", strerror=error.strerror), expected
        ) from error
    hint = "Take another checkpoint; this file cannot be mended."
    try:
        arrays = safetensors.numpy.load(data)
        (length,) = struct.unpack_from("<Q", data)
        metadata = parse_json(data[8 : 8 + length]).get("__metadata__", {})
    except (safetensors.SafetensorError, ValueError, struct.error) as error:
        raise CheckpointError(path, Message("damaged or half written ({error})", error=error), expected, hint) from None
    _require_kind(path, metadata, kind)
    if metadata.get("digest") != digest(arrays):
        raise CheckpointError(path, "damaged (its digest does not match)", expected, hint)
    return dict(arrays), json.loads(metadata["card"])


def read_card(path: Path, kind: str) -> Any:
    """Return the card alone; arrays are neither read nor checked.

    Raises:
        CheckpointError: The file is missing, its head is damaged, or it is of another kind or version.
    """
    try:
        with safetensors.safe_open(path, "numpy") as file:
            metadata = file.metadata() or {}
    except (safetensors.SafetensorError, OSError) as error:
        expected = Message("a {kind} in safetensors", kind=kind)
        raise CheckpointError(path, Message("cannot be read ({error})", error=error), expected) from None
    _require_kind(path, metadata, kind)
    return json.loads(metadata["card"])


def _require_kind(path: Path, metadata: Mapping[str, Any], kind: str) -> None:
    expected = Message("a {kind} in safetensors", kind=kind)
    if metadata.get("format") != kind:
        raise CheckpointError(
            path, Message("it says it is '{metadata}'", metadata=metadata.get("format", "unnamed")), expected
        )
    if metadata.get("version") != str(VERSION):
        raise CheckpointError(
            path,
            Message("version {metadata}", metadata=metadata.get("version")),
            Message("version {version}", version=VERSION),
            "Upgrade racecraft.",
        )


def digest(arrays: Mapping[str, Array]) -> str:
    """Return the SHA-256 of all arrays, names, types and shapes among them, whatever their order."""
    total = hashlib.sha256()
    for name in sorted(arrays):
        array = arrays[name]
        total.update(f"{name} {array.dtype} {array.shape}\n".encode())
        total.update(_bytes_of(array))
    return total.hexdigest()


def _as_stored(array: Array) -> Array:
    """Return the array with numbers as the file holds them, little-endian; how it lies in memory stays."""
    array = np.asarray(array)
    return np.asarray(array, dtype=array.dtype.newbyteorder("<"))


def _in_order_of_size(arrays: dict[str, Array]) -> dict[str, Array]:
    """Order arrays by size of number, largest first, then by name: none begins at an odd place."""
    return dict(sorted(arrays.items(), key=lambda named: (-named[1].itemsize, named[0])))


def _header(arrays: Mapping[str, Array], metadata: Mapping[str, str]) -> bytes:
    header: dict[str, Any] = {"__metadata__": metadata}
    end = 0
    for name, array in arrays.items():
        begin, end = end, end + array.nbytes
        header[name] = {"dtype": _TYPES[array.dtype.str], "shape": array.shape, "data_offsets": [begin, end]}
    text = json.dumps(header, separators=(",", ":")).encode()
    text += b" " * (-len(text) % _HEADER_MULTIPLE)
    return struct.pack("<Q", len(text)) + text


def _bytes_of(array: Array) -> memoryview:
    """Return the array's bytes, rows behind each other; they are copied where they lie otherwise."""
    return np.ascontiguousarray(array).reshape(-1).view(np.uint8).data
