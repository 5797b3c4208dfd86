"""Which files code of others may read: Python's own, installed packages, and what lies beside the code."""

from __future__ import annotations

import os
import sys
import sysconfig
import tempfile
from collections.abc import Iterator
from pathlib import Path

import racecraft

SYSTEM = (
    "/lib", "/lib64", "/usr/lib", "/usr/lib64", "/usr/local/lib", "/nix/store", "/etc/ld.so.cache",
    "/usr/share/zoneinfo", "/etc/localtime", "/dev/null", "/dev/urandom", "/sys/devices/system/cpu", "/proc/cpuinfo",
    "/proc/meminfo",
)  # fmt: skip
"""Libraries, time zones, and what numeric libraries ask of the processor when they are imported."""
SECRETS = ".env"
"""Files that end so hold keys, as DeepRacer for Cloud's system.env does."""


def files_of_python() -> list[str]:
    """Return the folders from which this interpreter imports, and those of shared libraries.

    The present folder, the home folder and what lies above them are left out, even where they are on the search path.
    """
    installed = [sysconfig.get_path(name) for name in ("stdlib", "platstdlib", "purelib", "platlib")]
    libraries = [str(Path(prefix) / "lib") for prefix in (sys.prefix, sys.base_prefix)]
    ours = str(Path(racecraft.__file__).parent)
    searched = [place for place in sys.path if place and not _holds_more_than_code(Path(place))]
    return list(dict.fromkeys([*installed, *libraries, ours, *searched, *SYSTEM]))


def files_beside(file: Path) -> list[str]:
    """Return a file, and the files and folders beside it.

    Hidden ones, those that end in `SECRETS`, and links that lead out of the folder are left out; so are all folders
    where the file lies in the home folder, above it, or in the folder for temporary files.
    """
    folder = file.parent.resolve()
    is_shared = _holds_more_than_code(folder) and folder != Path.cwd().resolve()
    return [str(file.resolve()), *_entries(folder, with_folders=not is_shared)]


def _entries(folder: Path, with_folders: bool) -> Iterator[str]:
    try:
        entries = sorted(os.scandir(folder), key=lambda entry: entry.name)
    except OSError:
        return
    for entry in entries:
        is_private = entry.name.startswith(".") or entry.name.endswith(SECRETS)
        if is_private or not Path(entry.path).resolve().is_relative_to(folder):
            continue
        if entry.is_file() or (with_folders and entry.is_dir()):
            yield entry.path


def _holds_more_than_code(folder: Path) -> bool:
    """Tell whether a folder is the home folder, the present one or the one for temporary files, or lies above one."""
    places = [Path.cwd(), Path(tempfile.gettempdir())]
    home = os.path.expanduser("~")
    places += [Path(home)] if os.path.isabs(home) else []
    return any(place.resolve().is_relative_to(folder.resolve()) for place in places)
