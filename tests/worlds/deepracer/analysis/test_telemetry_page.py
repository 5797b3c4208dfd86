"""A lap's telemetry on a page, and its ghosts: what they show is what the lap was."""

import numpy as np
import pytest
from tests.browser import Browser, needs_chromium
from tests.console.conftest import write_run
from tests.worlds.deepracer.driving.telemetry.stadium import LENGTH_M, RADIUS_M, as_log, drive, stadium

from racecraft.contract.errors import SettingError
from racecraft.worlds.deepracer.analysis.ghosts import drive_of, ghost_of, line_of, run_ghost
from racecraft.worlds.deepracer.analysis.telemetry_page import telemetry_data, write_telemetry_page
from racecraft.worlds.deepracer.driving.line_file import write_line
from racecraft.worlds.deepracer.driving.telemetry.laps import find_laps
from racecraft.worlds.deepracer.driving.telemetry.losses import compare_lap
from racecraft.worlds.deepracer.driving.telemetry.reference import of_lap, of_line_file
from racecraft.worlds.deepracer.driving.telemetry.timing import time_laps
from racecraft.worlds.deepracer.env.vehicle import FRONT_POINT_M
from racecraft.worlds.deepracer.tracks.catalogue import load_track

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


def test_a_lap_as_a_line_is_read_as_the_same_lap(compared, tmp_path):
    lap, track = compared.lap, compared.timing.laps.track
    write_line(line_of(lap, track), tmp_path / "lap.csv", "")
    again = of_line_file(tmp_path / "lap.csv", track)
    assert again.lap_seconds == pytest.approx(lap.lap_seconds, abs=0.02)
    assert np.abs(np.cumsum(again.seconds) - np.cumsum(lap.seconds)).max() < 0.03
    assert np.abs(again.offset_m - lap.offset_m).max() < 0.03  # the front heads elsewhere than base_link


def test_a_ghost_drives_the_lap_behind_the_point_that_logs_give(compared):
    lap, track = compared.lap, compared.timing.laps.track
    ghost = ghost_of(lap, track)
    x, y, yaw = ghost.path.T
    front = np.column_stack([x + FRONT_POINT_M * np.cos(yaw), y + FRONT_POINT_M * np.sin(yaw)])
    assert track.locate(front).distance.max() < 0.05
    assert x[0] - track.centre[0, 0] == pytest.approx(-FRONT_POINT_M, abs=0.04)  # the line is crossed eastwards
    assert len(ghost.path) == np.ceil(ghost.seconds * 15) + 1


def test_a_run_of_another_track_is_no_ghost(tmp_path):
    run = write_run(tmp_path / "car", track="Oval_track")
    with pytest.raises(SettingError, match="my car: does not drive reinvent_base"):
        run_ghost(run, load_track("reinvent_base"), "my car")


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


@needs_chromium
def test_a_lap_is_played_as_fast_as_one_wants(compared, tmp_path):
    write_telemetry_page(tmp_path / "page.html", compared, "a log")
    browser = Browser()
    try:
        browser.open((tmp_path / "page.html").as_uri())
        browser.value("performance.now = () => 0, self.requestAnimationFrame = next => self.next = next, 0")
        moments = []
        for pace, clock_ms in (("1", 1010), ("0.25", 5010), ("2", 5510)):
            browser.page.select_option(".pace", pace)
            if not moments:
                browser.click(".play")
            browser.value(f"next({clock_ms})")
            moments.append(browser.page.text_content(".player output"))
        assert moments == ["1.00 s", "2.00 s", "3.00 s"]
        assert browser.complaints == []
    finally:
        browser.close()
