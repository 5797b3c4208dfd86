"""How long something is waited for on a machine with much else to do. See `load_scaled`."""

from __future__ import annotations

import os

MOST = 10.0
"""So many times as long at most: what does not come by then does not come."""


def load_scaled(seconds: float) -> float:
    """Return a deadline as it is just here: longer by as much as this machine has more to do than cores.

    >>> load_scaled(30.0) >= 30.0
    True
    """
    load = os.getloadavg()[0] if hasattr(os, "getloadavg") else 0.0
    return seconds * min(max(1.0, load / (os.cpu_count() or 1)), MOST)
