"""A circuit as a small SVG picture, a kilobyte or two, for pages that show many. Begin with `thumbnail_svg`.

Field, road and paint have the track's own colours in daylight. Lines are thicker than they are on the ground, or nobody
would see them; everything else is to scale. The start is a white bar, and an arrow points the way.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from racecraft.worlds.deepracer.tracks.style import RGB, TrackStyle
from racecraft.worlds.deepracer.tracks.track import Track

WIDTH, HEIGHT, MARGIN = 240, 180, 14
"""Pixels."""
TOLERANCE_PX = 0.12
"""A point nearer than this to the line between its neighbours is left out."""
THINNEST_ROAD_PX = 5.0
DAYLIGHT = 1.31
"""A lit surface is this much brighter than its texture (facts: simapp camera images)."""

Turn = Callable[[np.ndarray], np.ndarray]
"""Metres (K, 2) to pixels."""


def thumbnail_svg(track: Track) -> str:
    """Return the circuit as the text of an SVG file, 240 x 180 pixels.

    >>> from racecraft.worlds.deepracer.tracks.catalogue import load_track
    >>> thumbnail_svg(load_track("Oval_track")).startswith("<svg ")
    True
    """
    look, scale, turn = track.look, *_fit(track)
    inner, outer, centre = (turn(line) for line in (track.inner, track.outer, track.centre))
    line, dash, road = (_lit(colour) for colour in (look.line, look.dash, look.road))
    road_px = track.width_mean * scale
    paint = min(max(look.line_width * scale, 1.0), 0.16 * max(road_px, THINNEST_ROAD_PX))
    parts = [
        f'<rect width="{WIDTH}" height="{HEIGHT}" rx="10" fill="{_lit(look.field)}"/>',
        _road(inner, outer, track.closed, road, max(0.0, THINNEST_ROAD_PX - road_px)),
        *(_stroke(border, track.closed, line, paint) for border in _painted_borders(look, inner, outer)),
    ]
    if look.dash_length > 0:
        dashes = f' stroke-dasharray="{2.2 * paint:.1f} {2.2 * paint:.1f}"'
        parts.append(_stroke(centre, track.closed, dash, 0.9 * paint, dashes))
    parts += _start(track, turn, max(road_px, THINNEST_ROAD_PX))
    head = f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {HEIGHT}" width="{WIDTH}" height="{HEIGHT}">'
    return "\n".join([head, f"<title>{_escaped(track.title or track.name)}</title>", *parts, "</svg>"]) + "\n"


def _fit(track: Track) -> tuple[float, Turn]:
    """Return pixels per metre, and what turns metres (K, 2) into pixels: y down, the circuit in the middle."""
    x0, y0, x1, y1 = track.bounds
    scale = min((WIDTH - 2 * MARGIN) / (x1 - x0), (HEIGHT - 2 * MARGIN) / (y1 - y0))
    middle = np.array([(x0 + x1) / 2, (y0 + y1) / 2])

    def turn(points: np.ndarray) -> np.ndarray:
        return (np.asarray(points) - middle) * (scale, -scale) + (WIDTH / 2, HEIGHT / 2)

    return scale, turn


def _road(inner: np.ndarray, outer: np.ndarray, closed: bool, colour: str, more_px: float) -> str:
    """Return the road's surface: a ring, or a strip; narrow roads on large fields are drawn wider."""
    shape = _path(outer, True) + _path(inner, True) if closed else _path(np.concatenate([outer, inner[::-1]]), True)
    edge = f' stroke="{colour}" stroke-width="{more_px:.1f}"' if more_px else ""
    return f'<path d="{shape}" fill="{colour}" fill-rule="evenodd"{edge}/>'


def _painted_borders(look: TrackStyle, inner: np.ndarray, outer: np.ndarray) -> tuple[np.ndarray, ...]:
    return (inner, outer) if look.line_side != "none" and look.line_width > 0 else ()


def _stroke(line: np.ndarray, closed: bool, colour: str, width: float, more: str = "") -> str:
    shape = f'<path d="{_path(line, closed)}" fill="none" stroke="{colour}"'
    return f'{shape} stroke-width="{width:.1f}" stroke-linejoin="round"{more}/>'


def _start(track: Track, turn: Turn, road_px: float) -> list[str]:
    """Return the start bar across the road, and the arrow behind it in driving direction."""
    at = track.pose_at(0.0)
    bar = turn(np.array([(at.x, at.y)]))[0]
    ahead = np.array([math.cos(at.yaw), -math.sin(at.yaw)])
    across = np.array([-ahead[1], ahead[0]])
    a, b = bar - 0.62 * road_px * across, bar + 0.62 * road_px * across
    size = max(0.45 * road_px, 5.0)
    tip = np.array([(0.62, 0), (-0.38, 0.5), (-0.18, 0), (-0.38, -0.5)]) * size
    on = track.pose_at(min(track.length * 0.2, 1.6 * size / road_px * track.width_mean))
    heading = np.array([math.cos(on.yaw), -math.sin(on.yaw)])
    arrow = turn(np.array([(on.x, on.y)])) + tip[:, :1] * heading + tip[:, 1:] * [-heading[1], heading[0]]
    corners = " ".join(f"{x:.1f},{y:.1f}" for x, y in arrow)
    return [
        f'<path d="M{a[0]:.1f} {a[1]:.1f}L{b[0]:.1f} {b[1]:.1f}" stroke="#fff" stroke-width="2"/>',
        f'<polygon points="{corners}" fill="#fff"/>',
    ]


def _path(line: np.ndarray, closed: bool) -> str:
    """Return a line as an SVG path in tenths of a pixel, points that nobody would miss left out."""
    ticks = np.round(_simplified(line) * 10).astype(int)
    if closed and len(ticks) > 1 and (ticks[0] == ticks[-1]).all():
        ticks = ticks[:-1]
    steps = np.diff(ticks, axis=0)
    parts = [f"M{ticks[0][0] / 10:g} {ticks[0][1] / 10:g}l"]
    parts.append(" ".join(f"{x / 10:g} {y / 10:g}" for x, y in steps[np.any(steps != 0, axis=1)]))
    return "".join(parts).replace(" -", "-") + ("z" if closed else "")


def _simplified(line: np.ndarray) -> np.ndarray:
    """Return a line (K, 2) without the points that lie within the tolerance of what is left (Douglas and Peucker)."""
    keep = np.zeros(len(line), dtype=bool)
    keep[[0, -1]] = True
    stretches = [(0, len(line) - 1)]
    while stretches:
        first, last = stretches.pop()
        if last - first < 2:
            continue
        between, chord = line[first + 1 : last] - line[first], line[last] - line[first]
        length = np.hypot(*chord)
        off = np.hypot(*between.T) if length < 1e-9 else np.abs(between @ [-chord[1], chord[0]]) / length
        if off.max() > TOLERANCE_PX:
            middle = first + 1 + int(off.argmax())
            keep[middle] = True
            stretches += [(first, middle), (middle, last)]
    return line[keep]


def _lit(colour: RGB) -> str:
    return "#" + "".join(f"{min(255, round(DAYLIGHT * part)):02x}" for part in colour)


def _escaped(text: str) -> str:
    return text.replace("&", "&amp;").replace("<", "&lt;")
