"""`gym.utils.seeding`: a stream of chance of an environment's own, NumPy's old one as gym had it before 0.22."""

from __future__ import annotations

import numpy as np

SEEDS = 2**32
"""The old stream takes seeds below this."""


def np_random(seed: int | None = None) -> tuple[np.random.RandomState, int]:
    """Return a stream and its seed; without one it is drawn from the system.

    Args:
        seed: Not negative.
    """
    value = int(np.random.SeedSequence().generate_state(1)[0]) if seed is None else int(seed)
    return np.random.RandomState(value % SEEDS), value


__all__ = ["np_random"]
