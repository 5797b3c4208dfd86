"""Where the reference data lies: beside the checkout, or unpacked from what comes along with it."""

from __future__ import annotations

import hashlib
import os
import shutil
import tarfile
import tempfile
from pathlib import Path

ARCHIVE = Path(__file__).parent / "data" / "reference.tar.xz"
BESIDE = Path(__file__).resolve().parents[2] / "shared" / "data"


def unpacked(archive: Path, under: Path) -> Path:
    """Return the folder that an archive is unpacked in, once for each of its versions; safe beside other processes."""
    name = hashlib.sha256(archive.read_bytes()).hexdigest()[:12]
    place = under / f"racecraft-reference-{name}"
    if not place.is_dir():
        with tempfile.TemporaryDirectory(dir=under) as folder:
            part = Path(folder) / "part"
            with tarfile.open(archive) as files:
                files.extractall(part, filter="data")
            try:
                os.replace(part, place)
            except OSError:  # another process was quicker
                shutil.rmtree(part)
    return place


DATA = BESIDE if BESIDE.is_dir() else unpacked(ARCHIVE, Path(tempfile.gettempdir()))
TRACES = DATA / "traces"
HAS_ALL = (DATA / "frames" / "sim-image-3-00000.png").exists()
"""Whether the large parts are there too: the console's whole training of 2022, and every frame of the camera."""
LARGE = "the large part of the reference data (../shared/data) is not beside this checkout"
