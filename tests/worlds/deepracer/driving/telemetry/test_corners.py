"""Corners of tracks whose shape is known."""

import numpy as np
import pytest
from tests.worlds.deepracer.driving.telemetry.stadium import LENGTH_M, RADIUS_M, STRAIGHT_M, stadium

from racecraft.worlds.deepracer.driving.telemetry.corners import find_corners
from racecraft.worlds.deepracer.tracks.catalogue import load_track

NEAR = 0.2 / LENGTH_M


def test_a_stadium_has_two_half_circles_where_they_were_laid():
    corners = find_corners(stadium())
    begins = np.array([STRAIGHT_M / 2, 1.5 * STRAIGHT_M + np.pi * RADIUS_M]) / LENGTH_M
    assert [one.number for one in corners] == [1, 2]
    assert [one.begin for one in corners] == pytest.approx(begins, abs=NEAR)
    assert [one.end for one in corners] == pytest.approx(begins + np.pi * RADIUS_M / LENGTH_M, abs=NEAR)
    assert [one.turn_rad for one in corners] == pytest.approx([np.pi] * 2, rel=0.03)
    assert [one.radius_m for one in corners] == pytest.approx([RADIUS_M] * 2, rel=0.03)
    assert [one.zone_begin for one in corners] == pytest.approx(begins - 1.0 / LENGTH_M, abs=NEAR)


def test_a_corner_across_the_start_line_is_the_last():
    first, last = find_corners(stadium(start_m=3.5))
    assert first.begin < first.end
    assert last.end < last.begin


def test_the_other_way_round_left_is_right_and_numbers_run_backwards():
    track = load_track("reinvent_base")
    there, back = find_corners(track), find_corners(track.reversed())
    assert [one.side for one in there] == ["left", "right", "left", "left", "left"]
    assert [one.side for one in back] == ["right", "right", "right", "left", "right"]
    assert [one.begin for one in back] == pytest.approx([1.0 - one.end for one in reversed(there)], abs=NEAR)


def test_a_straight_road_has_none():
    assert find_corners(load_track("Straight_track")) == ()
