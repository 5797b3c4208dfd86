"""What of a lap survives each disturbance, as a picture: one bar each. Begin with `draw_robustness`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from racecraft.analysis.figures import save_figure
from racecraft.pages.colours import BLUE, GREEN, INK, ORANGE, PAPER, QUIET

if TYPE_CHECKING:
    from matplotlib.figure import Figure

INCHES_A_BAR = 0.34


def draw_robustness(bars: Sequence[Mapping[str, Any]], title: str, path: Path | None = None, note: str = "") -> Figure:
    """Draw one bar a disturbance: the mean progress, its interval, and how many laps were driven to the end.

    Args:
        bars: `disturbance`, `tries`, `full_laps`, `mean_progress_percent`, `mean_progress_low`, `mean_progress_high` of
            each, top to bottom; the first is what all are compared with, the last is all at once.
        title: Headline.
        path: File to write (.png, .svg, .pdf by its ending); None writes none.
        note: Stands below the headline.

    Raises:
        FigureError: The path has another ending.
        OutputFileError: It cannot be written.
    """
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    height = 1.7 + INCHES_A_BAR * len(bars)
    figure = Figure(figsize=(9.0, height), facecolor=PAPER)
    FigureCanvasAgg(figure)
    axes = figure.add_axes((0.2, 0.65 / height, 0.66, 1.0 - 1.7 / height))
    axes.set_facecolor(PAPER)
    means = [bar["mean_progress_percent"] for bar in bars]
    reach = [
        [mean - bar["mean_progress_low"] for mean, bar in zip(means, bars, strict=True)],
        [bar["mean_progress_high"] - mean for mean, bar in zip(means, bars, strict=True)],
    ]
    colours = [GREEN, *[BLUE] * (len(bars) - 2), ORANGE][: len(bars)]
    places = range(len(bars))
    axes.barh(places, means, color=colours, height=0.68)
    axes.errorbar(means, places, xerr=reach, fmt="none", ecolor=INK, elinewidth=1.2, capsize=3)
    for place, bar in zip(places, bars, strict=True):
        laps = f"{bar['full_laps']}/{bar['tries']} laps"
        axes.text(103.0, place, laps, va="center", fontsize=9, color=INK)
    axes.axvline(means[0], color=QUIET, lw=0.8, ls=":")
    axes.set_yticks(list(places), [str(bar["disturbance"]).replace("-", " ") for bar in bars])
    axes.set(ylim=(len(bars) - 0.4, -0.6), xlim=(0, 100))
    axes.set_xlabel("mean progress (% of a lap), with its 95 % interval over the tries", fontsize=9, color=QUIET)
    axes.tick_params(labelsize=9, colors=INK, length=2)
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)
    figure.text(0.03, 1.0 - 0.22 / height, title, fontsize=14, fontweight="bold", color=INK, va="top")
    figure.text(0.03, 1.0 - 0.56 / height, note, fontsize=9, color=QUIET, va="top")
    if path is not None:
        save_figure(figure, path, dpi=130)
    return figure
