"""Where this system keeps what belongs to a user's account rather than to one run."""

from __future__ import annotations

import os
import sys
from collections.abc import Mapping
from pathlib import Path


def data_folder(environment: Mapping[str, str] = os.environ, system: str = sys.platform) -> Path:
    """Return the folder for racecraft's data; it need not exist.

    >>> data_folder({"XDG_DATA_HOME": "/data"}, "linux").as_posix()
    '/data/racecraft'
    """
    home = Path(environment["HOME"]) if "HOME" in environment else Path.home()
    if system == "win32":
        return Path(environment.get("LOCALAPPDATA") or home / "AppData" / "Local") / "racecraft"
    if system == "darwin":
        return home / "Library" / "Application Support" / "racecraft"
    return Path(environment.get("XDG_DATA_HOME") or home / ".local" / "share") / "racecraft"
