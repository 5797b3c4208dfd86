"""A line as a file: `.csv` with named columns, `.npy`, or a Python list to paste into a reward. See `write_line`."""

from __future__ import annotations

import io
from pathlib import Path

import numpy as np

from racecraft.contract.errors import SettingError
from racecraft.formats.atomic import write_atomic
from racecraft.worlds.deepracer.driving.racing_line import RacingLine

COLUMNS = ("x_m", "y_m", "speed_mps", "seconds", "heading_rad")
"""In this order in every kind of file; seconds since the first point."""
ENDINGS = (".csv", ".npy", ".py")


def line_rows(line: RacingLine) -> np.ndarray:
    """Return a line as COLUMNS, (N, 5)."""
    return np.column_stack([line.xy, line.speed, line.seconds[: len(line.xy)], line.heading])


def line_csv(line: RacingLine) -> str:
    """Return a line as the text of a `.csv` file."""
    rows = (",".join(f"{value:.6g}" for value in row) for row in line_rows(line))
    return "\n".join([",".join(COLUMNS), *rows]) + "\n"


def write_line(line: RacingLine, path: Path, title: str) -> None:
    """Write a line; the ending of the file's name says how.

    Args:
        line: The line.
        path: Ends in one of ENDINGS.
        title: One sentence that the `.py` file begins with.

    Raises:
        SettingError: Another ending.
        OutputFileError: The file cannot be written.
    """
    rows = line_rows(line)
    if path.suffix == ".npy":
        data = io.BytesIO()
        np.save(data, rows, allow_pickle=False)
        write_atomic(path, data.getvalue())
    elif path.suffix == ".csv":
        write_atomic(path, line_csv(line))
    elif path.suffix == ".py":
        points = "\n".join(f"    ({x:.4f}, {y:.4f}, {speed:.3f}, {at:.3f})," for x, y, speed, at, _ in rows)
        write_atomic(path, f"# {title}\n# (x in m, y in m, speed in m/s, seconds since the first point)\n"
                          f"RACING_LINE = [\n{points}\n]\n")  # fmt: skip
    else:
        raise SettingError(
            "{path}: the ending is {suffix!r}; expected {endings}.",
            path=path,
            suffix=path.suffix or "missing",
            endings=", ".join(ENDINGS),
        )
