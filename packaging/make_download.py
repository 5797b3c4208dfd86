"""Assemble the folder that people download: `racecraft/` with one file to double-click.

    python packaging/make_download.py linux dist --python PYTHON_FOLDER --uv UV_PROGRAM --wheel dist/racecraft-….whl
    python packaging/make_download.py linux dist … --wheels WHEELS     packages carried along: nothing is fetched

`.github/workflows/downloads.yml` runs it on each system and packs the folder.
"""

from __future__ import annotations

import argparse
import shutil
import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent
STARTERS = {"linux": "Start racecraft.sh", "macos": "Start racecraft.command", "windows": "Start racecraft.bat"}


def main(words: list[str]) -> int:
    """Make the folder and print its path."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else "")
    parser.add_argument("system", choices=sorted(STARTERS))
    parser.add_argument("output", type=Path)
    parser.add_argument("--python", type=Path, required=True, help="A relocatable interpreter's folder.")
    parser.add_argument("--uv", type=Path, required=True, help="The uv program.")
    parser.add_argument("--wheel", type=Path, required=True, help="racecraft itself.")
    parser.add_argument("--wheels", type=Path, help="A folder of its packages, to carry them along.")
    options = parser.parse_args(words)
    print(assemble(options.output / "racecraft", options))
    return 0


def assemble(folder: Path, options: argparse.Namespace) -> Path:
    """Copy everything into a new folder."""
    parts = folder / "parts"
    parts.mkdir(parents=True)
    starter = HERE / "starters" / STARTERS[options.system]
    shutil.copy2(starter, folder / starter.name)
    (folder / starter.name).chmod(0o755)
    shutil.copytree(options.python, parts / "python", symlinks=options.system != "windows")
    uv = parts / ("uv.exe" if options.system == "windows" else "uv")
    shutil.copy2(options.uv, uv)
    uv.chmod(0o755)
    for file in (
        HERE / "begin.py",
        HERE / "begin.html",
        HERE.parent / "constraints.txt",
        HERE.parent / "LICENSE",
        options.wheel,
    ):
        shutil.copy2(file, parts / file.name)
    if options.wheels:
        shutil.copytree(options.wheels, parts / "wheels")
    return folder


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
