"""Windows of open-loop driving by hand: how long a command acts, what is clipped, where a window opens and ends."""

import math
from types import SimpleNamespace

import numpy as np
import pytest

from racecraft.worlds.deepracer.evaluation import open_loop
from racecraft.worlds.deepracer.evaluation.open_loop import (
    Windows,
    commands_of,
    drive_open_loop,
    open_windows,
    real_speeds,
    seconds_of,
)
from racecraft.worlds.deepracer.evaluation.recompute import TracePath
from racecraft.worlds.deepracer.files.sim_trace import SimTrace

TICK = 1 / 15


def trace_of(**columns):
    return SimTrace({"episode": np.zeros(len(next(iter(columns.values())))), **columns})


def flags(rows, *places):
    found = np.zeros(rows, bool)
    found[list(places)] = True
    return found


def walked(rows, begins=(0,), held=(0,), restarts=None):
    restarts = begins if restarts is None else restarts
    return TracePath(poses=np.zeros((rows, 3)), begins=flags(rows, *begins), restarts=flags(rows, *restarts),
                held=flags(rows, *held))  # fmt: skip


def test_a_command_acts_a_tick_through_missing_rows_for_three_seconds_at_most_and_two_ticks_before_a_restart():
    """Steps 1, 2, 4, 104 and, after a restart at row 4, 1, 2."""
    trace = trace_of(steps=np.array([1.0, 2.0, 4.0, 104.0, 1.0, 2.0]))
    seconds = seconds_of(trace, walked(6, begins=(0, 4)), clocked=False)
    assert seconds == pytest.approx([TICK, 2 * TICK, 3.0, 2 * TICK, TICK, TICK])


def test_an_episode_that_goes_on_flying_takes_no_time_to_reset():
    """Its number changes and its steps begin anew, but the car does not stop: one tick, never less."""
    trace = trace_of(steps=np.array([1.0, 2.0, 1.0, 2.0]))
    assert seconds_of(trace, walked(4, begins=(0, 2), restarts=(0,)), clocked=False) == pytest.approx([TICK] * 4)


def test_by_the_clock_a_row_acts_as_long_as_its_stamp_lies_behind_the_one_before_where_that_can_be_true():
    """Not in an episode's first two rows, not backwards or at once, not 3 s and more, not beside a missing row."""
    steps = np.array([1, 2, 3, 4, 5, 6, 7, 9, 10, 1, 2, 3.0])
    stamps = np.array([9.0, 9.5, 9.6, 9.7, 9.7, 9.6, 12.6, 12.7, 12.8, 13.0, 13.4, 13.49])
    trace = trace_of(steps=steps, tstamp=stamps)
    restarts = walked(12, begins=(0, 9))
    t, two = TICK, 2 * TICK
    expected = [t, t, 0.1, 0.1, t, t, two, 0.1, two, t, t, 0.09]
    # Row 6 acts over the missing row after it; row 8 until the car stands at its start again.
    assert seconds_of(trace, restarts, clocked=True) == pytest.approx(expected)


def test_commands_are_radians_and_metres_a_second_within_what_the_original_lets_through():
    steer, throttle = np.array([30.0, -30.1, 12.0, 90.0]), np.array([0.05, 0.1, 4.0, 4.5])
    told = commands_of(trace_of(steer=steer, throttle=throttle))
    assert told[:, 0] == pytest.approx(np.radians([30.0, -30.0, 12.0, 30.0]))
    assert told[:, 1].tolist() == [0.1, 0.1, 4.0, 4.0]


def test_a_window_opens_at_every_fifth_driven_row_of_its_episode_and_ends_with_it():
    """Thirty rows, then ten: 8 to 15 ticks fit. The first row is held, so driven rows count from the second."""
    steps = np.array([*range(1, 31), *range(1, 11)], float)
    trace = trace_of(steps=steps)
    first, ticks = open_windows(trace, walked(40, begins=(0, 30), held=(0, 30)))
    assert first.tolist() == [1, 6, 11, 16, 21, 31]
    assert ticks.tolist() == [15, 15, 15, 13, 8, 8]
    assert len(Windows(first, ticks, np.zeros((6, 16, 3)), {}, {})) == 6


def test_rows_of_another_status_open_no_window_though_one_may_reach_over_them():
    steps = np.arange(1.0, 31.0)
    status = np.full(30, "in_progress", dtype=object)
    status[6], status[29] = "off_track", "lap_complete"
    trace = trace_of(steps=steps, episode_status=status)
    first, ticks = open_windows(trace, walked(30))
    assert first.tolist() == [0 + 1, 7, 12, 17], "row 6 is not counted, so the next to open is row 7"
    assert ticks.tolist() == [15, 15, 15, 12]


@pytest.mark.parametrize(("car", "clocked", "by_clock"), [
    ("v4", None, False), ("v6", None, True), ("v6", False, False), ("v4", True, True),
])  # fmt: skip
def test_a_car_is_driven_by_the_clock_of_its_build_or_as_it_is_asked(monkeypatch, car, clocked, by_clock):
    """And by hand: a car that stands still at (0, 0), beside a recorded one that comes 0.3 m by row 8 and 0.5 by 15."""
    asked = []
    monkeypatch.setattr(open_loop, "seconds_of", lambda trace, retold, clocked: asked.append(clocked) or np.ones(16))

    def stand(profile, places, commands, seconds, restarts, held, first, ticks, paths):
        paths[:, :9] = 0.0
        paths[:1] = 0.0
        paths[..., 2] += 0.1

    monkeypatch.setattr(open_loop, "drive_windows", stand)
    x, y = np.zeros(16), np.zeros(16)
    x[8:], y[15] = 0.3, 0.4
    x[13] = 7.0
    trace = trace_of(steps=np.arange(1.0, 17.0), X=x, Y=y, steer=np.zeros(16), throttle=np.ones(16))
    retold = walked(16, held=())
    retold.poses[:, 2] = np.linspace(0.0, 1.5, 16)
    retold.poses[15, 2] = 2 * math.pi - 0.25
    windows = drive_open_loop(trace, retold, car, clocked)
    assert asked == [by_clock]
    assert (windows.first.tolist(), windows.ticks.tolist()) == ([0, 5], [15, 10])
    assert windows.paths.shape == (2, 16, 3)
    assert windows.position_m["0.5s"] == pytest.approx([0.3, 7.0])
    assert windows.position_m["1s"] == pytest.approx([0.5, math.nan], nan_ok=True)
    assert windows.yaw_rad["0.5s"] == pytest.approx([0.7, 1.2])
    assert windows.yaw_rad["1s"] == pytest.approx([0.35, math.nan], nan_ok=True), "the shorter way round"


def test_a_row_before_a_missing_one_opens_no_window_be_it_the_first():
    trace = trace_of(steps=np.array([1.0, *range(3, 21)]))
    first, ticks = open_windows(trace, walked(19, held=()))
    assert (first.tolist(), ticks.tolist()) == ([5, 10], [13, 8])


def test_the_speed_of_a_window_is_the_way_of_its_ticks_over_their_time():
    """By hand: 0.1 m a tick of 1/15 s are 1.5 m/s, on a straight and round a corner; then the car stands."""
    x = np.array([0.0, 0.1, 0.2, 0.3, 0.3, 0.3, 0.3])
    y = np.array([0.0, 0.0, 0.0, 0.0, 0.1, 0.1, 0.1])
    windows = SimpleNamespace(first=np.array([0, 0, 2, 4]), ticks=np.array([3, 4, 2, 2]))
    assert np.allclose(real_speeds(SimpleNamespace(columns={"X": x, "Y": y}), windows), [1.5, 1.5, 1.5, 0.0])
