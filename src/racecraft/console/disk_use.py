"""What a workspace takes of the disk: by folder, and the models that take most. See `disk_use`."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

from racecraft.console.workspace import BIN, DRAFTS, DRIVEN, LOGS, MODELS, RUNS, TUNINGS, Workspace

FOLDERS = (MODELS, RUNS, TUNINGS, LOGS, DRIVEN, DRAFTS, BIN)
MAX_MODELS = 10


def disk_use(path: str) -> dict[str, Any]:
    """Return the bytes of each folder that is there, and of the MAX_MODELS models that take most.

    Args:
        path: Of the workspace.
    """
    workspace = Workspace(Path(path))
    sizes = {model.name: bytes_in(model.path) for model in workspace.models()}
    largest = sorted(sizes.items(), key=lambda pair: -pair[1])[:MAX_MODELS]
    folders = [(name, bytes_in(workspace.path / name)) for name in FOLDERS if (workspace.path / name).is_dir()]
    return {"folders": folders, "largest": largest}


def bytes_in(folder: Path) -> int:
    """Return the bytes of all plain files below a folder; what vanishes meanwhile counts nothing."""
    total = 0
    for place, _, files in os.walk(folder):
        for file in files:
            try:
                total += os.lstat(os.path.join(place, file)).st_size
            except OSError:
                continue
    return total
