"""A judged drive as it is kept: read without what drove it. Begin with `read_replay`."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from racecraft.contract.world import Array
from racecraft.formats.tensor_file import read_tensors

REPLAY = "drive.safetensors"
KIND = "racecraft drive"


def read_replay(file: Path) -> tuple[dict[str, Array], dict[str, Any]]:
    """Return a drive's columns by name, (T,) each, and its card: track, driven direction, seconds of a tick.

    Raises:
        CheckpointError: The file is missing or damaged.
    """
    return read_tensors(file, KIND)
