"""A circuit drawn as one would hang it on the wall, with paths driven on it. Begin with `draw_track`.

The field and the road have the track's own colours as a camera sees them in daylight; lines and dashes lie where they
are painted. Figures are matplotlib's, made without its global state, so that threads may draw side by side.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from racecraft.contract.errors import TrackError
from racecraft.contract.message import Message
from racecraft.formats.atomic import atomic_file, make_folder
from racecraft.pages.colours import INK, PAPER, QUIET
from racecraft.worlds.deepracer.tracks.track import Track

if TYPE_CHECKING:
    from matplotlib.figure import Figure

DAYLIGHT = 1.31
"""A lit surface is this much brighter than its texture (facts: simapp camera images)."""
MARGIN_M = 0.45
WIDEST_IN, TALLEST_IN, SMALLEST_IN = 11.0, 8.0, 3.2
PATH_COLOURS, DARKEST = "plasma", 0.15
"""Colour map of paths, and the share of its dark end left out: it would be lost on the road."""


@dataclass(frozen=True)
class PaintedPath:
    """A path over the road, coloured by a value.

    Args:
        xy: (T, 2) m.
        value: (T,) what colours it, such as speed; None paints it in one colour.
        label: What the value is, with its unit: "speed (m/s)".
        limits: Lowest and highest value of the colours; when None those between which 94 of 100 values lie.
    """

    xy: np.ndarray
    value: np.ndarray | None = None
    label: str = ""
    limits: tuple[float, float] | None = None


def draw_track(
    track: Track,
    path: str | Path | None = None,
    *,
    paths: tuple[PaintedPath, ...] | list[PaintedPath] = (),
    number_every: int = 10,
    title: str | None = None,
    dpi: int = 160,
) -> Figure:
    """Draw a circuit and what was driven on it.

    Args:
        track: The circuit.
        path: File to write (.png, .svg, .pdf by its ending); None writes none.
        paths: Paths laid over the road; the first one with values gets a colour bar.
        number_every: Waypoints between two numbers; 0 for none.
        title: Headline; the track's title and name when None.
        dpi: Points per inch of a written .png.

    Returns:
        The figure, for a notebook or a report.

    Raises:
        TrackError: The ending is no picture's.
        OutputFileError: The file cannot be written.
    """
    figure, axes = _sheet(track, has_bar=any(p.value is not None for p in paths))
    _draw_ground(axes, track)
    _draw_lines(axes, track, quiet=bool(paths))
    _draw_start(axes, track)
    if number_every > 0:
        _draw_waypoints(axes, track, number_every, quiet=bool(paths))
    for painted in paths:
        _draw_path(figure, axes, painted)
    _draw_scale(axes, track)
    _write_title(axes, track, title)
    if path is not None:
        save_picture(figure, Path(path), dpi)
    return figure


def paint_ground(axes: Any, track: Track) -> None:
    """Paint the whole field, the road, its lines and the start line into somebody else's axes, in metres."""
    from matplotlib.patches import PathPatch, Rectangle

    x0, y0, x1, y1 = track.field_bounds
    axes.add_patch(Rectangle((x0, y0), x1 - x0, y1 - y0, fc=_lit(track.look.field), ec=INK, lw=1.0, zorder=0))
    axes.add_patch(PathPatch(_road_path(track), fc=_lit(track.look.road), ec="none", zorder=1))
    _draw_lines(axes, track, quiet=False)
    _draw_start(axes, track)


def _sheet(track: Track, has_bar: bool) -> tuple[Figure, Any]:
    """Return a figure cut to the circuit's shape, and its axes over the field around it."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    x0, y0, x1, y1 = _view(track)
    inches_per_m = min(WIDEST_IN / (x1 - x0), TALLEST_IN / (y1 - y0))
    width, height = (x1 - x0) * inches_per_m, (y1 - y0) * inches_per_m
    bar = 0.9 if has_bar else 0.0
    sheet = Figure(figsize=(max(width, SMALLEST_IN) + bar + 0.3, height + 0.95), facecolor=PAPER)
    FigureCanvasAgg(sheet)
    total_w, total_h = sheet.get_size_inches()
    axes = sheet.add_axes((0.15 / total_w, 0.15 / total_h, 1 - (0.3 + bar) / total_w, 1 - 0.95 / total_h))
    axes.set_xlim(x0, x1)
    axes.set_ylim(y0, y1)
    axes.set_aspect("equal")
    axes.set_axis_off()
    return sheet, axes


def _view(track: Track) -> tuple[float, float, float, float]:
    """Return the part of the field that is shown: the road and a margin, wider where the road is wide."""
    x0, y0, x1, y1 = track.bounds
    margin = MARGIN_M + 0.04 * max(x1 - x0, y1 - y0)
    return x0 - margin, y0 - margin, x1 + margin, y1 + margin


def _draw_ground(axes: Any, track: Track) -> None:
    """Paint field and road; a loop's road is a ring with a hole."""
    from matplotlib.patches import FancyBboxPatch, PathPatch

    x0, y0, x1, y1 = _view(track)
    rounded = f"round,pad=0,rounding_size={0.03 * min(x1 - x0, y1 - y0) + 0.1}"
    axes.add_patch(
        FancyBboxPatch((x0, y0), x1 - x0, y1 - y0, boxstyle=rounded, fc=_lit(track.look.field), ec="none", zorder=0)
    )
    axes.add_patch(PathPatch(_road_path(track), fc=_lit(track.look.road), ec="none", zorder=1))


def _road_path(track: Track) -> Any:
    from matplotlib.path import Path as Outline

    shell, hole = track.arrays().shell, track.arrays().hole
    rings = [shell] if len(hole) == 0 else [shell, hole[::-1]] if _same_turn(shell, hole) else [shell, hole]
    codes = [[Outline.MOVETO] + [Outline.LINETO] * (len(ring) - 2) + [Outline.CLOSEPOLY] for ring in rings]
    return Outline(np.concatenate(rings), np.concatenate(codes))


def _draw_lines(axes: Any, track: Track, quiet: bool) -> None:
    """Paint the white border lines at their true width and side, and the dashes along the centre."""
    from matplotlib.collections import PolyCollection

    look = track.look
    if look.line_side != "none" and look.line_width > 0:
        for border, other in ((track.inner, track.outer), (track.outer, track.inner)):
            step = look.line_width * _sideways(border, other - border) * (1 if look.line_side == "inside" else -1)
            strip = np.stack([border[:-1], border[1:], border[1:] + step[1:], border[:-1] + step[:-1]], axis=1)
            colour = _lit(look.line)
            axes.add_collection(
                PolyCollection(list(strip), facecolors=colour, edgecolors=colour, linewidths=0.5, zorder=2)
            )
    if look.dash_length > 0:
        period = look.dash_length + look.dash_gap
        starts = np.arange(0.0, track.length - look.dash_length, period)
        ends = [_points_at(track, starts), _points_at(track, starts + look.dash_length)]
        along = ends[1] - ends[0]
        across = np.stack([-along[:, 1], along[:, 0]], axis=1) / np.hypot(*along.T)[:, None] * look.dash_width / 2
        dashes = np.stack([ends[0] - across, ends[1] - across, ends[1] + across, ends[0] + across], axis=1)
        colour, opacity = ((1.0, 1.0, 1.0), 0.3) if quiet else (_lit(look.dash), 1.0)
        axes.add_collection(
            PolyCollection(list(dashes), facecolors=colour, edgecolors=colour, linewidths=0.4, alpha=opacity, zorder=3)
        )


def _draw_start(axes: Any, track: Track) -> None:
    """Paint the start line across the road, the finish of an open track, and an arrow in driving direction."""
    _draw_line_across(axes, track, 0.0, 1.0)
    if not track.closed:
        _draw_line_across(axes, track, track.length, -1.0)
    _draw_arrow(axes, track)


def _draw_line_across(axes: Any, track: Track, arc: float, side: float) -> None:
    """Paint two rows of squares across the road at a place, ahead of it (`side` 1) or behind (-1)."""
    from matplotlib.collections import PolyCollection

    at = track.pose_at(arc)
    ahead = side * np.array([math.cos(at.yaw), math.sin(at.yaw)])
    place = track.locate(np.array([[at.x, at.y]]))
    first, last = place.inner_point[0], place.outer_point[0]
    if track.look.line_side == "inside":
        painted = (last - first) / np.hypot(*(last - first)) * track.look.line_width
        first, last = first + painted, last - painted
    depth = 0.09 * track.width_mean
    squares, count = [], 12
    for row in range(2):
        for k in range(row % 2, count, 2):
            a, b = first + (last - first) * k / count, first + (last - first) * (k + 1) / count
            low, high = ahead * depth * row, ahead * depth * (row + 1)
            squares.append([a + low, b + low, b + high, a + high])
    whole = [first, last, last + 2 * depth * ahead, first + 2 * depth * ahead]
    axes.add_collection(PolyCollection([whole], facecolors="#f4f4f2", edgecolors="none", zorder=4))
    axes.add_collection(PolyCollection(squares, facecolors=INK, edgecolors="none", zorder=4))


def _draw_arrow(axes: Any, track: Track) -> None:
    """Paint a plump arrow on the road a little after the start, seen in driving direction."""
    from matplotlib.patches import Polygon

    size = 0.42 * track.width_mean
    at = track.pose_at(min(1.3 * track.width_mean, 0.2 * track.length))
    outline = size * np.array([(0.62, 0), (-0.38, 0.5), (-0.18, 0), (-0.38, -0.5)])
    turn = np.array([[math.cos(at.yaw), -math.sin(at.yaw)], [math.sin(at.yaw), math.cos(at.yaw)]])
    axes.add_patch(Polygon(outline @ turn.T + (at.x, at.y), closed=True, fc="#ffffff", ec="none", alpha=0.95, zorder=6))


def _draw_waypoints(axes: Any, track: Track, every: int, quiet: bool) -> None:
    """Mark every so many waypoints on the centre line and number them outside the road, as rewards count them."""
    own = track.of_filed_rows()
    numbers = np.arange(0, len(own) - (1 if track.closed else 0), every)
    if track.closed and len(numbers) > 1 and track.length - track.arc[own[numbers[-1]]] < 0.6 * track.width_mean:
        numbers = numbers[:-1]
    rows = own[numbers]
    if not quiet:
        axes.scatter(*track.centre[rows].T, s=11, c="#ffffff", edgecolors=INK, linewidths=0.5, zorder=5)
    border = track.locate(track.centre[rows]).outer_point
    outward = border - track.centre[rows]
    outward /= np.hypot(*outward.T)[:, None]
    x0, _, x1, _ = _view(track)
    places = border + outward * (0.09 + 0.014 * (x1 - x0))
    for number, (x, y) in zip(numbers, places, strict=True):
        if track.locate(np.array([[x, y]])).distance[0] < 0.55 * track.width_mean:
            continue  # another stretch of road lies there
        axes.text(
            x,
            y,
            str(number),
            ha="center",
            va="center",
            fontsize=8,
            color=_ink_on(track.look.field),
            alpha=0.85,
            zorder=5,
        )


def _draw_path(figure: Figure, axes: Any, painted: PaintedPath) -> None:
    """Lay a path over the road, coloured by its value, with a colour bar on the right."""
    from matplotlib import colormaps
    from matplotlib.collections import LineCollection
    from matplotlib.colors import ListedColormap

    xy = np.asarray(painted.xy, dtype=np.float64)
    steps = list(np.stack([xy[:-1], xy[1:]], axis=1))
    if painted.value is None:
        axes.add_collection(LineCollection(steps, colors="#ff5a4f", linewidths=1.6, alpha=0.9, zorder=7))
        return
    value = np.asarray(painted.value, dtype=np.float64)
    axes.add_collection(LineCollection(steps, colors=INK, linewidths=4.2, alpha=0.55, capstyle="round", zorder=6.5))
    colours = ListedColormap(colormaps[PATH_COLOURS](np.linspace(DARKEST, 1.0, 256)))
    lines = LineCollection(steps, cmap=colours, linewidths=2.8, capstyle="round", zorder=7)
    lines.set_array((value[:-1] + value[1:]) / 2)
    low, high = painted.limits or np.nanpercentile(value, (3, 97))
    lines.set_clim(low, high if high > low else low + 1e-9)
    axes.add_collection(lines)
    if len(figure.axes) > 1:
        return
    total_w, total_h = figure.get_size_inches()
    box = axes.get_position()
    slot = figure.add_axes((box.x1 + 0.18 / total_w, box.y0 + 0.1 * box.height, 0.14 / total_w, 0.8 * box.height))
    bar = figure.colorbar(lines, cax=slot, extend="neither" if painted.limits else "both", extendfrac=0.03)
    bar.outline.set_visible(False)
    bar.ax.tick_params(labelsize=8, colors=INK, length=0)
    bar.set_label(painted.label, fontsize=9, color=INK)


def _draw_scale(axes: Any, track: Track) -> None:
    """Paint a scale bar of a round length in the lower right corner."""
    x0, y0, x1, y1 = _view(track)
    wanted = 0.12 * (x1 - x0)
    step = 10.0 ** math.floor(math.log10(wanted))
    length = max(m * step for m in (1, 2, 5) if m * step <= wanted)
    right, low = x1 - 0.035 * (x1 - x0), y0 + 0.035 * (y1 - y0)
    colour = _ink_on(track.look.field)
    tick = 0.008 * (y1 - y0)
    axes.plot([right - length, right], [low, low], color=colour, lw=1.4, solid_capstyle="butt", zorder=8)
    for x in (right - length, right):
        axes.plot([x, x], [low - tick, low + tick], color=colour, lw=1.4, zorder=8)
    axes.text(right - length / 2, low + 1.6 * tick, f"{length:g} m", ha="center", va="bottom", fontsize=8, color=colour)


def _write_title(axes: Any, track: Track, title: str | None) -> None:
    """Write the headline and, below it, length, width, direction and the number of waypoints."""
    figure = axes.figure
    _, total_h = figure.get_size_inches()
    left = axes.get_position().x0
    headline = title if title is not None else track.title or track.name
    way = {"ccw": "counter-clockwise", "cw": "clockwise", "open": "open"}[track.direction]
    facts = [f"{track.length:.2f} m", f"{track.width_mean:.2f} m wide", way, f"{len(track.of_filed_rows())} waypoints"]
    if headline != track.name:
        facts.insert(0, track.name)
    if track.is_reversed:
        facts.append("reversed")
    figure.text(left, 1 - 0.16 / total_h, headline, fontsize=16, fontweight="bold", color=INK, va="top", ha="left")
    figure.text(left, 1 - 0.5 / total_h, "   ·   ".join(facts), fontsize=9, color=QUIET, va="top", ha="left")


def save_picture(figure: Figure, path: Path, dpi: int = 160) -> None:
    """Write a figure in one move, in the format of the path's ending.

    Raises:
        TrackError: The ending is no picture's.
        OutputFileError: The file cannot be written.
    """
    kind = path.suffix.lstrip(".").lower() or "png"
    if kind not in figure.canvas.get_supported_filetypes():
        raise TrackError(path, Message("the ending .{kind}", kind=kind), "a picture: .png, .svg or .pdf")
    make_folder(path.parent)
    with atomic_file(path) as part:
        figure.savefig(part, format=kind, dpi=dpi, facecolor=PAPER)


def _points_at(track: Track, arcs: np.ndarray) -> np.ndarray:
    return np.stack([np.interp(arcs, track.arc, track.centre[:, k]) for k in (0, 1)], axis=1)


def _sideways(line: np.ndarray, towards: np.ndarray) -> np.ndarray:
    """Return unit vectors (K, 2) square to a line, all on the side to which most of `towards` points."""
    along = np.gradient(line, axis=0)
    if (line[0] == line[-1]).all():
        along[0] = along[-1] = line[1] - line[-2]
    across = np.stack([-along[:, 1], along[:, 0]], axis=1)
    across /= np.maximum(np.hypot(*across.T), 1e-12)[:, None]
    return across if np.sum(across * towards) > 0 else -across


def _same_turn(a: np.ndarray, b: np.ndarray) -> bool:
    def twice_area(ring: np.ndarray) -> float:
        return float(np.sum(ring[:-1, 0] * ring[1:, 1] - ring[1:, 0] * ring[:-1, 1]))

    return (twice_area(a) > 0) == (twice_area(b) > 0)


def _lit(texture: tuple[int, int, int]) -> tuple[float, float, float]:
    """Return a texture's colour as daylight shows it, 0 to 1; the sun's light is a little short of blue."""
    r, g, b = (min(1.0, DAYLIGHT * part / 255) for part in texture)
    return r, g, b


def _ink_on(texture: tuple[int, int, int]) -> str:
    """Return the ink that is read best on a ground of this texture."""
    r, g, b = _lit(texture)
    return INK if 0.3 * r + 0.59 * g + 0.11 * b > 0.45 else "#ffffff"
