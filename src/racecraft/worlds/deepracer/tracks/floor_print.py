"""A track printed to scale: pages to lay side by side and tape over. Begin with `print_floor`.

The first page is a plan with the number of each page and a bill of tape; it says how to check the scale. Every further
page shows its part of the floor at 1:1 with an overlap on each side, crosses at the corners of its tile for laying
pages on one another, and a bar of 100 mm. Pages through which no line runs are left out.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from racecraft.contract.errors import SettingError
from racecraft.formats.atomic import atomic_file
from racecraft.pages.colours import INK, PAPER, QUIET
from racecraft.worlds.deepracer.tracks.smooth_line import running_length
from racecraft.worlds.deepracer.tracks.track import Track

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

PAPERS_MM = {"A4": (210.0, 297.0), "A3": (297.0, 420.0), "A0": (841.0, 1189.0), "letter": (215.9, 279.4)}
MM_PER_INCH, POINTS_PER_MM = 25.4, 72.0 / 25.4
MARGIN_MM, OVERLAP_MM = 10.0, 10.0
"""What printers leave white, and what two neighbouring pages both show."""
LINE_MM = 1.0
MAX_PAGES = 900
BAR_MM = 100.0
DASH_M, GAP_M = 0.15, 0.15
"""Of the centre line."""


@dataclass(frozen=True)
class Tape:
    """Metres of tape for a track."""

    borders_m: float
    centre_m: float
    """Dashes, without the gaps between them."""
    start_m: float

    @property
    def total_m(self) -> float:
        """All of it."""
        return self.borders_m + self.centre_m + self.start_m


@dataclass(frozen=True)
class FloorPrint:
    """What was printed."""

    file: Path
    paper: str
    pages: int
    """Of the floor, without the plan."""
    tape: Tape


@dataclass(frozen=True)
class _Tile:
    """The part of the floor that a page shows."""

    row: int
    column: int
    x: float
    y: float
    """Its lower left corner, m; overlaps lie outside."""

    @property
    def name(self) -> str:
        """Row by letter from the top, column by number from the left."""
        return f"{_row_letters(self.row)}{self.column + 1}"


def tape_of(track: Track) -> Tape:
    """Return the metres of tape that a track takes.

    >>> from racecraft.worlds.deepracer.tracks.catalogue import load_track
    >>> round(tape_of(load_track("reinvent_base")).total_m)
    45
    """
    borders = sum(float(running_length(line)[-1]) for line in (track.inner, track.outer))
    return Tape(borders, track.length * DASH_M / (DASH_M + GAP_M), float(np.hypot(*(track.inner[0] - track.outer[0]))))


def print_floor(track: Track, path: Path, paper: str = "A4") -> FloorPrint:
    """Write a PDF of a track at 1:1.

    Args:
        track: The track.
        path: File to write, .pdf.
        paper: One of PAPERS_MM.

    Raises:
        SettingError: An unknown paper, another ending, or more than MAX_PAGES pages.
        OutputFileError: The file cannot be written.
    """
    if paper not in PAPERS_MM:
        raise SettingError("paper is {paper!r}; expected one of {papers}.", paper=paper, papers=", ".join(PAPERS_MM))
    if path.suffix.lower() != ".pdf":
        raise SettingError("{path}: expected a name that ends in .pdf.", path=path)
    from matplotlib.backends.backend_pdf import PdfPages

    size = PAPERS_MM[paper]
    tiles = _tiles(track, size)
    if len(tiles) > MAX_PAGES:
        raise SettingError(
            "{track} takes {count} pages of {paper}; expected at most {most}. Use larger paper, or a smaller track.",
            track=track.name, count=len(tiles), paper=paper, most=MAX_PAGES,
        )  # fmt: skip
    tape = tape_of(track)
    with atomic_file(path) as partial, PdfPages(partial, metadata={"Title": f"{track.name} at 1:1"}) as pages:
        pages.savefig(_plan(track, tiles, size, paper, tape))
        pieces = _pieces(track)
        for tile in tiles:
            pages.savefig(_page(track.name, pieces, tile, size))
    return FloorPrint(path, paper, len(tiles), tape)


def _tile_size(size: tuple[float, float]) -> tuple[float, float]:
    """Return width and height of what a page shows without its overlaps, m."""
    wide, high = (edge - 2 * (MARGIN_MM + OVERLAP_MM) for edge in size)
    return wide / 1000, high / 1000


def _tiles(track: Track, size: tuple[float, float]) -> list[_Tile]:
    """Return the tiles that a line runs through, from the top left, row by row."""
    wide, high = _tile_size(size)
    x0, y0, x1, y1 = track.bounds
    columns, rows = max(1, math.ceil((x1 - x0) / wide)), max(1, math.ceil((y1 - y0) / high))
    left, top = 0.5 * (x0 + x1 - columns * wide), 0.5 * (y0 + y1 + rows * high)
    points = np.concatenate([_dense(line, 0.01) for line in (track.inner, track.outer, track.centre)])
    places = np.column_stack([(top - points[:, 1]) // high, (points[:, 0] - left) // wide]).astype(int)
    places = np.unique(np.clip(places, 0, [rows - 1, columns - 1]), axis=0)
    return [_Tile(row, column, left + column * wide, top - (row + 1) * high) for row, column in places.tolist()]


def _page(name: str, pieces: np.ndarray, tile: _Tile, size: tuple[float, float]) -> Figure:
    """Return a page whose axes are the paper itself in mm, so that 1 mm is 1 mm."""
    from matplotlib.collections import LineCollection
    from matplotlib.patches import Rectangle

    figure, axes = _sheet(size)
    wide, high = (1000 * edge for edge in _tile_size(size))
    corner, shown = MARGIN_MM + OVERLAP_MM, (wide + 2 * OVERLAP_MM, high + 2 * OVERLAP_MM)
    frame = Rectangle((MARGIN_MM, MARGIN_MM), *shown, fill=False, edgecolor="none")
    axes.add_patch(frame)
    on_paper = (pieces - [tile.x, tile.y]) * 1000.0 + corner
    is_near = ((on_paper.max(axis=1) > MARGIN_MM) & (on_paper.min(axis=1) < np.array(shown) + MARGIN_MM)).all(axis=1)
    lines = LineCollection(list(on_paper[is_near]), colors=INK, linewidths=LINE_MM * POINTS_PER_MM, capstyle="round")
    axes.add_collection(lines, autolim=False)
    lines.set_clip_path(frame)
    for x in (corner, corner + wide):
        for y in (corner, corner + high):
            axes.plot([x - 5, x + 5], [y, y], [x, x], [y - 5, y + 5], color=QUIET, linewidth=0.4)
    _bar(axes, corner + 8.0, corner + 6.0)
    axes.text(corner + 8.0, corner + high - 12.0, tile.name, fontsize=20, color=QUIET)
    axes.text(corner + 30.0, corner + high - 12.0, name, fontsize=8, color=QUIET)
    return figure


def _plan(track: Track, tiles: list[_Tile], size: tuple[float, float], paper: str, tape: Tape) -> Figure:
    """Return the first page: where each page lies, and what is needed."""
    figure, axes = _sheet(size)
    wide, high = _tile_size(size)
    (x0, y0), (x1, y1) = (
        np.min([(tile.x, tile.y) for tile in tiles], axis=0),
        np.max([(tile.x + wide, tile.y + high) for tile in tiles], axis=0),
    )
    room = size[0] - 2 * MARGIN_MM, size[1] - 2 * MARGIN_MM - 62.0
    scale = min(room[0] / (x1 - x0), room[1] / (y1 - y0))

    def on_paper(line: np.ndarray) -> np.ndarray:
        return (np.asarray(line) - [x0, y0]) * scale + MARGIN_MM

    from matplotlib.patches import Rectangle

    for tile in tiles:
        place = on_paper(np.array([[tile.x, tile.y]]))[0]
        axes.add_patch(Rectangle(place, wide * scale, high * scale, fill=False, edgecolor=QUIET, linewidth=0.4))
        middle = place + 0.5 * scale * np.array([wide, high])
        axes.text(middle[0], middle[1], tile.name, ha="center", va="center",
                  fontsize=max(2.5, min(9.0, 0.9 * wide * scale)), color=QUIET)  # fmt: skip
    for line in _lines(track):
        axes.plot(*on_paper(line).T, color=INK, linewidth=0.8)
    bounds = track.bounds
    words = [
        f"{track.title or track.name}: {track.length:.2f} m a lap, road {track.width_mean:.2f} m, "
        f"floor {bounds[2] - bounds[0]:.2f} x {bounds[3] - bounds[1]:.2f} m",
        f"{len(tiles)} pages {paper} at 1:1. Print at 100 %, never 'fit to page': each bar is {BAR_MM:g} mm long.",
        f"Lay each page so that its crosses meet those of its neighbours; {2 * OVERLAP_MM:g} mm overlap.",
        f"Tape: {tape.borders_m:.1f} m borders (white), {tape.centre_m:.1f} m dashes (yellow), "
        f"{tape.start_m:.1f} m start; {tape.total_m:.1f} m in all.",
    ]
    for number, text in enumerate(words):
        axes.text(
            MARGIN_MM, size[1] - MARGIN_MM - 8.0 - 10.0 * number, text, fontsize=11 if number == 0 else 8, color=INK
        )
    _bar(axes, MARGIN_MM, size[1] - MARGIN_MM - 52.0)
    return figure


def _sheet(size: tuple[float, float]) -> tuple[Figure, Axes]:
    from matplotlib.figure import Figure

    figure = Figure(figsize=(size[0] / MM_PER_INCH, size[1] / MM_PER_INCH), facecolor=PAPER)
    axes = figure.add_axes((0.0, 0.0, 1.0, 1.0), xlim=(0.0, size[0]), ylim=(0.0, size[1]))
    axes.set_axis_off()
    return figure, axes


def _bar(axes: Any, x: float, y: float) -> None:
    """Draw a bar of BAR_MM."""
    axes.plot([x, x + BAR_MM], [y, y], color=INK, linewidth=1.2, solid_capstyle="butt")
    for end in (x, x + BAR_MM):
        axes.plot([end, end], [y - 2.0, y + 2.0], color=INK, linewidth=0.6)
    axes.text(x + 0.5 * BAR_MM, y + 2.0, f"{BAR_MM:g} mm", ha="center", fontsize=7, color=INK)


def _lines(track: Track) -> list[np.ndarray]:
    """Return what is taped: both borders, the dashes of the centre line, the start."""
    centre = _dense(track.centre, 0.01)
    arc = running_length(centre)
    number = (arc // (DASH_M + GAP_M)).astype(int)
    painted = arc % (DASH_M + GAP_M) < DASH_M
    dashes = [centre[painted & (number == one)] for one in range(int(number[-1]) + 1)]
    return [
        track.inner,
        track.outer,
        np.stack([track.inner[0], track.outer[0]]),
        *(one for one in dashes if len(one) > 1),
    ]


def _pieces(track: Track) -> np.ndarray:
    """Return what is taped as straight pieces, (S, 2, 2) m."""
    return np.concatenate([np.stack([line[:-1], line[1:]], axis=1) for line in _lines(track)])


def _dense(line: np.ndarray, step: float) -> np.ndarray:
    """Return a polyline with a point every `step` m at most."""
    arc = running_length(line)
    stations = np.union1d(arc, np.arange(0.0, arc[-1], step))
    return np.column_stack([np.interp(stations, arc, line[:, k]) for k in (0, 1)])


def _row_letters(number: int) -> str:
    """Return the letters of a row, counted from 0, as spreadsheets do.

    >>> _row_letters(0), _row_letters(25), _row_letters(26)
    ('A', 'Z', 'AA')
    """
    text = ""
    number += 1
    while number:
        number, rest = divmod(number - 1, 26)
        text = chr(65 + rest) + text
    return text
