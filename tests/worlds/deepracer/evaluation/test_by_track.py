"""Several tracks judged side by side: each as it is judged alone, and the figures by hand."""

from types import SimpleNamespace

import pytest
from tests.worlds.deepracer.training.test_courses import FOUR_CARS

from racecraft.contract.errors import SettingError
from racecraft.training.callbacks import NullCallback
from racecraft.training.worlds import train
from racecraft.worlds.deepracer.evaluation import by_track
from racecraft.worlds.deepracer.evaluation.by_track import (
    JudgedCourse,
    figures_of,
    headline_of,
    judge_named,
    judge_tracks,
    results_by_track,
    summary_of,
)
from racecraft.worlds.deepracer.evaluation.laps import Lap, LapReport, judge_starts
from racecraft.worlds.deepracer.players.trained_car import load_trained_car
from racecraft.worlds.deepracer.tracks.catalogue import load_track
from racecraft.worlds.deepracer.training.plan import RaceRequest

FULL = Lap(0.0, 100.0, 10.0, "lap_complete", 150)


def part(percent):
    return Lap(50.0, percent, None, "off_track", 40)


def test_laps_are_told_apart_by_track_and_counted_by_role():
    judged = [
        JudgedCourse("A", "A", "trained", "TIME_TRIAL", False, 2),
        JudgedCourse("B", "B", "trained", "TIME_TRIAL", False, 2),
        JudgedCourse("B", "B", "trained", "TIME_TRIAL", False, 1),
        JudgedCourse("C", "C", "held_out", "TIME_TRIAL", False, 2),
    ]
    report = LapReport((FULL, FULL, FULL, part(40.0), part(10.0), part(20.0), part(30.0)))
    results = results_by_track(report, judged)
    assert [(one.label, one.full_laps, one.mean_progress_percent) for one in results] == [
        ("A", 2, 100.0),
        ("B", 1, 70.0),
        ("B (2)", 0, 10.0),
        ("C", 0, 25.0),
    ]
    assert results[0].best_lap_seconds == 10.0
    assert results[3].best_lap_seconds is None
    assert summary_of(results) == {
        "trained": {"tracks": 3, "lapped": 1, "laps": 5, "full_laps": 3, "mean_progress_percent": 60.0},
        "held_out": {"tracks": 1, "lapped": 0, "laps": 2, "full_laps": 0, "mean_progress_percent": 25.0},
    }
    assert headline_of(results) == "1 of 3 lapped, worst B (2) 10 %; held out: 0 of 1 lapped, worst C 25 %"
    assert figures_of(results) == {
        "trained_tracks_lapped": pytest.approx(1 / 3),
        "trained_progress": 60.0,
        "trained_worst_progress": 10.0,
        "held_out_tracks_lapped": 0.0,
        "held_out_progress": 25.0,
        "held_out_worst_progress": 25.0,
        "trained/A": 100.0,
        "trained/B": 70.0,
        "trained/B (2)": 10.0,
        "held_out/C": 25.0,
    }


def test_one_track_has_no_table():
    assert (results_by_track(LapReport((FULL,)), []), headline_of([]), figures_of([])) == ((), "", {})


@pytest.fixture(scope="module")
def car(tmp_path_factory):
    request = RaceRequest(
        run=tmp_path_factory.mktemp("runs") / "run",
        overrides=FOUR_CARS,
        stops=("iterations=1",),
        groups=("track=Oval_track direction=reverse cars=2", "track=Vegas_track race=HEAD_TO_BOT bots.number=2 cars=2"),
        hold_out=("LGSWide",),
    )
    return load_trained_car(train(request, NullCallback(), lambda _: None).run.path)


def test_every_track_is_judged_as_it_is_alone(car):
    """By twin: a row of the table is what the same car does on that track with no other beside."""
    names = ("LGSWide", "reinvent_base", "Vegas_track")
    results = judge_tracks(car, [load_track(name) for name in names], ["trained", "held_out"], starts=3)
    assert [(one.label, one.role) for one in results] == [
        ("Oval_track reversed", "trained"),
        ("Vegas_track bots", "trained"),
        ("LGSWide", "held_out"),
        ("reinvent_base", "other"),
        ("Vegas_track", "trained"),
    ]
    for one in results[2:]:
        alone = judge_starts(car.policy, car.world(load_track(one.track), 3))
        assert one.mean_progress_percent == pytest.approx(alone.mean_progress_percent, abs=1e-3)
        assert one.full_laps == alone.full_laps
    assert len({one.mean_progress_percent for one in results}) >= 4, "the tracks are not one"


@pytest.fixture
def asked(monkeypatch):
    """What `judge_named` asks of `judge_tracks`; the run holds out one track where `held_out` says so."""
    told = SimpleNamespace(held_out=["a track"], car=SimpleNamespace(run=SimpleNamespace(path="runs/r")))
    monkeypatch.setattr(by_track, "held_out_of_run", lambda run: told.held_out)
    monkeypatch.setattr(by_track, "load_track", lambda name: f"<{name}>")
    monkeypatch.setattr(by_track, "catalogue_names", lambda: ["A", "B"])
    monkeypatch.setattr(by_track, "judge_tracks", lambda car, tracks, words, starts: (tracks, words, starts))
    return told


@pytest.mark.parametrize(
    ("names", "tracks", "words"),
    [
        (["held-out", "X"], ["<X>"], ["held_out"]),
        (["held_out", "trained"], [], ["trained", "held_out"]),
        (["all", "X"], ["<A>", "<B>", "<X>"], []),
    ],
)
def test_names_are_tracks_but_for_three_words(asked, names, tracks, words):
    assert judge_named(asked.car, names, 4) == (tracks, words, 4)


def test_who_held_no_track_out_is_told_so_and_only_where_it_matters(asked):
    asked.held_out = []
    assert judge_named(asked.car, ["trained", "X"], 4) == (["<X>"], ["trained"], 4)
    with pytest.raises(SettingError, match="runs/r holds no track out"):
        judge_named(asked.car, ["held-out"], 4)
