"""A plot: data that are computed at once, and a figure that is drawn when it is looked at. Begin with `Plot`."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

from racecraft.analysis.figures import save_figure
from racecraft.contract.errors import UserInputError
from racecraft.pages.colours import INK, PAPER, QUIET

if TYPE_CHECKING:
    import polars as pl
    from matplotlib.figure import Figure


class PlotError(UserInputError):
    """A plot or table cannot be made of these ticks."""


@dataclass(frozen=True, eq=False)
class Plot:
    """Data and their figure.

    Args:
        name: Short, for file names.
        title: What is shown.
        data: One row each thing shown; columns carry their units.
        draw: Makes the figure.
    """

    name: str
    title: str
    data: pl.DataFrame
    draw: Callable[[], Figure]

    @cached_property
    def figure(self) -> Figure:
        """The figure, drawn at the first look."""
        return self.draw()

    def save(self, path: str | Path, dpi: int = 140) -> Path:
        """Write the figure to .png, .svg or .pdf.

        Raises:
            FigureError: The path has another ending.
            OutputFileError: The file cannot be written.
        """
        return save_figure(self.figure, path, dpi)

    def without_title(self) -> Figure:
        """Return a figure of its own for a place whose heading says the title; several plots in one keep theirs."""
        figure = self.draw()
        if len(named := [axes for axes in figure.axes if axes.get_title(loc="left") or axes.get_title()]) == 1:
            named[0].set_title("", loc="left")
            named[0].set_title("")
        return figure

    def _repr_png_(self) -> bytes:
        """Return the picture that a notebook shows for the last value of a cell."""
        import io

        out = io.BytesIO()
        self.figure.savefig(out, format="png", dpi=100)
        return out.getvalue()


def sheet(rows: int, columns: int, titles: Sequence[str], size: tuple[float, float] = (4.0, 2.9)) -> tuple[Any, list]:
    """Return a figure with a grid of plain charts and the list of its axes; charts without a title are left out."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(size[0] * columns, size[1] * rows), facecolor=PAPER, layout="constrained")
    FigureCanvasAgg(figure)
    axes = []
    for k, title in enumerate(titles):
        one = figure.add_subplot(rows, columns, k + 1)
        one.set_title(title, loc="left", fontsize=11, color=INK)
        for side in ("top", "right"):
            one.spines[side].set_visible(False)
        for side in ("left", "bottom"):
            one.spines[side].set_color(QUIET)
        one.grid(color=QUIET, alpha=0.2, lw=0.8)
        one.set_axisbelow(True)
        one.tick_params(labelsize=9, colors=INK, length=2)
        axes.append(one)
    return figure, axes
