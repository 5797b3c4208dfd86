"""Names that NumPy had until 1.24 or 2.0, for scripts of that time: `np.int` was Python's own int."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator

import numpy as np

GONE = {
    "int": int, "float": float, "complex": complex, "object": object, "float_": np.float64, "bool8": np.bool_,
    "NaN": np.nan, "Inf": np.inf,
}  # fmt: skip
"""What each of them was."""


@contextlib.contextmanager
def old_names() -> Iterator[None]:
    """Lend those that NumPy lacks here; afterwards it lacks them again."""
    lent = [name for name in GONE if name not in vars(np)]
    for name in lent:
        setattr(np, name, GONE[name])
    try:
        yield
    finally:
        for name in lent:
            delattr(np, name)
