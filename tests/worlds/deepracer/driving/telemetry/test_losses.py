"""The corner in which a lap loses time, and how much: computed from the speeds with which it was driven."""

import numpy as np
import pytest
from tests.worlds.deepracer.driving.telemetry.stadium import (
    LENGTH_M,
    RADIUS_M,
    STRAIGHT_M,
    as_log,
    at,
    drive,
    stadium,
)

from racecraft.worlds.deepracer.driving.line_file import COLUMNS
from racecraft.worlds.deepracer.driving.telemetry.laps import find_laps
from racecraft.worlds.deepracer.driving.telemetry.losses import compare_lap
from racecraft.worlds.deepracer.driving.telemetry.reference import is_line_file, of_best_zones, of_lap, of_line_file
from racecraft.worlds.deepracer.driving.telemetry.timing import time_laps
from racecraft.worlds.deepracer.tracks.track import Track

FIRST = STRAIGHT_M / 2, STRAIGHT_M / 2 + np.pi * RADIUS_M
SECOND = FIRST[0] + LENGTH_M / 2, FIRST[1] + LENGTH_M / 2


def slow_in(corner, slow=1.0, fast=2.0):
    """Return the speeds of a car that slows down in one corner."""
    return lambda arc: np.where((arc >= corner[0]) & (arc < corner[1]), slow, fast)


def timed(*drives):
    """Return the timing of laps."""
    return time_laps(find_laps(as_log(drives), stadium()))


def test_the_slow_corner_is_named_with_what_it_is_worth():
    timing = timed(drive(slow_in(SECOND), 1.0), drive(slow_in(SECOND, slow=2.0), 1.0))
    compared = compare_lap(timing, 0, of_lap(timing.laps, 1, "the other lap"))
    worth = np.pi * RADIUS_M * (1 / 1.0 - 1 / 2.0)
    assert compared.worst.name == "turn 2 (left)"
    assert compared.worst.lost_seconds == pytest.approx(worth, abs=0.05)
    assert compared.lost_seconds == pytest.approx(worth, abs=0.07)
    assert compared.delta_seconds[-1] == pytest.approx(compared.lost_seconds, abs=1e-9)
    before = compared.delta_seconds[timing.laps.shares < SECOND[0] / LENGTH_M]
    assert np.abs(before).max() < 0.07
    assert f"Work on turn 2 (left): it is worth {compared.worst.lost_seconds:.2f} s" in compared.advice()
    assert "slows to 1.00 m/s there where 2.00 is possible" in compared.advice()


def test_best_corners_of_several_laps_are_put_together():
    timing = timed(drive(slow_in(FIRST), 1.0), drive(slow_in(SECOND), 1.0))
    best = of_best_zones(timing)
    assert best.lap_seconds == pytest.approx(LENGTH_M / 2.0, abs=0.1)
    assert best.lap_seconds < timing.laps.lap_seconds.min() - 1.0


def test_a_standing_start_is_no_corners_fault():
    gathers = drive(lambda arc: np.where((arc >= 1.0) & (arc < 2.0), 0.5, 2.0), 1.0)
    timing = timed(gathers, drive(lambda arc: np.full_like(arc, 2.0), 7.0))
    compared = compare_lap(timing, 0, of_lap(timing.laps, 1, "the other lap"))
    assert compared.start_seconds == pytest.approx(1 / 0.5 - 1 / 2.0, abs=0.05)
    assert compared.worst is None
    assert "The standing start costs 1.5" in compared.advice()


def test_one_lap_alone_is_told_to_need_another():
    timing = timed(drive(slow_in(FIRST)))
    assert "nothing to compare it with" in compare_lap(timing, 0, of_best_zones(timing)).advice()


def test_a_line_file_is_a_reference(tmp_path):
    arc = np.arange(0.0, LENGTH_M, 0.1)
    points, normal = at(arc)
    heading = np.arctan2(-normal[:, 0], normal[:, 1])
    rows = np.column_stack([points, np.full(len(arc), 2.0), arc / 2.0, heading])
    path = tmp_path / "line.csv"
    path.write_text("\n".join([",".join(COLUMNS), *(",".join(map(str, row)) for row in rows)]))
    assert is_line_file(path)
    line = of_line_file(path, stadium())
    assert line.lap_seconds == pytest.approx(LENGTH_M / 2.0, abs=0.1)
    assert np.nanmedian(line.speed_mps) == pytest.approx(2.0, rel=0.02)


@pytest.mark.parametrize("mirrored", [False, True])
def test_an_apex_is_inside_of_left_and_right_corners_alike(mirrored):
    sign = -1.0 if mirrored else 1.0
    track, log = stadium(), as_log([drive(slow_in(FIRST)), drive(slow_in(SECOND))], offset_m=0.1)
    turned = Track.from_rows("turned", track.rows * np.tile([1.0, sign], 3))
    timing = time_laps(find_laps(log.with_columns(y_m=sign * log["y_m"]), turned))
    zones = compare_lap(timing, 0, of_lap(timing.laps, 1, "the other lap")).zones
    assert [zone.name for zone in zones] == [f"turn {k} ({'right' if mirrored else 'left'})" for k in (1, 2)]
    assert [zone.apex_metres for zone in zones] == pytest.approx([0.1, 0.1], abs=0.01)
