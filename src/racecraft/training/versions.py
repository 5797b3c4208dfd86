"""What results depend on beside seed and settings: versions, the machine, its threads. Every job.json records it."""

from __future__ import annotations

import os
import platform
from importlib.metadata import version

from racecraft import __version__


def versions() -> dict[str, str]:
    """Return the versions that results depend on."""
    names = ("torch", "numba", "numpy")
    return {"racecraft": __version__, "python": platform.python_version(), **{name: version(name) for name in names}}


def machine() -> dict[str, str | int]:
    """Return what kind of machine this is; nothing that names it."""
    return {"system": platform.system(), "processor": platform.machine(), "cores": os.cpu_count() or 1}
