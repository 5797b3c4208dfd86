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
from racecraft.contract.world import Array
from racecraft.formats.mapped_file import map_file
from racecraft.formats.whole import write_whole
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
from racecraft.worlds.deepracer.files.tensorflow.wire import (
    WireError,
    as_bytes,
    as_number,
    as_signed,
    bytes_field,
    fields,
    fixed32_field,
    varint_field,
)

KIND = "a TensorFlow checkpoint: NAME.index with NAME.data-00000-of-00001"
INDEX = ".index"
MOST_INDEX_BYTES = 64 * 2**20
MOST_SHARDS = 1000


class TensorFlowCheckpointError(InputFileError):
    """A TensorFlow checkpoint is missing, damaged, or none."""


def read_checkpoint(prefix: str | Path, wanted: Callable[[str], bool] = lambda name: True) -> dict[str, Array]:
    """Return the arrays of a checkpoint by name; what is no number (texts) is passed over.

    Args:
        prefix: The checkpoint's name, such as `model/12_Step-3456.ckpt`, or its .index file. The arrays lie in its
            data files, and come into memory where they are looked at.
        wanted: Tells by its name whether an array is read at all.

    Raises:
        TensorFlowCheckpointError: A file is missing or damaged; checksums are looked at.
    """
    prefix = Path(str(prefix).removesuffix(INDEX))
    index = Path(f"{prefix}{INDEX}")
    try:
        if index.stat().st_size > MOST_INDEX_BYTES:
            raise TensorFlowCheckpointError(index, f"{index.stat().st_size} bytes long", "an index of a few kilobytes")
        entries = read_table(index.read_bytes())
        shards = _Shards(prefix, _count_of_shards(entries.pop(b"", None)))
        named = ((name.decode("utf-8"), entry) for name, entry in entries.items())
        read = ((name, _array(shards, name, entry)) for name, entry in named if wanted(name))
        return {name: array for name, array in read if array is not None}
    except FileNotFoundError as error:
        raise TensorFlowCheckpointError(error.filename or index, "there is no such file", KIND) from None
    except OSError as error:
        file = error.filename or index
        raise TensorFlowCheckpointError(file, f"cannot be read ({error.strerror})", KIND) from error
    except (WireError, UnicodeDecodeError) as error:
        raise TensorFlowCheckpointError(index, f"damaged, or no index ({error})", KIND) from error


def write_checkpoint(prefix: str | Path, arrays: Mapping[str, Array]) -> None:
    """Write arrays as a checkpoint of one data file; the index comes last.

    Raises:
        OutputFileError: A file cannot be written.
    """
    entries = {b"": varint_field(1, 1) + bytes_field(3, varint_field(1, 1))}
    pieces, offset = [], 0
    for name in sorted(arrays):
        array = little_endian(arrays[name])
        array = array if array.flags.c_contiguous else np.ascontiguousarray(array)
        place = varint_field(4, offset) if offset else b""
        entries[name.encode()] = (
            varint_field(1, CODES[array.dtype])
            + bytes_field(2, write_shape(array.shape))
            + place
            + varint_field(5, array.nbytes)
            + fixed32_field(6, masked_crc32c(array))
        )
        pieces.append(array.tobytes())
        offset += array.nbytes
    write_whole(f"{prefix}.data-00000-of-00001", b"".join(pieces))
    write_whole(f"{prefix}{INDEX}", write_table(entries))


def _count_of_shards(header: bytes | None) -> int:
    """Return how many data files there are."""
    if header is None:
        raise WireError("it has no header")
    shards = 0
    for number, value in fields(header):
        if number == 1:
            shards = as_number(value, "the number of data files")
        elif number == 2 and value != 0:
            raise WireError("its numbers are big-endian")
    if not 1 <= shards <= MOST_SHARDS:
        raise WireError(f"it claims {shards} data files")
    return shards


class _Shards:
    """The data files of a checkpoint, each mapped when it is first asked for."""

    def __init__(self, prefix: Path, count: int) -> None:
        self.count, self._prefix = count, prefix
        self._mapped: dict[int, memoryview] = {}

    def path(self, number: int) -> Path:
        """Return where one lies."""
        return Path(f"{self._prefix}.data-{number:05d}-of-{self.count:05d}")

    def __getitem__(self, number: int) -> memoryview:
        if number not in self._mapped:
            self._mapped[number] = map_file(self.path(number))
        return self._mapped[number]


def _array(shards: _Shards, name: str, entry: bytes) -> Array | None:
    code = shard = offset = size = checksum = 0
    shape: tuple[int, ...] = ()
    for number, value in fields(entry):
        if number == 1:
            code = as_number(value, "a type")
        elif number == 2:
            shape = read_shape(as_bytes(value, "a shape"))
        elif number == 3:
            shard = as_number(value, "a data file's number")
        elif number == 4:
            offset = as_signed(value, "a place")
        elif number == 5:
            size = as_signed(value, "a size")
        elif number == 6:
            checksum = as_number(value, "a checksum")
        elif number == 7:
            raise WireError(f"{name} lies in slices")
    if code not in TYPES:
        return None
    dtype = dtype_of(code)
    if size != count_of(shape, dtype) * dtype.itemsize or offset < 0 or not 0 <= shard < shards.count:
        raise WireError(f"{name} of shape {shape} claims {size} bytes at {offset} of data file {shard}")
    data, path = shards[shard], shards.path(shard)
    if len(data) < offset + size:
        raise TensorFlowCheckpointError(
            path, f"ends before {name} does (byte {offset + size})", "the whole file", "Copy it again."
        )
    array = np.frombuffer(data[offset : offset + size], dtype)
    if masked_crc32c(array) != checksum:
        raise TensorFlowCheckpointError(path, f"the checksum of {name} is wrong", "undamaged weights", "Copy it again.")
    return array.reshape(shape)
