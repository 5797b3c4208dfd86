"""A drawn line from a file: SVG path, GPX track, photograph, or a list of points. Begin with `read_drawing`.

    .svg          the longest path, polyline or polygon; user units, y down; transforms are followed
    .gpx          the longest track or route; degrees become metres east and north of its first point
    .png, .jpg    the outline of the largest dark shape, or of the largest bright one on a dark floor; pixels, y down
    .json, .csv   points: [[x, y], …], or a line x,y for each; metres

Lines come out with y upwards. Only GPX and points have a length of their own; the others are scaled by whoever asks.
"""

from __future__ import annotations

import csv
import io
import json
import math
import re
from dataclasses import dataclass
from pathlib import Path
from xml.etree import ElementTree

import numpy as np

from racecraft.contract.errors import TrackError
from racecraft.contract.message import Message
from racecraft.formats.user_file import read_user_file
from racecraft.worlds.deepracer.tracks.svg_path import parse_path, parse_transform

ENDINGS = (".svg", ".gpx", ".png", ".jpg", ".jpeg", ".json", ".csv")
MAX_BYTES = 32 * 2**20
MAX_POINTS = 200_000
EARTH_M = 6_371_000.0
"""Mean radius."""
PHOTO_PIXELS = 800
"""A photograph is looked at no larger than this."""
LINE, GPX, ROUTE = "a drawing of a line", "a GPX file with a track", "points, such as [[0, 0], [1, 0.5]] or x,y a line"


@dataclass(frozen=True, eq=False)
class Drawing:
    """A line as it was drawn."""

    points: np.ndarray
    """(P, 2), y upwards; a loop does not repeat its first point."""
    closed: bool
    in_metres: bool
    """Whether its units are metres."""


def read_drawing(path: str | Path) -> Drawing:
    """Return the line that a file holds.

    Raises:
        TrackError: The file is missing, is none of ENDINGS, or holds no line.
    """
    path = Path(path)
    ending = path.suffix.lower()
    if ending not in ENDINGS:
        raise TrackError(
            path,
            Message("a name that ends in {ending!r}", ending=ending),
            Message("one of {endings}", endings=", ".join(ENDINGS)),
        )
    data = read_user_file(path, TrackError, LINE, max_bytes=MAX_BYTES)
    readers = {".svg": _read_svg, ".gpx": _read_gpx, ".json": _read_points, ".csv": _read_points}
    return drawing_of(readers.get(ending, _read_photo)(path, data), path)


def drawing_of(drawing: Drawing, path: str | Path) -> Drawing:
    """Return a drawing without repeated points; a line that ends where it began is a loop.

    Raises:
        TrackError: Fewer than three points are left, or one is not finite.
    """
    points = np.asarray(drawing.points, float).reshape(-1, 2)
    if len(points) > MAX_POINTS or not np.isfinite(points).all():
        raise TrackError(
            path,
            Message("{count} points, of which some are not finite or are too many", count=len(points)),
            Message("at most {most} finite ones", most=MAX_POINTS),
        )
    extent = float(np.ptp(points, axis=0).max()) if len(points) else 0.0
    if len(points):
        points = points[np.concatenate([[True], np.hypot(*np.diff(points, axis=0).T) > 1e-9 * extent])]
    closed = drawing.closed
    if len(points) > 3 and np.hypot(*(points[-1] - points[0])) <= 1e-3 * extent:
        points, closed = points[:-1], True
    if len(points) < 3 or extent <= 0.0:
        raise TrackError(path, Message("{count} different points", count=len(points)), "a line of at least 3")
    return Drawing(points, closed, drawing.in_metres)


def _read_svg(path: Path, data: bytes) -> Drawing:
    root = _xml(path, data, "an SVG drawing")
    lines: list[tuple[np.ndarray, bool]] = []

    def walk(element: ElementTree.Element, outer: np.ndarray) -> None:
        matrix = outer @ parse_transform(element.get("transform", ""))
        name = element.tag.rpartition("}")[2]
        if name in ("defs", "clipPath", "mask", "pattern", "marker", "symbol"):
            return
        found: list[tuple[np.ndarray, bool]] = []
        if name == "path":
            found = parse_path(element.get("d", ""))
        elif name in ("polygon", "polyline"):
            numbers = np.array([float(word) for word in re.findall(r"[-+.\deE]+", element.get("points", ""))])
            found = [(numbers[: len(numbers) // 2 * 2].reshape(-1, 2), name == "polygon")]
        lines.extend((line @ matrix[:2, :2].T + matrix[:2, 2], closed) for line, closed in found if len(line) > 1)
        for child in element:
            walk(child, matrix)

    try:
        walk(root, np.eye(3))
    except (ValueError, RecursionError) as error:
        raise TrackError(path, Message("a path that cannot be read ({error})", error=str(error)[:80]), LINE) from error
    if not lines:
        raise TrackError(path, "no path, polyline or polygon", "one", "Convert shapes to paths in the drawing program.")
    line, closed = max(lines, key=lambda one: _length(one[0]))
    return Drawing(line * [1.0, -1.0], closed, in_metres=False)


def _read_gpx(path: Path, data: bytes) -> Drawing:
    root = _xml(path, data, GPX)
    lines: list[np.ndarray] = []
    for holder in root.iter():
        if holder.tag.rpartition("}")[2] in ("trkseg", "rte"):
            try:
                lines.append(np.array([(float(point.get("lat", "")), float(point.get("lon", ""))) for point in holder
                                       if point.tag.rpartition("}")[2] in ("trkpt", "rtept")]))  # fmt: skip
            except ValueError:
                raise TrackError(path, "a point whose lat or lon is no number", GPX) from None
    lines = [line for line in lines if len(line) > 2]
    if not lines:
        raise TrackError(path, "no track of three points", GPX)
    rad = np.radians(max(lines, key=_length))
    north = (rad[:, 0] - rad[0, 0]) * EARTH_M
    east = (rad[:, 1] - rad[0, 1]) * EARTH_M * math.cos(rad[0, 0])
    line = np.column_stack([east, north])
    closed = bool(np.hypot(*(line[-1] - line[0])) < 0.05 * _length(line))
    return Drawing(line, closed, in_metres=True)


def _read_points(path: Path, data: bytes) -> Drawing:
    try:
        text = data.decode("utf-8-sig")
        if path.suffix.lower() == ".json":
            document = json.loads(text)
            rows = document["points"] if isinstance(document, dict) else document
            closed = bool(document.get("closed", True)) if isinstance(document, dict) else True
        else:
            rows = [row for row in csv.reader(io.StringIO(text)) if row and not row[0].strip()[:1].isalpha()]
            closed = True
        points = np.array([[float(x), float(y)] for x, y, *_ in rows])
    except (ValueError, KeyError, TypeError, RecursionError) as error:
        raise TrackError(path, Message("no points ({error})", error=str(error)[:80]), ROUTE) from error
    return Drawing(points, closed, in_metres=True)


def _read_photo(path: Path, data: bytes) -> Drawing:
    """Return the outline of the largest shape in a picture."""
    from contourpy import contour_generator
    from PIL import Image

    try:
        with Image.open(io.BytesIO(data)) as picture:
            grey = picture.convert("L")
            grey.thumbnail((PHOTO_PIXELS, PHOTO_PIXELS))
            levels = np.asarray(grey, float)
    except (OSError, ValueError, Image.DecompressionBombError) as error:
        raise TrackError(path, "no picture that can be read", "a PNG or JPEG") from error
    edge = np.concatenate([levels[0], levels[-1], levels[:, 0], levels[:, -1]])
    threshold = _otsu(levels)
    if np.median(edge) < threshold:  # a dark floor: the shape is what is bright
        levels, threshold = 255.0 - levels, 255.0 - threshold
    padded = np.pad(levels, 1, constant_values=255.0)
    contours = [np.asarray(line, float) for line in contour_generator(z=padded).lines(threshold)]
    lines = [line for line in contours if np.array_equal(line[0], line[-1])]
    if not lines:
        raise TrackError(path, "no closed outline", "a dark closed line or shape on a bright ground, or the reverse")
    outline = max(lines, key=lambda line: abs(_area(line)))
    return Drawing(outline[:-1] * [1.0, -1.0], closed=True, in_metres=False)


def _otsu(levels: np.ndarray) -> float:
    """Return the level that separates dark from bright with the least variance within both (Otsu, 1979)."""
    counts = np.histogram(levels, bins=256, range=(0, 256))[0].astype(float)
    weight, sums = np.cumsum(counts), np.cumsum(counts * np.arange(256))
    with np.errstate(divide="ignore", invalid="ignore"):
        between = (sums[-1] * weight / weight[-1] - sums) ** 2 / (weight * (weight[-1] - weight))
    best = np.flatnonzero(between == np.nanmax(between)) if np.isfinite(between).any() else np.array([127])
    return float(best.mean()) + 0.5


def _xml(path: Path, data: bytes, kind: str) -> ElementTree.Element:
    if b"<!ENTITY" in data:
        raise TrackError(path, "entities of its own", Message("{kind} without them", kind=kind))
    try:
        return ElementTree.fromstring(data)
    except ElementTree.ParseError as error:
        raise TrackError(path, Message("no XML ({error})", error=error), kind, line=error.position[0]) from error


def _length(line: np.ndarray) -> float:
    return float(np.hypot(*np.diff(line, axis=0).T).sum())


def _area(ring: np.ndarray) -> float:
    x, y = ring.T
    return float(np.sum(x[:-1] * y[1:] - x[1:] * y[:-1]) / 2)
