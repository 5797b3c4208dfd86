"""The checksum, many bytes at once, beside one that takes a byte and a bit at a time."""

import numpy as np
import pytest

from racecraft.formats import mapped_file
from racecraft.formats.tensorflow import crc32c


def bit_by_bit(data):
    state = 0xFFFFFFFF
    for byte in data:
        state ^= byte
        for _ in range(8):
            state = state >> 1 ^ (crc32c.POLYNOMIAL if state & 1 else 0)
    return state ^ 0xFFFFFFFF


@pytest.mark.parametrize("piece", [70_000, 65_536, 2**24])
@pytest.mark.parametrize("size", [0, 1, 4096 * 15, 4096 * 16 + 3, 150_001])
def test_lanes_and_pieces_change_nothing(monkeypatch, piece, size):
    monkeypatch.setattr(mapped_file, "PIECE_BYTES", piece)
    data = np.random.default_rng(size).bytes(size)
    assert crc32c.crc32c(data) == bit_by_bit(data)
