"""What a trace says of its car's whereabouts, by hand: episodes, restarts, held rows, and where a lap began."""

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


def agreed(implied, begins):
    flags = np.zeros(len(implied), bool)
    flags[list(begins)] = True
    return module._agreed_starts(np.array(implied), flags)


def test_an_episode_began_where_most_of_its_rows_say_also_across_the_start_line():
    starts = agreed([0.2, 0.5, 0.2, 0.7, 0.99999, 0.00001, 0.4, 1.00002], [0, 4])
    assert starts[:4] == pytest.approx([0.2] * 4)
    assert np.mod(starts[4:] + 0.5, 1.0) == pytest.approx([0.50001] * 4, abs=1e-9), "the middle one of those that agree"


def test_starts_before_and_behind_the_line_are_neighbours():
    assert agreed([-0.00001, 0.00001, -0.00002, 0.5], [0]) == pytest.approx([0.99999] * 4, abs=1e-9)


@pytest.mark.parametrize(("apart", "start"), [(0.9e-4, 0.3), (1.1e-4, 0.1)])
def test_starts_agree_within_a_ten_thousandth_of_the_lap(apart, start):
    """Two that agree outweigh one; where they do not, the first stands."""
    assert agreed([0.1, 0.3, 0.3 + apart], [0])[0] == pytest.approx(start, abs=1e-9)


class Road:
    """A lap of 10 m along x; waypoints a metre apart. Driven the other way x counts down."""

    closed, length = True, 10.0

    def __init__(self, backwards=False, repeated=False, shift=0):
        self.backwards, self.repeated_rows, self.shift = backwards, repeated, shift

    def locate(self, points):
        arc = np.mod(-points[:, 0] if self.backwards else points[:, 0], self.length)
        return SimpleNamespace(arc=arc, nearer_waypoint=(np.rint(arc) % 10).astype(int) + self.shift)

    def reversed(self):
        return Road(not self.backwards, self.repeated_rows, self.shift)

    def as_filed(self):
        return Road(self.backwards, self.repeated_rows, self.shift + 1)

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


def driven(x, progress, episode=None, **columns):
    rows = len(x)
    told = {
        "X": np.array(x, float), "progress": np.array(progress, float), "closest_waypoint": np.rint(x).astype(int) % 10,
        "all_wheels_on_track": np.ones(rows, bool), **columns,
    }  # fmt: skip
    episode = np.zeros(rows, int) if episode is None else np.array(episode)
    steps = np.concatenate([np.arange(1.0, 1 + count) for count in np.bincount(episode)])
    return trace(episode, steps, **told)


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


def test_a_difference_of_just_a_hundredth_is_none_and_of_just_a_point_is_not_far(plain):
    """Eighths of a lap, so that nothing is rounded."""
    x = 1.25 * np.arange(6)
    told = recompute(driven(x, [0.01, 13.5, 25.0, 37.5, 50.0, 62.5]), Road())
    assert told.progress.tolist() == [0.0, 12.5, 25.0, 37.5, 50.0, 62.5]
    assert (where(told.progress_wrong), where(told.progress_far)) == ([1], [])


def test_only_the_episode_that_fits_the_other_way_was_driven_backwards(plain):
    x = np.array([1.0, 2.0, 3.0, 4.0, 8.0, 7.0, 6.0, 5.0])
    told_waypoints = np.array([1, 2, 3, 4, 2, 3, 4, 5])
    seen = driven(x, [0, 10, 20, 30, 0, 10, 20, 30], [0, 0, 0, 0, 1, 1, 1, 1], closest_waypoint=told_waypoints)
    told = recompute(seen, Road())
    assert where(told.reversed) == [4, 5, 6, 7]
    assert not told.progress_wrong.any()
    assert not told.waypoint_wrong.any()
    open_road = Road()
    open_road.closed = False
    assert not recompute(seen, open_road).reversed.any(), "an open track has one direction"


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


@pytest.mark.parametrize(("shift", "counting", "wrong"), [(1, "as_filed", 0), (0, "distinct", 0), (5, None, 8)])
def test_a_repeated_row_is_counted_as_more_of_the_rows_have_it(plain, shift, counting, wrong):
    x = np.arange(8.0)
    seen = driven(x, 10 * x, closest_waypoint=x.astype(int) + shift)
    told = recompute(seen, Road(repeated=True))
    assert (told.waypoints, int(told.waypoint_wrong.sum())) == (counting, wrong)
    assert recompute(seen, Road()).waypoints is None, "without such rows nothing is to be told"
