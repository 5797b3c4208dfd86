"""What a trace says of its whereabouts, by hand: episodes, restarts, held rows, and where it differs from ours."""

import math
from types import SimpleNamespace

import numpy as np
import pytest

from racecraft.worlds.deepracer.env.vehicle import FRONT_POINT_M
from racecraft.worlds.deepracer.evaluation import recompute as module
from racecraft.worlds.deepracer.evaluation.recompute import episode_begins, places_of, recompute, trace_path
from racecraft.worlds.deepracer.files.sim_trace import SimTrace


def where(flags):
    return np.flatnonzero(flags).tolist()


def trace(episode, steps, **columns):
    rows = len(episode)
    nothing = {name: np.zeros(rows) for name in ("X", "Y", "yaw")}
    return SimTrace({"episode": np.array(episode), "steps": np.array(steps, float), **nothing, **columns})


def test_an_episode_begins_with_another_number_or_with_steps_that_do_not_grow():
    told = trace([0, 0, 0, 1, 1, 1, 1], [1, 2, 3, 4, 5, 5, 2])
    assert where(episode_begins(told)) == [0, 3, 5, 6]


def test_without_a_column_of_states_the_first_row_of_an_episode_is_held_and_a_flying_lap_is_not():
    told = trace_path(trace([0, 0, 1, 1, 2, 2, 3, 3], [1, 2, 1, 2, 3, 4, 2, 3]))
    assert where(told.begins) == [0, 2, 4, 6]
    assert where(told.held) == [0, 2]
    assert where(told.restarts) == [0, 2], "episodes 2 and 3 begin with a later step: their cars never stood"


def test_with_states_a_car_is_held_where_they_say_so_and_restarts_where_it_begins_held_or_anew():
    states = np.array(["prepare", "in_progress", "pause", "park", "in_progress", "prepare", "in_progress", "off_track"])
    told = trace_path(trace([0, 0, 0, 0, 1, 2, 3, 3], [1, 2, 3, 4, 5, 6, 1, 2], episode_status=states))
    assert where(told.begins) == [0, 4, 5, 6]
    assert where(told.held) == [0, 2, 3, 5]
    assert where(told.restarts) == [0, 5, 6]


def test_the_base_of_a_car_lies_behind_its_front_point_along_its_nose():
    told = trace([0, 0], [1, 2], X=np.array([1.0, 1.0]), Y=np.array([2.0, 2.0]), yaw=np.array([90.0, 180.0]))
    ahead = FRONT_POINT_M
    assert places_of(told) == pytest.approx(np.array([[1, 2 - ahead, math.pi / 2], [1 + ahead, 2, math.pi]]))


class Road:
    """A lap of 10 m along x; waypoints a metre apart. Driven the other way x counts down."""

    closed, length, repeated_rows = True, 10.0, False

    def __init__(self, backwards=False):
        self.backwards = backwards

    def locate(self, points):
        arc = np.mod(-points[:, 0] if self.backwards else points[:, 0], self.length)
        return SimpleNamespace(arc=arc, nearer_waypoint=(np.rint(arc) % 10).astype(int))

    def reversed(self):
        return Road(not self.backwards)

    def arrays(self):
        return None


@pytest.fixture
def plain(monkeypatch):
    """Wheels as a test says, and progress without the kernel: how far a lap has come since its start, per cent."""
    wheels = []

    def retell(shares, begins, starts, progress):
        progress[...] = 100.0 * np.mod(shares - starts, 1.0)

    monkeypatch.setattr(module, "recompute_progress", retell)
    monkeypatch.setattr(module, "count_wheels", lambda arrays, places, out: np.copyto(out, wheels or 4))
    return wheels


def driven(x, progress, **columns):
    rows = len(x)
    told = {
        "X": np.array(x, float), "progress": np.array(progress, float), "closest_waypoint": np.rint(x).astype(int) % 10,
        "all_wheels_on_track": np.ones(rows, bool), **columns,
    }  # fmt: skip
    return trace(np.zeros(rows, int), np.arange(1.0, 1 + rows), **told)


def test_a_row_is_wrong_by_more_than_a_hundredth_of_a_point_and_far_by_more_than_a_point(plain):
    # Of ten rows six agree to the digit, so where the episode began is theirs.
    off = np.array([0.0, 0.009, 0.011, -0.009, -0.011, 0.0, 0.99, 1.01, -1.01, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0])
    x = 0.5 + 0.25 * np.arange(15)
    told = recompute(driven(x, 100 * (x - 0.5) / 10 + off), Road())
    assert where(told.progress_wrong) == [2, 4, 6, 7, 8]
    assert where(told.progress_far) == [7, 8]
    assert told.progress == pytest.approx(100 * (x - 0.5) / 10)
    assert not told.waypoint_wrong.any()
    assert (told.waypoints, told.reversed.any()) == (None, False)


def test_wheels_and_the_edge_of_the_road_are_compared_where_the_car_is_driven(plain):
    plain[:] = [4, 3, 4, 0, 0, 1, 0, 0]
    states = ["prepare", "in_progress", "in_progress", "off_track", "in_progress", "off_track", "crashed", "pause"]
    on = np.array([False, True, True, False, False, False, False, True])
    x = np.arange(8.0)
    told = recompute(driven(x, 10 * x, all_wheels_on_track=on, episode_status=np.array(states)), Road())
    assert where(told.wheels_wrong) == [1], "rows 0 and 7 are held"
    assert where(told.off_track_judged) == [1, 2, 3, 4, 5]
    assert where(told.off_track_wrong) == [4, 5], "off with nobody saying so, and said to be off with a wheel on"
    silent = recompute(driven(x, 10 * x, all_wheels_on_track=on), Road())
    assert not silent.off_track_judged.any()
    assert not silent.off_track_wrong.any()
