"""Counter-based chance: one stream for each seed, purpose and world.

A draw is a pure function of (stream key, counter), so results depend neither on threads nor on how many worlds run
beside, and a stream is saved by saving one counter. The mixing is SplitMix64's finaliser (Steele, Lea, Flood:
"Fast splittable pseudorandom number generators", OOPSLA 2014); it is for simulation, not for secrets.

This page makes the keys; the draws themselves are compiled, in `racecraft.kernels.rng`.
"""

from __future__ import annotations

import hashlib

import numpy as np

from racecraft.contract.world import Array

_GOLDEN = np.uint64(0x9E3779B97F4A7C15)
_MASK = (1 << 64) - 1


def stream_keys(seed: int, purpose: str, num_worlds: int) -> Array:
    """Return one key per world, uint64 (N,), for a purpose such as "start positions".

    World n's key does not depend on N.

    >>> bool((stream_keys(1, "food", 4)[:2] == stream_keys(1, "food", 2)).all())
    True
    """
    root = hashlib.sha256(f"{seed}/{purpose}".encode()).digest()
    base = int.from_bytes(root[:8], "little")
    return np.array([_mix_int((base + n * int(_GOLDEN)) & _MASK) for n in range(num_worlds)], np.uint64)


def generator(seed: int, purpose: str) -> np.random.Generator:
    """Return a NumPy generator for one purpose, for chance outside the kernels."""
    digest = hashlib.sha256(purpose.encode()).digest()
    return np.random.default_rng([seed, int.from_bytes(digest[:8], "little")])


def _mix_int(z: int) -> int:
    z = (z + int(_GOLDEN)) & _MASK
    z = ((z ^ (z >> 30)) * 0xBF58476D1CE4E5B9) & _MASK
    z = ((z ^ (z >> 27)) * 0x94D049BB133111EB) & _MASK
    return z ^ (z >> 31)
