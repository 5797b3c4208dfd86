"""Draws from a counter-based stream, inside a kernel; keys come from `contract.random_streams`."""

from __future__ import annotations

import math

import numpy as np

from racecraft.kernels.compile import kernel


@kernel
def random_bits(key: np.uint64, counter: np.uint64) -> np.uint64:
    """Return draw number `counter` of the stream `key` as 64 random bits (SplitMix64)."""
    z = key + (counter + np.uint64(1)) * np.uint64(0x9E3779B97F4A7C15)
    z = (z ^ (z >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    z = (z ^ (z >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return z ^ (z >> np.uint64(31))


@kernel
def uniform_at(key: np.uint64, counter: np.uint64) -> float:
    """Return draw number `counter` of the stream `key` as a float in [0, 1) with 53 random bits."""
    return np.float64(random_bits(key, counter) >> np.uint64(11)) * (1.0 / 9007199254740992.0)


@kernel
def normal_at(key: np.uint64, counter: np.uint64) -> float:
    """Return draws `counter` and `counter` + 1 of the stream `key` as one standard normal number (Box, Muller 1958)."""
    length = math.sqrt(-2.0 * math.log(1.0 - uniform_at(key, counter)))
    return length * math.cos(2.0 * math.pi * uniform_at(key, counter + np.uint64(1)))
