"""Named arrays of a TensorFlow checkpoint: NAME.index and NAME.data-00000-of-00001. Begin with `read_checkpoint`.

The index is a sorted table: under the empty key how many data files there are, under each variable's name its type,
shape, place and checksum. The data files are the arrays' bytes one behind the other.

Source: facts: TensorFlow's `tensor_bundle.proto` and `tensor_bundle.cc`.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np

from racecraft.contract.errors import InputFileError
from racecraft.contract.message import Message
from racecraft.contract.world import Array
from racecraft.formats.atomic import write_atomic
from racecraft.formats.protobuf_messages import MessageError, parsed
from racecraft.worlds.deepracer.files.tensorflow import messages
from racecraft.worlds.deepracer.files.tensorflow.table import masked_crc32c, read_table, write_table
from racecraft.worlds.deepracer.files.tensorflow.tensors import (
    CODES,
    TYPES,
    count_of,
    dtype_of,
    little_endian,
    read_shape,
    write_shape,
)

KIND = "a TensorFlow checkpoint: NAME.index with NAME.data-00000-of-00001"
INDEX = ".index"
MAX_INDEX_BYTES = 64 * 2**20
MAX_SHARDS = 1000


class TensorFlowCheckpointError(InputFileError):
    """A TensorFlow checkpoint is missing, damaged, or none."""


def read_checkpoint(prefix: str | Path, wanted: Callable[[str], bool] = lambda name: True) -> dict[str, Array]:
    """Return the arrays of a checkpoint by name; what is no number (texts) is passed over.

    Args:
        prefix: The checkpoint's name, such as `model/12_Step-3456.ckpt`, or its .index file.
        wanted: Tells by its name whether an array is read at all.

    Raises:
        TensorFlowCheckpointError: A file is missing or damaged; checksums are looked at.
    """
    prefix = Path(str(prefix).removesuffix(INDEX))
    index = Path(f"{prefix}{INDEX}")
    try:
        if index.stat().st_size > MAX_INDEX_BYTES:
            raise TensorFlowCheckpointError(
                index, Message("{st_size} bytes long", st_size=index.stat().st_size), "an index of a few kilobytes"
            )
        entries = read_table(index.read_bytes())
        shards = _count_of_shards(entries.pop(b"", None))
        named = ((name.decode("utf-8"), entry) for name, entry in entries.items())
        read = ((name, _array(prefix, shards, name, entry)) for name, entry in named if wanted(name))
        return {name: array for name, array in read if array is not None}
    except FileNotFoundError as error:
        raise TensorFlowCheckpointError(error.filename or index, "there is no such file", KIND) from None
    except OSError as error:
        file = error.filename or index
        raise TensorFlowCheckpointError(
            file, Message("cannot be read ({strerror})", strerror=error.strerror), KIND
        ) from error
    except (MessageError, UnicodeDecodeError) as error:
        raise TensorFlowCheckpointError(index, Message("damaged, or no index ({error})", error=error), KIND) from error


def write_checkpoint(prefix: str | Path, arrays: Mapping[str, Array]) -> None:
    """Write arrays as a checkpoint of one data file; the index comes last.

    Raises:
        OutputFileError: A file cannot be written.
    """
    header = messages.load().BundleHeaderProto(num_shards=1)
    header.version.producer = 1
    entries, pieces, offset = {b"": header.SerializeToString()}, [], 0
    for name in sorted(arrays):
        array = little_endian(arrays[name])
        array = array if array.flags.c_contiguous else np.ascontiguousarray(array)
        entry = messages.load().BundleEntryProto(
            dtype=CODES[array.dtype], offset=offset, size=array.nbytes, crc32c=masked_crc32c(array)
        )
        write_shape(entry.shape, array.shape)
        entries[name.encode()] = entry.SerializeToString()
        pieces.append(array.tobytes())
        offset += array.nbytes
    write_atomic(f"{prefix}.data-00000-of-00001", b"".join(pieces))
    write_atomic(f"{prefix}{INDEX}", write_table(entries))


def _count_of_shards(header: bytes | None) -> int:
    """Return how many data files there are."""
    if header is None:
        raise MessageError("it has no header")
    message = parsed(messages.load().BundleHeaderProto, header)
    if message.endianness:
        raise MessageError("its numbers are big-endian")
    shards: int = message.num_shards
    if not 1 <= shards <= MAX_SHARDS:
        raise MessageError(f"it claims {shards} data files")
    return shards


def _array(prefix: Path, shards: int, name: str, data: bytes) -> Array | None:
    entry = parsed(messages.load().BundleEntryProto, data)
    if entry.slices:
        raise MessageError(f"{name} lies in slices")
    if entry.dtype not in TYPES:
        return None
    dtype, shape = dtype_of(entry.dtype), read_shape(entry.shape)
    count = count_of(shape, dtype)
    if entry.size != count * dtype.itemsize or entry.offset < 0 or not 0 <= entry.shard_id < shards:
        raise MessageError(
            f"{name} of shape {shape} claims {entry.size} bytes at {entry.offset} of data file {entry.shard_id}"
        )
    path = Path(f"{prefix}.data-{entry.shard_id:05d}-of-{shards:05d}")
    if path.stat().st_size < entry.offset + entry.size:
        raise TensorFlowCheckpointError(
            path,
            Message("ends before {name} does (byte {offset})", name=name, offset=entry.offset + entry.size),
            "the whole file",
            "Copy it again.",
        )
    array = np.fromfile(path, dtype, count, offset=entry.offset)
    if masked_crc32c(array) != entry.crc32c:
        raise TensorFlowCheckpointError(
            path, Message("the checksum of {name} is wrong", name=name), "undamaged weights", "Copy it again."
        )
    return array.reshape(shape)
