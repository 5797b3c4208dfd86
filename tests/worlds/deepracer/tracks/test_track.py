"""Where a point lies along a circuit: by hand, by twin (Shapely), by law, and against recorded races."""

import csv
import math

import numpy as np
import pytest
import shapely
from numpy.testing import assert_allclose, assert_array_equal
from shapely.geometry import LinearRing, LineString, Polygon
from tests.reference import DATA

from racecraft.worlds.deepracer.tracks.catalogue import load_track
from racecraft.worlds.deepracer.tracks.importer import import_track
from racecraft.worlds.deepracer.tracks.track import Track


def square(closed=True, **details):
    """A square road: centre 4 m, inner 3 m, outer 5 m a side, counter-clockwise from the middle of its south side."""
    corners = np.array([(0, -1), (1, -1), (1, 1), (-1, 1), (-1, -1), (0, -1)], dtype=float)
    rows = np.hstack([corners * half for half in (2.0, 1.5, 2.5)])
    return Track.from_rows("square", rows if closed else rows[:-1], **details)


def mirrored(track):
    """The track in a mirror at the y axis."""
    return Track.from_rows(track.name, track.rows * np.tile([-1.0, 1.0], 3))


def scattered(track, count, seed):
    x0, y0, x1, y1 = track.field_bounds
    return np.random.default_rng(seed).uniform((x0, y0), (x1, y1), (count, 2))


@pytest.fixture(scope="module", params=["reinvent_base", "Tokyo_Training_track", "penbay_pro", "Straight_track"])
def track(request):
    return load_track(request.param)


def test_a_square_is_measured_by_hand():
    track = square()
    assert track.closed
    assert track.is_ccw
    assert track.length == 16.0
    assert_array_equal(track.arc, [0, 2, 6, 10, 14, 16])
    # A point in the east side's outer half: 2 m to the first corner, then 2.5 m north; the outer border is nearer.
    place = track.locate([[2.2, 0.5]])
    assert place.arc[0] == 4.5
    assert place.distance[0] == pytest.approx(0.2)
    assert_allclose(place.centre_point[0], [2.0, 0.5])
    assert_allclose(place.inner_point[0], [1.5, 0.5])
    assert_allclose(place.outer_point[0], [2.5, 0.5])
    assert place.width[0] == 1.0
    assert (place.previous_waypoint[0], place.next_waypoint[0], place.nearer_waypoint[0]) == (1, 2, 2)
    assert not place.is_left[0]


def test_border_points_belong_to_the_centre_point_and_not_to_the_point():
    # From (3, 3), far beyond the corner, the centre point is the corner (2, 2); its inner point is (1.5, 1.5).
    place = square().locate([[3.0, 3.0]])
    assert_allclose(place.inner_point[0], [1.5, 1.5])
    # (2, 2) lies 0.5 m from the outer east side and as far from the north side: the first along the border wins.
    assert_allclose(place.outer_point[0], [2.5, 2.0])


def test_a_border_is_outside_and_so_is_its_corner():
    on_border = [(1.5, 0.0), (2.5, 0.0), (0.0, -2.5), (2.5, 2.5), (1.5, 1.5), (0.0, 1.5)]
    inside = [(2.0, 0.0), (1.51, 0.0), (2.49, 0.0), (2.49, 2.49), (0.0, -1.6)]
    outside = [(0.0, 0.0), (1.49, 0.0), (2.51, 0.0), (-9.0, 2.5), (-9.0, 1.5)]
    assert not square().contains(on_border).any()
    assert square().contains(inside).all()
    assert not square().contains(outside).any()


def test_a_pose_looks_to_the_next_waypoint():
    track = square()
    assert track.pose_at(0.0) == (0.0, -2.0, 0.0)
    assert track.pose_at(3.0) == (2.0, -1.0, math.pi / 2)
    assert track.pose_at(16.0 + 3.0) == track.pose_at(3.0)
    assert track.pose_at(-1.0) == (-1.0, -2.0, 0.0)
    assert track.pose_at_share(0.5) == track.pose_at(8.0)


def test_an_open_track_holds_poses_within_its_ends():
    track = load_track("Straight_track")
    assert track.pose_at(-1.0) == track.pose_at(0.0)
    end = track.pose_at(99.0)
    assert_allclose(end[:2], track.centre[-1])
    assert end.yaw == pytest.approx(0.0, abs=1e-3)


def test_waypoints_at_the_very_start_and_end():
    track = load_track("Straight_track")
    at_start, at_end = track.centre[0] - [1.0, 0.0], track.centre[-1] + [1.0, 0.0]
    place = track.locate([at_start, at_end])
    assert_array_equal(place.previous_waypoint, [0, 21])
    assert_array_equal(place.next_waypoint, [1, 0])


def test_repeated_rows_are_one_waypoint_and_the_last_row_stays():
    rows = square().rows
    doubled = np.concatenate([rows[:2], rows[1:], rows[-1:]])
    assert_array_equal(Track.from_rows("square", doubled).rows, rows)


def test_locating_agrees_with_shapely_to_the_last_digits(track):
    points = scattered(track, 400, seed=1)
    line = LinearRing if track.closed else LineString
    centre, inner, outer = line(track.centre), line(track.inner), line(track.outer)
    at = shapely.line_locate_point(centre, shapely.points(points))
    on_centre = shapely.line_interpolate_point(centre, at)
    place = track.locate(points)
    assert_allclose(place.arc, at, atol=1e-13)
    assert_allclose(place.distance, shapely.distance(centre, shapely.points(points)), atol=1e-13)
    assert_allclose(place.centre_point, shapely.get_coordinates(on_centre), atol=1e-13)
    for border, ours in ((inner, place.inner_point), (outer, place.outer_point)):
        theirs = shapely.line_interpolate_point(border, shapely.line_locate_point(border, on_centre))
        assert_allclose(ours, shapely.get_coordinates(theirs), atol=1e-12)
    assert not track.closed or track.is_ccw == centre.is_ccw


def test_the_road_agrees_with_shapely_also_beside_its_borders(track):
    beside = np.concatenate([track.inner, track.outer, (track.inner[1:] + track.inner[:-1]) / 2])
    nudged = beside + np.random.default_rng(2).normal(0, 1e-3, beside.shape)
    points = np.concatenate([scattered(track, 300, seed=3), track.centre, nudged, track.inner, track.outer])
    ring = [track.outer, [track.inner]] if track.closed else [np.concatenate([track.outer, track.inner[::-1]])]
    assert_array_equal(track.contains(points), shapely.contains(Polygon(*ring), shapely.points(points)))


def test_arc_grows_and_ends_at_the_length(track):
    assert track.arc[0] == 0.0
    assert (np.diff(track.arc) > 0).all()
    assert track.arc[-1] == track.length


def test_reversed_twice_is_the_same(track):
    again = track.reversed().reversed()
    assert_array_equal(again.rows, track.rows)
    assert again.hash() == track.hash() != track.reversed().hash()
    assert again.is_ccw == track.is_ccw


def test_driven_backwards_the_rest_of_the_lap_lies_ahead(track):
    points = scattered(track, 200, seed=4)
    forward, backward = track.locate(points), track.reversed().locate(points)
    assert_allclose(backward.arc, track.length - forward.arc, atol=1e-9)
    assert_allclose(backward.distance, forward.distance, atol=1e-12)
    assert_array_equal(track.reversed().contains(points), track.contains(points))
    assert track.reversed().is_ccw != track.is_ccw
    clear = np.abs(forward.distance) > 1e-6
    if track.closed:  # inner and outer keep their role, so left becomes right
        assert_array_equal(backward.is_left[clear], ~forward.is_left[clear])


def test_a_mirror_swaps_left_and_right_and_nothing_else():
    track = load_track("reinvent_base")
    points = track.centre[:-1] + np.random.default_rng(5).uniform(-0.3, 0.3, (len(track.centre) - 1, 2))
    seen, there = mirrored(track).locate(points * [-1, 1]), track.locate(points)
    assert_allclose(seen.arc, there.arc, atol=1e-12)
    assert_allclose(seen.width, there.width, atol=1e-12)
    assert_array_equal(seen.is_left, ~there.is_left)


def test_left_of_centre_is_left_of_the_driving_direction():
    track = load_track("reinvent_base")
    for way in (track, track.reversed(), mirrored(track)):
        for arc in np.linspace(0.1, way.length, 40):
            x, y, yaw = way.pose_at(arc)
            left = [(x - 0.2 * math.sin(yaw), y + 0.2 * math.cos(yaw))]
            assert way.locate(left).is_left[0]


def test_recorded_progress_and_waypoints_are_met_exactly():
    """The console's own log of 2022: progress and closest_waypoint of every row from X and Y alone."""
    folder = DATA / "traces" / "console-2022" / "sim-trace" / "training" / "training-simtrace"
    track = import_track(DATA / "tracks" / "reinvent_base.npy")
    compared = 0
    for number in (0, 5, 20):
        with open(folder / f"{number}-iteration.csv", newline="") as file:
            rows = list(csv.DictReader(file))
        place = track.locate([(float(row["X"]), float(row["Y"])) for row in rows])
        assert_array_equal(place.nearer_waypoint, [int(row["closest_waypoint"]) for row in rows])
        previous = 0.0
        for row, arc in zip(rows, place.arc, strict=True):
            assert float(row["track_len"]) == track.length
            previous = 0.0 if float(row["steps"]) == 1 else previous
            progress = progress_after(previous, arc / track.length, start_of(int(row["episode"])))
            assert progress == pytest.approx(float(row["progress"]), abs=4e-13)
            previous, compared = progress, compared + 1
    assert compared > 2000


def start_of(episode):
    """Where an episode begins: a twentieth of the lap further each time, added up as the original does."""
    start = 0.0
    for _ in range(episode):
        start = (start + 0.05) % 1.0
    return start


def progress_after(previous, share, start):
    """Progress in percent (facts: simapp `track_geom/utils.py`)."""
    progress = 100 * (share - start)
    progress += 100 if progress <= 0 else 0
    progress += 100 if previous > progress + 50 else 0
    progress -= 100 if progress > previous + 50 else 0
    return min(progress, 100)
