"""What a car sees under every disturbance, as one sheet of frames. Begin with `draw_sheet`."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from racecraft.analysis.figures import save_figure
from racecraft.contract.world import Array
from racecraft.pages.colours import INK, PAPER, QUIET

if TYPE_CHECKING:
    from matplotlib.figure import Figure

FRAME_INCHES = 1.9


def draw_sheet(rows: Sequence[tuple[str, Array]], title: str, note: str, path: Path | None = None) -> Figure:
    """Draw frames pixel by pixel, a row a disturbance, a column a draw.

    Args:
        rows: Name and frames, uint8 (C, H, W), of each row, C the same in all.
        title: Headline.
        note: Stands below it.
        path: File to write (.png, .svg, .pdf by its ending); None writes none.

    Raises:
        FigureError: The path has another ending.
        OutputFileError: It cannot be written.
    """
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    columns, (high, wide) = len(rows[0][1]), rows[0][1].shape[1:]
    row_inches = FRAME_INCHES * high / wide + 0.08
    size = 1.5 + FRAME_INCHES * columns, 0.95 + row_inches * len(rows)
    figure = Figure(figsize=size, facecolor=PAPER)
    FigureCanvasAgg(figure)
    grid = figure.add_gridspec(
        len(rows), columns, left=1.4 / size[0], right=1.0 - 0.1 / size[0], bottom=0.1 / size[1],
        top=1.0 - 0.85 / size[1], wspace=0.04, hspace=0.05,
    )  # fmt: skip
    for place, (name, frames) in enumerate(rows):
        for column, frame in enumerate(frames):
            axes = figure.add_subplot(grid[place, column])
            axes.imshow(frame, cmap="gray", vmin=0, vmax=255, interpolation="nearest")
            axes.set(xticks=[], yticks=[])
            if column == 0:
                label = name.replace("-", " ")
                axes.set_ylabel(label, rotation=0, ha="right", va="center", labelpad=8, fontsize=10, color=INK)
    figure.text(0.1 / size[0], 1.0 - 0.15 / size[1], title, fontsize=14, fontweight="bold", color=INK, va="top")
    figure.text(0.1 / size[0], 1.0 - 0.5 / size[1], note, fontsize=9, color=QUIET, va="top")
    if path is not None:
        save_figure(figure, path, dpi=110)
    return figure
