"""Curves of a training, as files. Begin with `draw_curves`.

Every curve has a colour and a shape of its own. Figures are matplotlib's, made without its global state.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from racecraft.contract.errors import UserInputError
from racecraft.contract.world import Array
from racecraft.formats.atomic import atomic_file
from racecraft.pages.chart import Chart, Series
from racecraft.pages.colours import BLUE, GREEN, INK, ORANGE, PAPER, QUIET

if TYPE_CHECKING:
    from matplotlib.figure import Figure

KINDS = ("png", "svg", "pdf")

MetricRows = Sequence[Mapping[str, Any]]


class FigureError(UserInputError):
    """A picture cannot be drawn of what was given."""


@dataclass(frozen=True)
class Curve:
    """One column of the metrics in a panel."""

    column: str
    label: str
    colour: str = BLUE
    dots: bool = False
    """Few values, each worth seeing."""


@dataclass(frozen=True)
class Panel:
    """One small chart."""

    title: str
    """What is shown, with its unit."""
    curves: tuple[Curve, ...]
    lowest: float | None = None
    """Where the axis begins; None: at the data."""


LEARNING = Panel(
    "score",
    (Curve("training_score", "training", ORANGE), Curve("evaluation_score", "evaluation", BLUE, dots=True)),
    lowest=0.0,
)
"""The chart that matters; what the score is called depends on the world."""
REWARD = Panel("mean reward of an episode", (Curve("mean_reward", "training", ORANGE),))
"""What the reward function paid for a whole episode, in the mean."""
SMALL_PANELS = (
    REWARD,
    Panel("best lap (s)", (Curve("best_lap_seconds", "evaluation", BLUE, dots=True),)),
    Panel("entropy of the policy (nat)", (Curve("entropy", "entropy", GREEN),)),
    Panel("value loss", (Curve("value_loss", "value loss", GREEN),), lowest=0.0),
    Panel("change of the policy (KL, nat)", (Curve("approx_kl", "KL", GREEN),), lowest=0.0),
    Panel("explained variance", (Curve("explained_variance", "explained", GREEN),)),
    Panel("steps a second", (Curve("steps_per_second", "steps/s", GREEN),), lowest=0.0),
)


def draw_curves(
    path: str | Path, metrics: MetricRows, *, title: str = "", score_name: str = "score", dpi: int = 140
) -> Figure:
    """Draw how a training went: the scores large, beneath them laps, losses and speed.

    Args:
        path: File to write: .png, .svg or .pdf.
        metrics: Lines of metrics.jsonl, as `RunFolder.read_metrics` returns them.
        title: Headline.
        score_name: What the scores are, with their unit.
        dpi: Points per inch of a .png.

    Returns:
        The figure.

    Raises:
        FigureError: There are no metrics, or the path has another ending.
        OutputFileError: The file cannot be written.
    """
    require_metrics(metrics)
    small = small_panels(metrics)
    rows = -(-len(small) // 3)
    figure = _sheet(11.0, 4.6 + 2.5 * rows + (0.4 if title else 0.0))
    grid = figure.add_gridspec(1 + rows, 3, height_ratios=[1.75] + [1.0] * rows)
    large = figure.add_subplot(grid[0, :])
    draw_panel(large, metrics, Panel(score_name, LEARNING.curves, LEARNING.lowest), size=13, steps_on_top=True)
    for k, panel in enumerate(small):
        axes = figure.add_subplot(grid[1 + k // 3, k % 3])
        draw_panel(axes, metrics, panel, size=11)
        if k + 3 < len(small):
            axes.set_xlabel("")  # another panel with the same axis stands below
    if title:
        figure.suptitle(title, x=0.012, ha="left", fontsize=17, fontweight="bold", color=INK)
    save_figure(figure, path, dpi)
    return figure


def panel_figure(metrics: MetricRows, panel: Panel, width_in: float = 4.2, height_in: float = 2.7) -> Figure:
    """Return one panel as a figure of its own."""
    figure = _sheet(width_in, height_in)
    draw_panel(figure.add_subplot(), metrics, panel, 11)
    return figure


def panel_chart(metrics: MetricRows, panel: Panel) -> Chart:
    """Return one panel over training time as a chart of a page."""
    seconds = np.array([row["seconds"] for row in metrics], float)
    divisor, unit = _time_unit(float(seconds[-1]))
    series = []
    for curve in panel.curves:
        if _has_values(metrics, curve):
            at, values = _column(metrics, seconds, curve.column)
            colour = {BLUE: 1, ORANGE: 2, GREEN: 3}[curve.colour]
            series.append(Series(curve.label, at / divisor, values, "both" if curve.dots else "line", colour=colour))
    return Chart(panel.title, f"training time, {unit}", panel.title, series, low=panel.lowest, smooth=True)


def small_axes(title: str, width_in: float, height_in: float, size: float) -> tuple[Figure, Any]:
    """Return an empty chart for a page in the manner of the others, and its axes; `size` in points."""
    figure = _sheet(width_in, height_in)
    axes = figure.add_subplot()
    axes.set_title(title, loc="left", fontsize=size, color=INK, pad=8)
    _strip(axes, size - 1)
    return figure, axes


def draw_panel(axes: Any, metrics: MetricRows, panel: Panel, size: float, steps_on_top: bool = False) -> None:
    """Draw one panel over training time; `size` is that of the letters, in points."""
    seconds = np.array([row["seconds"] for row in metrics], float)
    divisor, unit = _time_unit(float(seconds[-1]))
    curves = [curve for curve in panel.curves if _has_values(metrics, curve)]
    for curve in curves:
        at, values = _column(metrics, seconds, curve.column)
        marker = "o" if curve.dots or len(values) == 1 else ""
        axes.plot(
            at / divisor, values, color=curve.colour, label=curve.label, lw=1.8 if len(values) < 400 else 1.0,
            marker=marker, ms=5.5 if len(values) < 80 else 2.5, mec=PAPER, mew=0.6, solid_capstyle="round",
            clip_on=False,
        )  # fmt: skip
    axes.set_title(panel.title, loc="left", fontsize=size, color=INK, pad=8)
    axes.set_xlim(0.0, seconds[-1] / divisor)
    if panel.lowest is not None:
        axes.set_ylim(bottom=panel.lowest)
    _strip(axes, size - 1)
    axes.set_xlabel(f"training time ({unit})", fontsize=size - 1, color=QUIET)
    if len(curves) > 1:
        axes.legend(frameon=False, fontsize=size - 1, labelcolor=INK, loc="best")
    if steps_on_top:
        _steps_axis(axes, seconds / divisor, np.array([row["steps"] for row in metrics], float), size - 1)


def small_panels(metrics: MetricRows) -> list[Panel]:
    """Return the small panels worth drawing: those with values; rewards only where they are not the score itself."""
    is_score = all(row.get("mean_reward") == row.get("training_score") for row in metrics)
    return [panel for panel in SMALL_PANELS if has_values(metrics, panel) and not (panel is REWARD and is_score)]


def has_values(metrics: MetricRows, panel: Panel) -> bool:
    """Tell whether a panel would show anything."""
    return any(_has_values(metrics, curve) for curve in panel.curves)


def _has_values(metrics: MetricRows, curve: Curve) -> bool:
    return any(row.get(curve.column) is not None for row in metrics)


def require_metrics(metrics: MetricRows) -> None:
    """Refuse an empty table of metrics, and one without time.

    Raises:
        FigureError: There is nothing to draw.
    """
    if not metrics:
        raise FigureError("There are no metrics yet; expected at least one iteration. Let the training finish one.")
    for number, row in enumerate(metrics, 1):
        if row.get("seconds") is None or row.get("steps") is None:
            raise FigureError(
                "Line {number} of the metrics has no seconds or steps; expected both in every line.", number=number
            )


def save_figure(figure: Figure, path: str | Path, dpi: int) -> Path:
    """Write a figure in one move.

    Raises:
        FigureError: The path has another ending.
        OutputFileError: The file cannot be written.
    """
    path = Path(path)
    kind = path.suffix.lstrip(".").lower()
    if kind not in KINDS:
        raise FigureError(
            "{path}: pictures are written as .png, .svg or .pdf; got '{suffix}'. Rename it.",
            path=path,
            suffix=path.suffix,
        )
    with atomic_file(path) as part:
        figure.savefig(part, format=kind, dpi=dpi)
    return path


def _column(metrics: MetricRows, seconds: Array, name: str) -> tuple[Array, Array]:
    """Return times and values of a column where it has values."""
    values = np.array([np.nan if row.get(name) is None else row[name] for row in metrics], float)
    there = np.isfinite(values)
    return seconds[there], values[there]


def _time_unit(last: float) -> tuple[float, str]:
    """Return the seconds in a unit that suits a training of that length, and its name."""
    return (1.0, "s") if last < 180 else (60.0, "min") if last < 3 * 3600 else (3600.0, "h")


def _steps_axis(axes: Any, time: Array, steps: Array, size: float) -> None:
    """Write environment steps along the upper edge."""
    from matplotlib.ticker import MaxNLocator

    time, steps = np.concatenate([[0.0], time]), np.concatenate([[0.0], steps])
    top = axes.secondary_xaxis(
        "top", functions=(lambda t: np.interp(t, time, steps), lambda n: np.interp(n, steps, time))
    )
    top.set_xlabel("environment steps", fontsize=size, color=QUIET, labelpad=7)
    ticks = [tick for tick in MaxNLocator(6).tick_values(0.0, steps[-1]) if tick <= steps[-1]]
    places = np.interp(ticks, steps, time)
    apart = [k for k in range(len(ticks)) if k == 0 or places[k] - places[k - 1] > 0.04 * time[-1]]
    top.set_ticks([ticks[k] for k in apart])
    top.xaxis.set_major_formatter(lambda value, _: thousands(value))
    top.tick_params(labelsize=size, colors=QUIET, length=3)
    top.spines["top"].set_visible(False)


def thousands(value: float) -> str:
    """Return a count as a person writes it on an axis.

    >>> thousands(0), thousands(2500), thousands(40_000), thousands(3e6)
    ('0', '2.5k', '40k', '3M')
    """
    for size, suffix in ((1e6, "M"), (1e3, "k")):
        if value >= size:
            return f"{value / size:g}{suffix}"
    return f"{value:g}"


def _sheet(width_in: float, height_in: float) -> Figure:
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(width_in, height_in), facecolor=PAPER, layout="constrained")
    FigureCanvasAgg(figure)
    figure.get_layout_engine().set(w_pad=0.12, h_pad=0.12)  # type: ignore[union-attr,call-arg]
    return figure


def _strip(axes: Any, size: float) -> None:
    """Take away what is no data: box, heavy grid, ticks."""
    axes.set_facecolor("none")
    for side in ("top", "right", "left"):
        axes.spines[side].set_visible(False)
    axes.spines["bottom"].set_color(QUIET)
    axes.grid(axis="y", color=QUIET, alpha=0.25, lw=0.8)
    axes.set_axisbelow(True)
    axes.tick_params(labelsize=size, colors=QUIET, length=0)
