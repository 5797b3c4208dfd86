"""CRC-32C, the checksum of TensorFlow's tables and arrays, over many pieces at once. Begin with `masked_crc32c`.

A byte at a time would take a minute for the weights of a car. The checksum is linear, so the bytes are cut into lanes
of equal length that NumPy advances side by side, and the lanes' ends are joined two by two: what stands before L bytes
of zeros is its own checksum moved on by a matrix over 32 bits, which is squared when L doubles.

Source: facts: the iSCSI polynomial (RFC 3720, appendix B.4); LevelDB's `crc32c.h` for the mask.
"""

from __future__ import annotations

import numpy as np

from racecraft.contract.world import Array
from racecraft.formats.mapped_file import let_go, spans

POLYNOMIAL = 0x82F63B78
"""Castagnoli's, bits reversed."""
LANES = 4096
_MASK = 0xA282EAD8


def masked_crc32c(data: bytes | memoryview | Array) -> int:
    """Return the checksum as TensorFlow stores it: turned by 15 bits, and a constant added.

    >>> hex(masked_crc32c(b"123456789"))
    '0xc78ab0e5'
    """
    crc = crc32c(data)
    return ((crc >> 15 | crc << 17) + _MASK) & 0xFFFFFFFF


def crc32c(data: bytes | memoryview | Array) -> int:
    """Return the checksum.

    >>> hex(crc32c(b"123456789"))
    '0xe3069283'
    """
    raw = np.frombuffer(data, np.uint8) if not isinstance(data, np.ndarray) else data.reshape(-1).view(np.uint8)
    state = 0xFFFFFFFF
    for part in spans(len(raw), 1):
        state = _behind(state, raw[part])
        let_go(raw)
    return state ^ 0xFFFFFFFF


def _behind(state: int, raw: Array) -> int:
    """Return the state behind a piece of bytes."""
    length = len(raw) // LANES
    if length >= 16:
        starts = np.zeros(LANES, np.uint32)
        starts[0] = state
        state = _joined(_advanced(starts, raw[: length * LANES].reshape(LANES, length)), length)
        raw = raw[length * LANES :]
    return int(_advanced(np.array([state], np.uint32), raw[None])[0])


def _advanced(state: Array, lanes: Array) -> Array:
    """Return the states (n,) after each lane's bytes (n, length)."""
    columns = np.ascontiguousarray(lanes.T)
    for column in columns:
        state = _TABLE[(state ^ column) & 0xFF] ^ (state >> np.uint32(8))
    return state


def _joined(states: Array, length: int) -> int:
    """Return the state behind all lanes, which are each `length` bytes; LANES is a power of two."""
    matrix = _after_zeros(length)
    while len(states) > 1:
        states = _times(matrix, states[0::2]) ^ states[1::2]
        matrix = _times(matrix, matrix)
    return int(states[0])


def _after_zeros(length: int) -> Array:
    """Return where `length` bytes of zeros take each of the 32 bits, uint32 (32,)."""
    bits = np.uint32(1) << np.arange(32, dtype=np.uint32)
    result, power = bits, _TABLE[bits & 0xFF] ^ (bits >> np.uint32(8))
    while length:
        result = _times(power, result) if length & 1 else result
        power = _times(power, power)
        length >>= 1
    return result


def _times(matrix: Array, states: Array) -> Array:
    """Return each state moved on by a matrix whose columns are those of the 32 bits."""
    moved = np.zeros_like(states)
    for bit in range(32):
        moved ^= np.where(states >> np.uint32(bit) & np.uint32(1), matrix[bit], np.uint32(0))
    return moved


def _table() -> Array:
    table = np.arange(256, dtype=np.uint32)
    for _ in range(8):
        table = np.where(table & 1, np.uint32(POLYNOMIAL) ^ (table >> np.uint32(1)), table >> np.uint32(1))
    return table


_TABLE = _table()
