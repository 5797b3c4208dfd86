"""Where racecraft keeps what it can make or fetch again: a folder that belongs to the user alone."""

from __future__ import annotations

import os
import sys
from pathlib import Path


def user_cache() -> Path:
    """Return the user's folder for caches, in which racecraft makes folders of its own; `RACECRAFT_CACHE` overrides."""
    if override := os.environ.get("RACECRAFT_CACHE"):
        return Path(override)
    if sys.platform == "win32":
        return Path(os.environ.get("LOCALAPPDATA", Path.home() / "AppData" / "Local"))
    if sys.platform == "darwin":
        return Path.home() / "Library" / "Caches"
    return Path(os.environ.get("XDG_CACHE_HOME", Path.home() / ".cache"))
