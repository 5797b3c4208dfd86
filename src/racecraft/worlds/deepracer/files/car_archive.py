"""The archive that a physical car takes: `carfile.tar.gz` with `agent/model.pb` and `model_metadata.json`.

Source: facts: deepracer.md 9.6, deepracer-systems.md A8.
"""

from __future__ import annotations

import gzip
import io
import tarfile
from collections.abc import Mapping
from pathlib import Path

from racecraft.formats.archive import GZIPPED
from racecraft.formats.atomic import atomic_file, make_folder

CAR_ARCHIVE = "carfile.tar.gz"
GRAPH, METADATA = "agent/model.pb", "model_metadata.json"


def write_car_archive(path: str | Path, graph: bytes, metadata: str) -> Path:
    """Write what a car takes; the same policy gives the same bytes.

    Args:
        path: The archive, or a folder for one called `carfile.tar.gz`.
        graph: The frozen graph.
        metadata: Text of model_metadata.json.

    Raises:
        OutputFileError: The place cannot be written.
    """
    target = Path(path)
    target = target if target.name.endswith(GZIPPED) else target / CAR_ARCHIVE
    make_folder(target.parent)
    write_archive(target, {GRAPH: graph, METADATA: metadata.encode()})
    return target


def archive_folder(path: str | Path, folder: str | Path) -> None:
    """Write a folder's files as a .tar.gz, under their names within it, in the order of their names.

    Raises:
        OutputFileError: The place cannot be written.
    """
    folder = Path(folder)
    files = sorted(file for file in folder.rglob("*") if file.is_file())
    with (
        atomic_file(path) as part,
        open(part, "wb") as raw,
        _without_time(raw) as packed,
        tarfile.open(fileobj=packed, mode="w") as tar,
    ):
        for file in files:
            tar.add(file, file.relative_to(folder).as_posix())


def write_archive(path: Path, files: Mapping[str, bytes]) -> None:
    """Write files by name as a .tar.gz, without times and owners."""
    with (
        atomic_file(path) as part,
        open(part, "wb") as raw,
        _without_time(raw) as packed,
        tarfile.open(fileobj=packed, mode="w") as tar,
    ):
        for name, data in files.items():
            entry = tarfile.TarInfo(name)
            entry.size, entry.mode = len(data), 0o644
            tar.addfile(entry, io.BytesIO(data))


def _without_time(raw: io.BufferedWriter) -> gzip.GzipFile:
    return gzip.GzipFile(filename="", fileobj=raw, mode="wb", compresslevel=1, mtime=0)
