"""The picture of what was driven on a circuit. Begin with `draw_path`."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from racecraft.analysis.figures import save_figure
from racecraft.contract.world import Array
from racecraft.pages.colours import PAPER, RED
from racecraft.worlds.deepracer.analysis.drive import CRASHED, GRIEF, LAP_COMPLETE, Drive, as_drive, incidents
from racecraft.worlds.deepracer.tracks.picture import PaintedPath, draw_track
from racecraft.worlds.deepracer.tracks.track import Track

if TYPE_CHECKING:
    import polars as pl
    from matplotlib.figure import Figure

DARK_RED = "#8f1d00"
"""For many small marks on a green field."""
BOX_COLOUR = "#d6aa78"


def draw_path(
    path: str | Path,
    track: Track,
    drive: Drive | Array | pl.DataFrame,
    *,
    title: str | None = None,
    dpi: int = 160,
    objects: tuple[Array, Array] | None = None,
) -> Figure:
    """Draw what was driven on the circuit, coloured by driven speed; where the car left the road stands a cross.

    Boxes stand where the last lap met them, bots where it ended.

    Args:
        path: File to write: .png, .svg or .pdf.
        track: The circuit as it was driven.
        drive: T ticks of one car: a drive, TICK_REPORT (T,) or rows of an episode file; laps are laid over each other.
        title: Headline; the circuit and how it ended when None.
        dpi: Points per inch of a .png.
        objects: Boxes and bots in every tick, (T, K, 6) and their kinds (T, K), as `objects.Objects` has them.

    Returns:
        The figure.

    Raises:
        DriveError: The rows are no drive.
        FigureError: The path has another ending.
        OutputFileError: The file cannot be written.
    """
    drive = as_drive(drive)
    drive = drive if objects is None else replace(drive, boxes=objects[0][-1])
    words = title if title is not None else story(track.title or track.name, drive)
    figure = path_figure(track, drive, words)
    save_figure(figure, path, dpi)
    return figure


def path_figure(track: Track, drive: Drive, title: str) -> Figure:
    """Return what `draw_path` writes, for a page."""
    laps = [drive.of_lap(int(number)) for number in np.unique(drive.lap)]
    limits = speed_limits(drive)
    painted = [PaintedPath(lap.xy, lap.driven_mps, "driven speed (m/s)", limits) for lap in laps if len(lap) > 1]
    figure = draw_track(track, paths=painted, number_every=0, title=title)
    mark_exits(figure, drive.xy[np.isin(drive.status, tuple(GRIEF))], words=incidents(drive.status))
    if drive.boxes is not None:
        draw_boxes(figure, drive.boxes)
    return figure


def draw_boxes(figure: Figure, boxes: Array) -> None:
    """Draw boxes (K, 6) on a circuit's picture, from above."""
    from matplotlib.patches import Rectangle

    for x, y, yaw, half_length, half_width, _ in boxes:
        outline = Rectangle(
            (x - half_length, y - half_width), 2 * half_length, 2 * half_width, angle=math.degrees(yaw),
            rotation_point="center", facecolor=BOX_COLOUR, edgecolor=PAPER, linewidth=1.0, zorder=9,
        )  # fmt: skip
        figure.axes[0].add_patch(outline)


def speed_limits(drive: Drive) -> tuple[float, float]:
    """Return the driven speeds, m/s, that are drawn darkest and brightest; the standing start is left out of them."""
    low, high = np.percentile(drive.driven_mps, (3, 97))
    return float(min(low, high - 0.1)), float(high)


def mark_exits(figure: Figure, xy: Array, in_all: int | None = None, words: str = "left the road") -> None:
    """Put a cross where cars came to grief, (E, 2) m, and say in a corner what it means and how many there were."""
    if not len(xy):
        return
    axes = figure.axes[0]
    few = len(xy) <= 60
    far = not few and CRASHED not in words  # from the road: dark crosses are seen on grass, not on tar
    if few:
        axes.scatter(xy[:, 0], xy[:, 1], s=95, c="#ffffff", marker="X", linewidths=0, zorder=9)
    crosses = axes.scatter(
        xy[:, 0], xy[:, 1], s=48 if few else 26, c=DARK_RED if far else RED, marker="X", linewidths=0,
        alpha=1.0 if few else 0.6, zorder=9.1,
    )  # fmt: skip
    places = words if len(xy) == 1 else f"{words}, {len(xy):,} times"
    if in_all is not None and in_all > len(xy):
        places = f"{words}, the latest {len(xy):,} of {in_all:,} times"
    legend = axes.legend(
        [crosses], [places], loc="lower left", fontsize=10, borderaxespad=1.4, facecolor=PAPER, framealpha=0.9
    )
    legend.get_frame().set_linewidth(0)


def story(name: str, drive: Drive) -> str:
    """Return a headline: whose or where, and how it ended."""
    full = int((drive.status == LAP_COMPLETE).sum())
    if full > 1:
        return f"{name}: {full} laps, best {drive.best_lap_seconds:.2f} s"
    if full == 1 and len(drive.endings) > 1:
        return f"{name}: one lap, {drive.best_lap_seconds:.2f} s"
    if len(drive.endings):
        return f"{name}: {drive.outcome(int(drive.endings[-1]))}"
    return f"{name}: {drive.progress_percent[-1]:.0f} % of a lap"
