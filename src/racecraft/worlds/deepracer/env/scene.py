"""What a camera can see of a circuit: coloured polygons on the ground, four walls, a sky. Begin at `build_scene`.

The ground is a list of closed rings, each the edge between an inside and an outside material: the outer border is
where the field ends and the white line begins, the same line set in by its width is where the road begins, and so on.
The rings are cut into chunks of a few edges with a circle around each, so that a camera passes over what it cannot see.
Colours are apart from shapes: a palette gives each material its level, so a grey frame, a colour frame and a car in
strange light are the same work with another palette.
"""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import numpy as np

from racecraft.worlds.deepracer.env.light import palette_under
from racecraft.worlds.deepracer.env.objects import KINDS
from racecraft.worlds.deepracer.tracks.track import Track

MATERIALS = (
    "field", "road", "line", "dash", "start", "wall south", "wall east", "wall north", "wall west", "sky",
    *(kind.name for kind in KINDS),
)  # fmt: skip
"""Names of the materials; a palette has one row for each."""
FIELD, ROAD, LINE, DASH, START, WALL_SOUTH, WALL_EAST, WALL_NORTH, WALL_WEST, SKY = range(10)

GREY_WEIGHTS = np.array([0.2989, 0.587, 0.114])
"""Of red, green and blue in the grey level that policies see (facts: simapp observation filter)."""

GRASS_SPREAD = 6.5
"""Standard deviation of the field in the original's frames, grey levels (facts: 6 to 7)."""
EDGES_PER_CHUNK = 8
COLLINEAR_M = 0.001
"""Ring vertices nearer than this to the straight line between their neighbours are left out."""


class Scene(NamedTuple):
    """A circuit as the camera's kernel takes it: contiguous arrays and plain numbers, shared by all worlds."""

    vertices: np.ndarray
    """(V, 2) m, float64: vertices of the rings; a ring is clockwise from above around its inside material."""
    chunks: np.ndarray
    """(C, 4) int32: first vertex, last vertex, material inside, material outside."""
    circles: np.ndarray
    """(C, 3) m: centre x, y and radius of a circle around each chunk."""
    field_corners: np.ndarray
    """(4, 2) m, counter-clockwise from the south-west; wall k stands between corners k and k + 1."""
    wall_height: float
    """m; 0 where there is no wall."""
    palette: np.ndarray
    """(M, 3) RGB level of each material in daylight, 0 to 255, float64."""
    grey_palette: np.ndarray
    """(M,) grey level of each material, 0 to 255, float64."""
    grass: float
    """Spread of the field's grain, grey levels; 0 where the field is plain."""


def build_scene(track: Track, light: str = "2026", has_grass: bool = False, for_people: bool = False) -> Scene:
    """Lay out what is to be seen of a track.

    Args:
        track: The circuit.
        light: Year of the simulator whose light falls on it: "2019", "2021" or "2026".
        has_grass: The field has the grain of grass instead of one plain colour.
        for_people: No wall stands in its own shadow.
    """
    look = track.look
    vertices, chunks, circles = _outlines(track)
    x0, y0, x1, y1 = track.field_bounds
    palette = palette_under(light, look, track.name, for_people)
    return Scene(
        vertices,
        chunks,
        circles,
        np.array([[x0, y0], [x1, y0], [x1, y1], [x0, y1]], dtype=np.float64),
        float(look.wall_height),
        palette,
        np.ascontiguousarray(palette @ GREY_WEIGHTS),
        GRASS_SPREAD if has_grass else 0.0,
    )


@lru_cache(maxsize=32)
def _outlines(track: Track) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the vertices, chunks and circles of a track; its training, its evaluation and its films share them."""
    return _cut_into_chunks([*road_rings(track), *start_rings(track), *dash_rings(track)])


# ---- rings -----------------------------------------------------------------------------------------------------------

Ring = tuple[np.ndarray, int, int]
"""Vertices (V, 2) without repetition, clockwise from above; the material inside, the material outside."""


def road_rings(track: Track) -> list[Ring]:
    """Return the rings of the road and its two white lines."""
    look = track.look
    side = {"inside": 1.0, "outside": -1.0, "none": 0.0}[look.line_side]
    shift = side * look.line_width  # towards the road
    if not track.closed:
        return _open_road_rings(track, shift)
    outer, inner = _distinct(track.outer[:-1]), _distinct(track.inner[:-1])
    if shift == 0.0:
        return [(_clockwise(outer), ROAD, FIELD), (_clockwise(inner), FIELD, ROAD)]
    outer_shifted, inner_shifted = set_in(outer, shift), set_in(inner, -shift)
    if shift > 0.0:
        steps = [(outer, LINE, FIELD), (outer_shifted, ROAD, LINE), (inner_shifted, LINE, ROAD), (inner, FIELD, LINE)]
    else:
        steps = [(outer_shifted, LINE, FIELD), (outer, ROAD, LINE), (inner, LINE, ROAD), (inner_shifted, FIELD, LINE)]
    return [(_clockwise(ring), inside, outside) for ring, inside, outside in steps]


def _distinct(ring: np.ndarray) -> np.ndarray:
    """Return a ring without the rows that a route file repeats (`Track.as_filed` has them)."""
    return ring[np.hypot(*(ring - np.roll(ring, 1, axis=0)).T) > 0.0]


def _open_road_rings(track: Track, shift: float) -> list[Ring]:
    rings: list[Ring] = [(_clockwise(np.concatenate([track.outer, track.inner[::-1]])), ROAD, FIELD)]
    if shift == 0.0:
        return rings
    under = ROAD if shift > 0.0 else FIELD
    for border, other in ((track.outer, track.inner), (track.inner, track.outer)):
        to_road = other - border
        shifted = border + to_road / np.hypot(*to_road.T)[:, None] * shift
        rings.append((_clockwise(np.concatenate([border, shifted[::-1]])), LINE, under))
    return rings


def start_rings(track: Track) -> list[Ring]:
    """Return the start strip: a quad across the road, between the lines, around its place near the start line."""
    if track.look.start_strip <= 0.0:
        return []
    begin, end = _strip_span(track)
    margin = track.look.line_width if track.look.line_side == "inside" else 0.0
    near, far = _across(track, begin, margin), _across(track, end, margin)
    return [(_clockwise(np.concatenate([near, far[::-1]])), START, ROAD)]


def _strip_span(track: Track) -> tuple[float, float]:
    """Return the arcs, m, at which the start strip begins and ends; it stays where it was laid when reversed."""
    look = track.look
    middle = -look.start_strip_at if track.is_reversed else look.start_strip_at
    begin, end = middle - look.start_strip / 2, middle + look.start_strip / 2
    if track.closed:
        return begin % track.length, end % track.length
    begin = min(max(begin, 0.0), track.length - look.start_strip)
    return begin, begin + look.start_strip


def _across(track: Track, arc: float, margin: float) -> np.ndarray:
    """Return the (2, 2) points on both borders beside a place of the centre line, `margin` m nearer to the road."""
    x, y, _ = track.pose_at(arc)
    place = track.locate(np.array([[x, y]]))
    inner, outer = place.inner_point[0], place.outer_point[0]
    along = (outer - inner) / np.hypot(*(outer - inner))
    return np.array([inner + along * margin, outer - along * margin])


def dash_rings(track: Track) -> list[Ring]:
    """Return the dashes along the centre line; on a loop their period is stretched to close without a seam."""
    look = track.look
    if look.dash_length <= 0.0 or look.dash_width <= 0.0:
        return []
    period = look.dash_length + look.dash_gap
    if track.closed:
        period = track.length / max(1, round(track.length / period))
    begins = np.arange(int(track.length / period + 1e-6)) * period
    ends = np.minimum(begins + look.dash_length, track.length)
    if look.start_strip > 0.0:  # the strip lies over the dashes
        strip_begin, _ = _strip_span(track)
        past_begin = (begins - strip_begin) % track.length
        covered = (past_begin < look.start_strip) | ((ends - strip_begin) % track.length < look.start_strip)
        begins, ends = begins[~covered], ends[~covered]
    tails, heads = _along(track, begins), _along(track, ends)
    ahead = heads - tails
    ahead /= np.maximum(np.hypot(*ahead.T), 1e-9)[:, None]
    left = np.stack([-ahead[:, 1], ahead[:, 0]], axis=1) * (0.5 * look.dash_width)
    quads = np.stack([tails + left, heads + left, heads - left, tails - left], axis=1)
    return [(_clockwise(quad), DASH, ROAD) for quad in quads]


def _along(track: Track, arcs: np.ndarray) -> np.ndarray:
    return np.stack([np.interp(arcs, track.arc, track.centre[:, axis]) for axis in range(2)], axis=1)


def set_in(ring: np.ndarray, distance: float) -> np.ndarray:
    """Return a ring's parallel at `distance` m towards its inside (negative: outside), mitred and free of loops.

    Args:
        ring: (V, 2) vertices, either way round, without repetition.
        distance: m.
    """
    inwards = distance if _twice_area(ring) > 0 else -distance  # left of a counter-clockwise ring is inside
    ahead = np.roll(ring, -1, axis=0) - ring
    ahead /= np.hypot(*ahead.T)[:, None]
    behind = np.roll(ahead, 1, axis=0)
    middle = ahead + behind
    normal = np.stack([-middle[:, 1], middle[:, 0]], axis=1)
    stretch = np.maximum((middle * middle).sum(axis=1) / 2, 0.4)  # 1 + cos of the turn: a mitre ends at 2.5 times
    shifted = ring + normal / stretch[:, None] * inwards
    keep = _distance_to_ring(shifted, ring) >= abs(distance) * 0.98
    return shifted[keep] if keep.sum() >= 3 else shifted


def _distance_to_ring(points: np.ndarray, ring: np.ndarray) -> np.ndarray:
    begin, step = ring, np.roll(ring, -1, axis=0) - ring
    offset = points[:, None] - begin
    share = np.clip((offset * step).sum(-1) / (step * step).sum(-1), 0.0, 1.0)
    return np.sqrt(((offset - share[..., None] * step) ** 2).sum(-1)).min(axis=1)


def _twice_area(ring: np.ndarray) -> float:
    x, y = ring.T
    return float(np.sum(x * np.roll(y, -1) - np.roll(x, -1) * y))


def _clockwise(ring: np.ndarray) -> np.ndarray:
    return ring[::-1] if _twice_area(ring) > 0 else ring


# ---- chunks ----------------------------------------------------------------------------------------------------------


def _cut_into_chunks(rings: list[Ring]) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    vertices: list[np.ndarray] = []
    chunks: list[tuple[int, int, int, int]] = []
    circles: list[tuple[float, float, float]] = []
    count = 0
    for ring, inside, outside in rings:
        ring = _without_collinear(ring) if len(ring) > 4 else ring
        closed = np.concatenate([ring, ring[:1]])
        for first in range(0, len(ring), EDGES_PER_CHUNK):
            last = min(first + EDGES_PER_CHUNK, len(ring))
            part = closed[first : last + 1]
            middle = (part.min(axis=0) + part.max(axis=0)) / 2
            radius = float(np.hypot(*(part - middle).T).max())
            chunks.append((count + first, count + last, inside, outside))
            circles.append((float(middle[0]), float(middle[1]), radius + 1e-6))
        vertices.append(closed)
        count += len(closed)
    return (
        np.ascontiguousarray(np.concatenate(vertices), dtype=np.float64),
        np.array(chunks, dtype=np.int32),
        np.array(circles, dtype=np.float64),
    )


def _without_collinear(ring: np.ndarray) -> np.ndarray:
    """Return the ring without vertices that a straight line would pass within COLLINEAR_M."""
    keep = [0]
    for index in range(1, len(ring)):
        after = ring[(index + 1) % len(ring)]
        between = ring[keep[-1] + 1 : index + 1]
        along = after - ring[keep[-1]]
        length = float(np.hypot(*along))
        if length < 1e-9:
            keep.append(index)
            continue
        offset = between - ring[keep[-1]]
        if np.abs(along[0] * offset[:, 1] - along[1] * offset[:, 0]).max() / length > COLLINEAR_M:
            keep.append(index)
    return ring[keep]
