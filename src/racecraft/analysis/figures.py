"""Pictures of a training and of a lap, as files. Begin with `draw_path` and `draw_curves`.

Colours are those of Okabe and Ito, told apart by colour-blind eyes; every curve also has a shape of its own. Figures
are matplotlib's, made without its global state.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from racecraft.contract.errors import UserInputError
from racecraft.contract.world import Array
from racecraft.formats.whole import whole_file
from racecraft.worlds.deepracer.analysis.drive import CRASHED, GRIEF, LAP_COMPLETE, Drive, as_drive, what_befell
from racecraft.worlds.deepracer.tracks.picture import INK, PAPER, QUIET, PaintedPath, draw_track
from racecraft.worlds.deepracer.tracks.track import Track

if TYPE_CHECKING:
    import polars as pl
    from matplotlib.figure import Figure

BLUE, ORANGE, GREEN, RED = "#0072b2", "#e69f00", "#009e73", "#d55e00"
DARK_RED = "#8f1d00"
"""For many small marks on a green field."""
BOX_COLOUR = "#d6aa78"
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
    "progress (% of a lap)",
    (Curve("training_score", "training", ORANGE), Curve("evaluation_score", "evaluation", BLUE, dots=True)),
    lowest=0.0,
)
"""The chart that matters; its title is changed where a score is no progress."""
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
    mark_exits(figure, drive.xy[np.isin(drive.status, tuple(GRIEF))], words=what_befell(drive.status))
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


def draw_curves(
    path: str | Path, metrics: MetricRows, *, title: str = "", score_name: str = "progress (% of a lap)", dpi: int = 140
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


def panel_figure(
    metrics: MetricRows,
    panel: Panel,
    width_in: float = 4.2,
    height_in: float = 2.7,
    size: float = 11,
    steps_on_top: bool = False,
) -> Figure:
    """Return one panel as a figure of its own, for a page."""
    figure = _sheet(width_in, height_in)
    draw_panel(figure.add_subplot(), metrics, panel, size, steps_on_top)
    return figure


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
    shown = [curve for curve in panel.curves if _has_values(metrics, curve)]
    for curve in shown:
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
    if len(shown) > 1:
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
            raise FigureError(f"Line {number} of the metrics has no seconds or steps; expected both in every line.")


def save_figure(figure: Figure, path: str | Path, dpi: int) -> Path:
    """Write a figure in one move.

    Raises:
        FigureError: The path has another ending.
        OutputFileError: The file cannot be written.
    """
    path = Path(path)
    kind = path.suffix.lstrip(".").lower()
    if kind not in KINDS:
        raise FigureError(f"{path}: pictures are written as .png, .svg or .pdf; got '{path.suffix}'. Rename it.")
    with whole_file(path) as part:
        figure.savefig(part, format=kind, dpi=dpi)
    return path


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
    for size, letter in ((1e6, "M"), (1e3, "k")):
        if value >= size:
            return f"{value / size:g}{letter}"
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
