"""A lap's telemetry on a page, and its ghosts: what they show is what the lap was."""

import numpy as np
import pytest
from tests.worlds.deepracer.driving.telemetry.stadium import LENGTH_M, RADIUS_M, as_log, drive, stadium

from racecraft.worlds.deepracer.analysis.ghosts import drive_of
from racecraft.worlds.deepracer.analysis.telemetry_page import telemetry_data, write_telemetry_page
from racecraft.worlds.deepracer.driving.telemetry.laps import find_laps
from racecraft.worlds.deepracer.driving.telemetry.losses import compare_lap
from racecraft.worlds.deepracer.driving.telemetry.reference import of_lap
from racecraft.worlds.deepracer.driving.telemetry.timing import time_laps

FAST, SLOW = 2.0, 1.0


@pytest.fixture
def compared():
    """A lap that slows down in the second corner beside one that does not."""
    corner = LENGTH_M / 2 + 2.0, LENGTH_M / 2 + 2.0 + np.pi * RADIUS_M
    slow = lambda arc: np.where((arc >= corner[0]) & (arc < corner[1]), SLOW, FAST)  # noqa: E731
    laps = find_laps(as_log([drive(slow), drive(lambda arc: np.full_like(arc, FAST))]), stadium())
    timing = time_laps(laps)
    return compare_lap(timing, 0, of_lap(laps, 1, "the other lap"))


def test_ghosts_cross_the_line_at_once_and_are_where_the_cars_were(compared):
    track = compared.timing.laps.track
    lap, other = (drive_of(one, track, 200) for one in (compared.lap, compared.reference))
    for one in (lap, other):
        assert np.hypot(one.x_m[0] - track.centre[0, 0], one.y_m[0] - track.centre[0, 1]) < 0.15
    at = round(3.0 * 15)  # after 3 s both have driven 6 m
    assert other.progress_percent[at] == pytest.approx(100 * 6.0 / LENGTH_M, abs=1.0)
    assert lap.progress_percent[at] == pytest.approx(other.progress_percent[at], abs=1.0)
    assert (other.status == "lap_complete").argmax() < (lap.status == "lap_complete").argmax()
    where = track.locate(np.column_stack([lap.x_m, lap.y_m]))
    assert where.distance.max() < 0.05


def test_the_page_names_the_corner_and_marks_it_on_the_map(compared, tmp_path):
    told = telemetry_data(compared)
    assert told["advice"].startswith("Work on turn 2 (left)")
    assert [mark["worst"] for mark in told["map"]["corners"]] == [False, True]
    lost = told["traces"][0]["plot"]["series"][0]["y"]
    assert lost[-1] == pytest.approx(compared.lost_seconds, abs=1e-3)
    write_telemetry_page(tmp_path / "page.html", compared, "a <b>log</b>")
    html = (tmp_path / "page.html").read_text()
    assert "a &lt;b&gt;log&lt;/b&gt;" in html
    assert "Work on turn 2 (left)" in html
    assert 'src="http' not in html
