"""A recorded lap and our car's attempts at it, drawn on the track. Begin with `draw_replay`."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from racecraft.worlds.deepracer.evaluation.open_loop import HORIZONS
from racecraft.worlds.deepracer.evaluation.replay_report import FileReplay, ReplayReport
from racecraft.worlds.deepracer.tracks.picture import PaintedPath, draw_track


def draw_replay(report: ReplayReport, path: str | Path) -> None:
    """Draw `replay_figure` into a file.

    Raises:
        TrackError: The ending is no picture's.
        OutputFileError: The file cannot be written.
    """
    replay_figure(report, path)


def replay_figure(report: ReplayReport, path: str | Path | None = None) -> Any:
    """Return a figure of the longest recorded episode, coloured by commanded speed, our car's windows in red over it.

    Every window starts on the recorded path and drives a second without looking; windows follow one another.
    """
    file, rows = longest_episode(report)
    columns = file.trace.columns
    xy = np.column_stack([columns["X"], columns["Y"]])[rows]
    logged = PaintedPath(xy, columns["throttle"][rows], "commanded speed (m/s)")
    title = f"Recorded, and driven again by {report.car} one second at a time"
    driven = [PaintedPath(window) for window in driven_paths(file, rows)]
    return draw_track(report.track, path, paths=[logged, *driven], title=title)


def longest_episode(report: ReplayReport) -> tuple[FileReplay, slice]:
    """Return the file and the rows of the episode that came furthest."""
    best, found = -1.0, (report.files[0], slice(0, len(report.files[0].trace)))
    for file in report.files:
        edges = np.append(np.flatnonzero(file.retold.begins), len(file.trace))
        for first, last in zip(edges[:-1].tolist(), edges[1:].tolist(), strict=True):
            furthest = float(file.trace.columns["progress"][first:last].max())
            if last - first > 1 and furthest > best:
                best, found = furthest, (file, slice(first, last))
    return found


def driven_paths(file: FileReplay, rows: slice) -> list[np.ndarray]:
    """Return the driven front points (ticks, 2) of windows that follow one another through some rows."""
    paths, free = [], rows.start
    for window, first in enumerate(file.windows.first.tolist()):
        if free <= first < rows.stop:
            ticks = int(file.windows.ticks[window])
            paths.append(file.windows.paths[window, : ticks + 1, :2])
            free = first + max(HORIZONS.values())
    return paths
