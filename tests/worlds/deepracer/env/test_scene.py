"""What is laid out of a circuit, by hand: a small square road and a short straight one, both turned by 30 degrees."""

import math

import numpy as np
import pytest

from racecraft.worlds.deepracer.env.scene import (
    DASH,
    FIELD,
    LINE,
    ROAD,
    START,
    build_scene,
    dash_rings,
    road_rings,
    set_in,
    start_rings,
)
from racecraft.worlds.deepracer.tracks.style import TrackStyle
from racecraft.worlds.deepracer.tracks.track import Track

TURN = np.array([[math.cos(math.pi / 6), -math.sin(math.pi / 6)], [math.sin(math.pi / 6), math.cos(math.pi / 6)]])
CORNERS = np.array([(0, -1), (1, -1), (1, 1), (-1, 1), (-1, -1), (0, -1)], float)
PLAIN = TrackStyle(dash_length=0.0, line_side="none")


def square(look=PLAIN, corners=CORNERS):
    """A road 0.6 m wide round a square of 0.6 m, counter-clockwise from the middle of its lower side: 4.8 m a lap."""
    rows = np.hstack([corners * half @ TURN.T for half in (0.6, 0.3, 0.9)])
    return Track.from_rows("square", rows, look=look)


def straight(look=PLAIN):
    """A road 2 m long and 0.8 m wide, in three rows."""
    x = np.array([0.0, 1.2, 2.0])
    rows = np.hstack([np.column_stack([x, np.full(3, y)]) @ TURN.T for y in (0.0, 0.4, -0.4)])
    return Track.from_rows("straight", rows, look=look)


def is_clockwise(ring):
    (x, y), (next_x, next_y) = ring.T, np.roll(ring, -1, axis=0).T
    return (x * next_y - next_x * y).sum() < 0


def turned_back(ring):
    return ring @ TURN


def bounds(ring):
    """Return x0, y0, x1, y1 of a ring before everything was turned."""
    back = turned_back(ring)
    return pytest.approx([*back.min(axis=0), *back.max(axis=0)], abs=1e-9)


def around(half):
    return [-half, -half, half, half]


# ---- the road and its lines ------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("side", "told"),
    [
        ("inside", [(0.9, LINE, FIELD), (0.85, ROAD, LINE), (0.35, LINE, ROAD), (0.3, FIELD, LINE)]),
        ("outside", [(0.95, LINE, FIELD), (0.9, ROAD, LINE), (0.3, LINE, ROAD), (0.25, FIELD, LINE)]),
        ("none", [(0.9, ROAD, FIELD), (0.3, FIELD, ROAD)]),
    ],
)
def test_a_loop_is_rings_from_the_field_inwards(side, told):
    for track in (
        square(TrackStyle(line_side=side, line_width=0.05)),
        square(TrackStyle(line_side=side, line_width=0.05)).reversed(),
    ):
        rings = road_rings(track)
        assert [materials for _, *materials in rings] == [list(materials) for _, *materials in told]
        for (ring, _, _), (half, _, _) in zip(rings, told, strict=True):
            assert len(ring) == 5
            assert around(half) == bounds(ring)
            assert is_clockwise(ring)


def test_a_row_that_a_route_file_repeats_changes_no_ring():
    look = TrackStyle(line_width=0.05)
    filed = square(look, corners=CORNERS[[0, 1, 1, 2, 3, 4, 5]]).as_filed()
    assert len(filed.centre) == 7
    for (ring, *told), (plain, *expected) in zip(road_rings(filed), road_rings(square(look)), strict=True):
        np.testing.assert_allclose(ring, plain)
        assert told == expected


@pytest.mark.parametrize(
    ("side", "lines"),
    [
        ("inside", [([0, -0.4, 2, -0.35], ROAD), ([0, 0.35, 2, 0.4], ROAD)]),
        ("outside", [([0, -0.45, 2, -0.4], FIELD), ([0, 0.4, 2, 0.45], FIELD)]),
        ("none", []),
    ],
)
def test_an_open_road_is_one_ring_with_lines_laid_over_it_or_beside_it(side, lines):
    road, *others = road_rings(straight(TrackStyle(line_side=side, line_width=0.05)))
    assert bounds(road[0]) == [0, -0.4, 2, 0.4]
    assert road[1:] == (ROAD, FIELD)
    assert [len(ring) for ring, _, _ in (road, *others)] == [6] * (1 + len(lines)), "three rows there and back"
    assert len(others) == len(lines)
    for (ring, inside, under), (box, expected) in zip(others, lines, strict=True):
        assert box == bounds(ring)
        assert (inside, under) == (LINE, expected)
    assert all(is_clockwise(ring) for ring, _, _ in (road, *others))


# ---- parallels -------------------------------------------------------------------------------------------------------

BOX = np.array([(0.0, 0.0), (0.4, 0.0), (0.4, 0.4), (0.0, 0.4)])


@pytest.mark.parametrize("way", [1, -1])
def test_a_parallel_of_a_square_is_a_square_whichever_way_round(way):
    np.testing.assert_allclose(set_in(BOX[::way], 0.1), np.clip(BOX[::way], 0.1, 0.3))
    np.testing.assert_allclose(set_in(BOX[::way], -0.1), np.where(BOX[::way] > 0, 0.5, -0.1))


def test_a_corner_too_small_for_its_parallel_leaves_no_loop():
    """By hand: 0.1 m within, the cut corner's two vertices would lie past one another, 0.05 m from the sides."""
    cut = np.array([(0.0, 0.0), (0.4, 0.0), (0.4, 0.39), (0.39, 0.4), (0.0, 0.4)])
    np.testing.assert_allclose(set_in(cut, 0.1), [(0.1, 0.1), (0.3, 0.1), (0.1, 0.3)])


# ---- the start strip and the dashes ----------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("at", "side", "box"),
    [
        (0.0, "inside", [-0.1, -0.85, 0.1, -0.35]),
        (0.15, "inside", [0.05, -0.85, 0.25, -0.35]),
        (0.15, "none", [0.05, -0.9, 0.25, -0.3]),
        (-0.15, "outside", [-0.25, -0.9, -0.05, -0.3]),
    ],
)
def test_the_start_strip_lies_across_the_road_between_its_lines_whichever_way_it_is_driven(at, side, box):
    track = square(TrackStyle(start_strip=0.2, start_strip_at=at, line_width=0.05, line_side=side))
    for driven in (track, track.reversed()):
        ((ring, inside, under),) = start_rings(driven)
        assert box == bounds(ring)
        assert (inside, under, len(ring)) == (START, ROAD, 4)
        assert is_clockwise(ring)
    assert start_rings(square(TrackStyle())) == []


@pytest.mark.parametrize(("at", "begins"), [(0.05, 0.0), (0.5, 0.4), (1.95, 1.8)])
def test_the_start_strip_of_an_open_road_ends_where_the_road_ends(at, begins):
    ((ring, _, _),) = start_rings(straight(TrackStyle(start_strip=0.2, start_strip_at=at, line_side="none")))
    assert [begins, -0.4, begins + 0.2, 0.4] == bounds(ring)


def dashes(length=0.1, gap=0.15, track=square, **look):
    return dash_rings(track(TrackStyle(dash_length=length, dash_gap=gap, dash_width=0.02, **look)))


def test_dashes_close_without_a_seam():
    """4.8 m by 0.25 m are 19.2: 19 of them, 4.8 / 19 m from each other."""
    rings = dashes()
    assert len(rings) == 19
    assert bounds(rings[0][0]) == [0.0, -0.61, 0.1, -0.59]
    second = 4.8 / 19
    assert [second, -0.61, second + 0.1, -0.59] == bounds(rings[1][0])
    for ring, inside, under in rings:
        assert (inside, under, len(ring)) == (DASH, ROAD, 4)
        assert is_clockwise(ring)
    first = turned_back(rings[0][0])
    np.testing.assert_allclose(sorted(np.hypot(*(first - np.roll(first, 1, axis=0)).T)), [0.02, 0.02, 0.1, 0.1])


def test_dashes_of_an_open_road_keep_their_period():
    rings = dashes(track=straight)
    assert len(rings) == 8
    assert bounds(rings[-1][0]) == [1.75, -0.01, 1.85, 0.01]


@pytest.mark.parametrize("middle", [-0.05, 0.15, 0.05])
def test_the_dash_that_the_start_strip_covers_by_an_end_is_left_out(middle):
    """The first lies from 0 to 0.1 m; strips of 0.2 m lie round its beginning, round its end, or all over it."""
    told = dashes(start_strip=0.2, start_strip_at=middle)
    assert len(told) == 18
    second = 4.8 / 19
    assert [second, -0.61, second + 0.1, -0.59] == bounds(told[0][0])


def circle(rows):
    angle = 2 * math.pi * np.arange(rows + 1) / rows
    unit = np.column_stack([np.cos(angle), np.sin(angle)])
    unit[-1] = unit[0]
    return unit


def test_a_bend_that_grows_by_less_than_a_millimetre_a_vertex_is_not_cut_off():
    """Each vertex is held against the line from the last that stays, and with it all that were left out between."""
    scene = build_scene(square(corners=circle(400)))
    for first, last, _, _ in scene.chunks:
        radius = np.hypot(*scene.vertices[first])
        middles = (scene.vertices[first:last] + scene.vertices[first + 1 : last + 1]) / 2
        assert (radius - np.hypot(*middles.T) < 0.0011).all()
    assert len(scene.vertices) < 200
