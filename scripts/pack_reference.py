"""Pack what the tests read of the reference data into tests/data/reference.tar.xz, from the folder that holds it all.

    python scripts/pack_reference.py ../shared/data

The same folder gives the same bytes. Left out is what is large and read by few: most of the console's training, and all
camera frames but those that the everyday test looks at. tests/data/README.md says whose the files are.
"""

from __future__ import annotations

import argparse
import io
import lzma
import tarfile
from pathlib import Path

HOME = Path(__file__).resolve().parents[1]
ARCHIVE = HOME / "tests" / "data" / "reference.tar.xz"
WHOLE = ("battlesnake", "models", "tracks", "traces/drfc-1-worker", "traces/droa-2026-*", "traces/console-2022/[!s]*")
"""Folders that go along whole, as patterns; of the console, all but its sim-trace."""
CONSOLE = "traces/console-2022/sim-trace/training/training-simtrace/{}-iteration.csv"
ITERATIONS = (0, 5, 20)
FRAMES = (12, 20, 64, 76)
"""By their place in the order of their names."""


def chosen(data: Path) -> list[Path]:
    """Return the files that go along, in order."""
    whole = [path for pattern in WHOLE for folder in data.glob(pattern) for path in folder.rglob("*")]
    frames = sorted((data / "frames").glob("*.png"))
    some = [data / CONSOLE.format(number) for number in ITERATIONS] + [frames[number] for number in FRAMES]
    return sorted(path for path in {*whole, *some} if path.is_file())


def packed(data: Path) -> bytes:
    """Return the archive: names and bytes alone, nothing of who packed it and when."""
    tar = io.BytesIO()
    with tarfile.open(fileobj=tar, mode="w", format=tarfile.USTAR_FORMAT) as archive:
        for path in chosen(data):
            entry = tarfile.TarInfo(path.relative_to(data).as_posix())
            entry.size = path.stat().st_size
            archive.addfile(entry, io.BytesIO(path.read_bytes()))
    return lzma.compress(tar.getvalue(), preset=9 | lzma.PRESET_EXTREME)


def main() -> None:
    """Pack."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("data", type=Path)
    asked = parser.parse_args()
    ARCHIVE.parent.mkdir(exist_ok=True)
    ARCHIVE.write_bytes(packed(asked.data))
    print(f"{len(chosen(asked.data))} files, {ARCHIVE.stat().st_size:,} bytes: {ARCHIVE.relative_to(HOME)}")


if __name__ == "__main__":
    main()
