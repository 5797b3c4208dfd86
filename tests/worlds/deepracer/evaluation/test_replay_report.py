"""The figures of the fidelity report by hand: small traces whose every mismatch and distance is known."""

import math
from types import SimpleNamespace

import numpy as np
import pytest

from racecraft.contract.errors import InputFileError
from racecraft.worlds.deepracer.evaluation import replay_report
from racecraft.worlds.deepracer.evaluation.open_loop import Windows
from racecraft.worlds.deepracer.evaluation.recompute import RecomputedTrace
from racecraft.worlds.deepracer.evaluation.replay_report import FileReplay, ReplayReport
from racecraft.worlds.deepracer.files.sim_trace import SimTrace
from racecraft.worlds.deepracer.tracks.catalogue import load_track

NAN = math.nan
OVAL = load_track("Oval_track")


def at(rows, *places):
    found = np.zeros(rows, bool)
    found[list(places)] = True
    return found


def retold(rows=10, waypoints=None, **marks):
    """A trace of so many rows that agrees with ours but where `marks` says."""
    named = ("begins", "restarts", "held", "reversed", "progress_wrong", "waypoint_wrong", "wheels_wrong",
             "off_track_judged", "off_track_wrong", "progress_far")  # fmt: skip
    flags = {name: at(rows, *marks.get(name, [0] if name == "begins" else [])) for name in named}
    return RecomputedTrace(poses=np.zeros((rows, 3)), progress=np.zeros(rows), waypoints=waypoints, **flags)


def windows(first=(), half=(), one=(), turns=None):
    """Windows that open at some rows, and how far our car strayed in each after half a second and after one."""
    first = np.array(first, int)
    position = {"0.5s": np.array(half, float), "1s": np.array(one, float)}
    yaw = turns or {name: np.zeros(len(first)) for name in position}
    return Windows(first, np.full(len(first), 3), np.zeros((len(first), 16, 3)), position, yaw)


def trace(rows=10, **columns):
    nowhere = {"X": np.zeros(rows), "Y": np.zeros(rows)}
    return SimTrace({"episode": np.arange(rows) // 5, "steps": np.arange(rows) % 5 + 1.0, **nowhere, **columns})


def report(*files, exact=True, car="v4"):
    made = tuple(FileReplay("a.csv", trace(len(one.begins)), one, windows()) for one in files)
    return ReplayReport(OVAL, exact, car, made, {car: 0.1})


def test_the_figures_of_two_files_are_added_up():
    marks = {
        "begins": [0, 5], "reversed": [5, 6, 7, 8, 9], "progress_wrong": [1], "waypoint_wrong": [1, 2],
        "wheels_wrong": [1, 2, 3], "off_track_judged": [0, 1, 2, 3, 4], "off_track_wrong": [0, 1, 2, 3],
    }  # fmt: skip
    turns = {"0.5s": np.radians([1.0, 2.0, 3.0]), "1s": np.radians([4.0, NAN, 5.0])}
    far = windows([1, 3, 6], [0.1, 0.2, 0.4], [0.5, NAN, 0.6], turns)
    first = FileReplay("a.csv", trace(), retold(**marks), far)
    other = FileReplay("b.csv", trace(4), retold(4), windows([0], [0.3], [0.7]))
    told = ReplayReport(OVAL, True, "v4", (first, other), {"v4": 0.6}).as_dictionary()
    assert (told["rows"], told["episodes"], told["reversed_episodes"]) == (14, 3, 1)
    names = ("progress", "closest_waypoint", "all_wheels", "off_track")
    assert [told[f"{name}_mismatches"] for name in names] == [1, 2, 3, 4]
    assert told["windows"] == {"0.5s": 4, "1s": 3}
    # Ninety per cent of the way through 0.1, 0.2, 0.3, 0.4 and 0.5, 0.6, 0.7.
    assert told["open_loop_position_m"] == {"0.5s": {"median": 0.25, "p90": 0.37}, "1s": {"median": 0.6, "p90": 0.68}}
    assert told["open_loop_yaw_deg"] == {"0.5s": {"median": 1.5, "p90": 2.7}, "1s": {"median": 4.0, "p90": 4.8}}
    assert (told["track"], told["direction"]) == ("Oval_track", "both")
    assert (told["car"], told["cars_tried_m"]) == ("v4", {"v4": 0.6})
    assert [one["rows"] for one in told["files"]] == [10, 4]
    assert told["files"][1]["off_track_mismatches"] is None, "no row says whether the car was off"
    assert [one["file"] for one in told["files"]] == ["a.csv", "b.csv"]


def test_the_worst_windows_come_first_and_are_five_with_row_and_errors_to_five_places():
    half = [0.1, 0.123456789, NAN, 0.3, 0.2, 0.3, 0.05]
    one = [0.2, NAN, NAN, 0.1, 0.25, 0.4, 0.06]
    turns = {"0.5s": np.full(7, math.radians(2.0)), "1s": np.full(7, NAN)}
    file = FileReplay("a.csv", trace(), retold(), windows([1, 2, 3, 4, 6, 7, 8], half, one, turns))
    told = file.worst_windows()
    assert [(row["episode"], row["steps"]) for row in told] == [(1, 3), (0, 5), (1, 2), (0, 2), (0, 3)]
    assert told[4]["position_m"] == {"0.5s": 0.12346, "1s": None}
    assert told[0]["yaw_deg"] == {"0.5s": 2.0, "1s": None}


@pytest.mark.parametrize(
    ("exact", "marks", "is_same"),
    [
        (True, {}, True),
        (True, {"progress_wrong": [3]}, False),
        (True, {"waypoint_wrong": [3]}, False),
        (False, {"progress_wrong": [3]}, True),
        (False, {"progress_far": [3]}, False),
        (True, {"wheels_wrong": [1]}, True),
        (True, {"wheels_wrong": [1, 2]}, False),
    ],
)
def test_a_track_is_the_same_where_all_agrees_but_two_wheels_in_a_thousand_rows(exact, marks, is_same):
    """Six hundred rows: one and a fifth may differ."""
    assert report(retold(500), retold(100, **marks), exact=exact).is_same_track is is_same


@pytest.mark.parametrize(
    ("slow", "fast", "is_same"),
    [
        ([0.1] * 30, [0.9] * 19, True),  # too few fast windows to be asked
        ([0.1] * 30, [0.9] * 20, False),
        ([0.1] * 5, [0.9] * 5, False),
        ([0.1], [], True),
        ([], [], None),
    ],
)
def test_a_band_of_speed_is_asked_where_twenty_windows_or_as_many_as_of_the_other_tell(slow, fast, is_same):
    strayed, speeds = np.array(slow + fast), np.array([1.0] * len(slow) + [3.0] * len(fast))
    told = SimpleNamespace(car="v4", _by_speed=lambda horizon: (strayed, speeds))
    assert ReplayReport.is_same_car.fget(told) is is_same


LIMITS = {"v4": (0.12, 0.25), "v5-classic": (0.20, 0.40), "v6": (0.11, 0.25)}
"""How far a car may stray in a second, m, below 2 m/s and from there on, as docs/fidelity.md tells."""


@pytest.mark.parametrize("car", LIMITS)
@pytest.mark.parametrize(("horizon", "share"), [("1s", 1.0), ("0.5s", 0.55)])
def test_a_car_is_the_same_up_to_its_limit_and_up_to_little_more_than_half_of_it_in_half_a_second(car, horizon, share):
    for speed, limit in zip((1.999, 2.0), LIMITS[car], strict=True):
        for far, is_same in ((share * limit - 0.001, True), (share * limit + 0.001, False)):
            by = {"1s": ([], []), horizon: ([far], [speed])}
            told = SimpleNamespace(car=car, _by_speed=lambda name, by=by: tuple(map(np.array, by[name])))
            assert ReplayReport.is_same_car.fget(told) is is_same


@pytest.mark.parametrize(
    ("reversed_rows", "direction"),
    [([], "forward"), ([0, 1, 2, 3, 4, 5, 6, 7, 8, 9], "reversed"), ([5, 6], "both"), ([6], "forward")],
)
def test_the_direction_is_that_of_the_episodes(reversed_rows, direction):
    assert report(retold(begins=[0, 5], reversed=reversed_rows)).direction == direction


@pytest.mark.parametrize(
    ("length", "far", "waypoints", "refused"),
    [
        (20.0, 5, 10, ""),  # just half of the progress is elsewhere, and of the same length
        (20.0, 6, 0, "6 of 10 rows"),
        (20.3, 0, 9, ""),  # of another length: nine of ten waypoints may be numbered otherwise
        (20.3, 0, 10, "10 of 10 rows"),
    ],
)
def test_a_trace_is_of_another_track_by_its_progress_or_by_length_and_waypoints(length, far, waypoints, refused):
    circuit = SimpleNamespace(name="mine", length=20.0)
    told = retold(progress_far=range(far), waypoint_wrong=range(waypoints))
    seen = trace(track_len=np.full(10, length))
    if not refused:
        replay_report._refuse_other_track("a.csv", seen, told, circuit)
        return
    words = rf"{refused} lie elsewhere on mine \(20\.00 m\).*a track of {length:.2f} m"
    with pytest.raises(InputFileError, match=words):
        replay_report._refuse_other_track("a.csv", seen, told, circuit)
