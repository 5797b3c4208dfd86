"""Six things that deepracer-utils gets wrong and this room right; each test shows both on the same log."""

import warnings

import numpy as np
import polars as pl
import pytest
from tests.worlds.deepracer.logs import makers

from racecraft.worlds.deepracer.analysis import logs as analysis
from racecraft.worlds.deepracer.logs import read
from racecraft.worlds.deepracer.tracks.catalogue import load_track
from racecraft.worlds.deepracer.tracks.track import Track

utils = pytest.importorskip("deepracer.logs", reason="deepracer-utils is not installed")


@pytest.fixture
def shown(monkeypatch):
    """Draw their plots into memory; return what stood on the axes when they would have been shown."""
    import matplotlib as mpl

    mpl.use("Agg")
    import matplotlib.pyplot as plt

    seen = []

    def keep():
        for axes in plt.gcf().axes:
            bars = [patch.get_height() for container in axes.containers for patch in container]
            seen.append((bars, [np.asarray(image.get_array()) for image in axes.images]))
        plt.close("all")

    monkeypatch.setattr(plt, "show", keep)
    return seen


def their_track(track):
    from deepracer.tracks import Track as TheirTrack

    return TheirTrack(track.name, np.asarray(track.rows))


@pytest.mark.parametrize(("first_worker", "become"), [((3, 2), 9), ((1, 4), 6)])
def test_unique_episode_over_workers_whose_iterations_differ_in_length(tmp_path, first_worker, become):
    """In the second log one worker ends with the number that the next one begins with."""
    for worker, counts in ((0, first_worker), (1, (2, 3))):
        first = 0
        for k, count in enumerate(counts):
            path = tmp_path / str(worker) / "training-simtrace" / f"{k}-iteration.csv"
            makers.write(path, makers.iteration(range(first, first + count)))
            first += count
    theirs = utils.DeepRacerLog(str(tmp_path))
    theirs.load_training_trace(ignore_metadata=True)
    true = theirs.df.groupby(["worker", "episode"]).ngroups
    assert (true, theirs.df["unique_episode"].nunique()) == (10, become), "some of their episodes have become one"
    ours = read(tmp_path).ticks.collect()
    assert ours["unique_episode"].n_unique() == 10
    assert ours.group_by("unique_episode").agg(pl.struct("worker", "episode").n_unique().alias("n"))["n"].max() == 1
    assert ours["unique_episode"].unique().sort().to_list() == list(range(10))
    assert ours.group_by("unique_episode").first().sort("unique_episode")["iteration"].is_sorted()


def test_the_parameters_of_a_new_reward(tmp_path):
    track = load_track("reInvent2019_wide")
    columns = makers.episode(0, 0.5, ticks=20, track=track)
    aside = 0.2 * np.array([-np.sin(np.radians(columns["yaw"])), np.cos(np.radians(columns["yaw"]))])
    columns["X"], columns["Y"] = columns["X"] + aside[0], columns["Y"] + aside[1]
    columns["all_wheels_on_track"][7] = False
    logs = read(makers.write(tmp_path / "0-iteration.csv", columns))
    theirs = utils.NewRewardUtils.df_to_params(logs.to_pandas("deepracer-utils").iloc[7], track.centre)
    ours = list(analysis.reward_params(logs.ticks, track))[7]
    heading, angle = columns["yaw"][7], columns["steer"][7]
    assert theirs["heading"] == pytest.approx(np.degrees(heading)), "theirs turns degrees into degrees again"
    assert ours["heading"] == pytest.approx(heading)
    assert abs(ours["steering_angle"] - angle) < 1e-9
    assert (theirs["track_width"], theirs["is_left_of_center"], theirs["all_wheels_on_track"]) == (0.60, None, True)
    assert ours["track_width"] == pytest.approx(1.07, abs=0.03)
    assert (ours["is_left_of_center"], ours["all_wheels_on_track"]) == (True, False)
    assert ours["distance_from_center"] == pytest.approx(0.2, abs=0.01)
    assert ours["progress"] == pytest.approx(columns["progress"][7])
    assert ours["closest_waypoints"][0] <= columns["closest_waypoint"][7] <= ours["closest_waypoints"][1]


def test_names_of_actions_when_one_was_never_chosen(tmp_path):
    columns = makers.iteration(range(2))
    gone = columns["action"] == 1
    columns = {name: value[~gone] for name, value in columns.items()}
    logs = read(makers.write(tmp_path / "0-iteration.csv", columns))
    theirs = utils.ActionBreakdownUtils.determine_action_names(logs.to_pandas("deepracer-utils"))
    assert theirs[1].startswith("A:2"), "their chart of action 1 bears the name of action 2"
    ours = analysis.action_names(logs.ticks)
    assert ours == {0: "0: 28.6° right, 1 m/s", 2: "2: 28.6° left, 1 m/s"}


@pytest.mark.parametrize("name", ["Oval_track", "Spain_track", "2022_april_open_ccw"])
def test_segments_of_circuits_that_theirs_has_no_table_for(name):
    from deepracer.tracks import track_utils

    assert set(track_utils.track_breakdown) == {"reinvent2018", "london_loop"}, "two circuits have a table of theirs"
    track = load_track(name)
    there, back = analysis.find_segments(track).all, analysis.find_segments(track.reversed()).all
    turn = 2 * np.pi * (1 if track.is_ccw else -1)
    assert sum(one.turn_rad for one in there) == pytest.approx(turn, abs=1e-6)
    assert sum(one.turn_rad for one in back) == pytest.approx(-turn, abs=1e-6)
    assert sum(one.length_m for one in there) == pytest.approx(track.length)
    other = {"left": "right", "right": "left", "straight": "straight"}
    assert sorted(other[one.kind] for one in back) == sorted(one.kind for one in there)
    assert {one.kind for one in there} >= {"straight", "left" if track.is_ccw else "right"}


def test_waypoints_of_another_resolution(tmp_path, shown):
    track = load_track("reinvent_base")
    columns = makers.joined(*(makers.episode(k, 1.0, ticks=60) for k in range(3)))
    logs = read(makers.write(tmp_path / "0-iteration.csv", columns))
    at = np.linspace(0.0, track.length, 71)
    lines = [np.stack([np.interp(at, track.arc, line[:, k]) for k in (0, 1)], 1)
             for line in (track.centre, track.inner, track.outer)]  # fmt: skip
    coarse = Track.from_rows("coarse", np.hstack(lines))
    assert (len(track.centre), len(coarse.centre)) == (119, 71)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        utils.ActionBreakdownUtils.action_breakdown(logs.to_pandas("deepracer-utils"), their_track(coarse))
    counted = sum(sum(bars) for bars, _ in shown)
    driven = logs.ticks.filter(pl.col("status") != "prepare").collect().height
    assert counted < 0.7 * driven, "ticks at waypoints 71 to 118 have no bar"
    fine, rough = (analysis.reward_per_waypoint(logs.ticks, one).data for one in (track, coarse))
    assert fine["count"].sum() == rough["count"].sum() == driven
    assert rough["lap_share"].max() > 0.95
    told, again = (analysis.action_breakdown(logs.ticks, one).data["count"].sum() for one in (track, coarse))
    assert told == again == driven


def test_heat_maps_show_every_tick_where_it_was(tmp_path, shown):
    track = load_track("reinvent_base")
    columns = makers.joined(makers.episode(0, 0.2, reward=0.0), makers.episode(1, 0.2, reward=1.0))
    x1 = track.outer[:, 0].max()
    columns["X"][11], columns["Y"][11], columns["reward"][11] = x1 + 0.95, 2.0, 5.0
    logs = read(makers.write(tmp_path / "0-iteration.csv", columns))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        utils.PlottingUtils.plot_track(logs.to_pandas("deepracer-utils"), their_track(track))
    image = shown[0][1][0]
    assert [size % 100 for size in image.shape] == [0, 0], "their map is cut to whole metres"
    far = int(np.argwhere(image == 5.0)[0, 1]) / 100 - 1.0 + track.outer[:, 0].min()
    assert abs(far - (x1 + 0.95)) > 0.05, "so a tick near its edge is drawn somewhere else"
    assert 0.5 not in image, "and of two ticks in one place the last alone is seen"
    cells = analysis.cells(logs.ticks, cell_m=0.05)
    assert abs(cells.filter(pl.col("mean") == 5.0)["x_m"][0] - (x1 + 0.95)) <= 0.025 + 1e-9
    twice = cells.filter(pl.col("count") == 2)
    assert twice.height >= 9
    assert set(twice["mean"].to_list()) <= {0.5, 0.0}, "0.0 is the place where both cars were held"
    assert cells["count"].sum() == 24


def test_an_evaluation_is_no_training(tmp_path):
    path = tmp_path / "evaluation.txt"
    path.write_text(makers.log_text(makers.lap_by_lap(3)))
    loose = path.rename(tmp_path / "a.log")
    theirs = utils.SimulationLogsIO.load_pandas(str(loose))
    training = utils.SimulationLogsIO.load_pandas(str(_written(tmp_path / "b.log", makers.iteration(range(3)))))
    assert list(theirs.columns) == list(training.columns), "theirs says nothing that would tell them apart"
    ours = read(loose)
    assert ours.training.collect().height == 0
    assert ours.evaluations.collect().height == 30
    assert read(tmp_path / "b.log").evaluations.collect().height == 0
    assert analysis.evaluation_table(ours.ticks)["lap"].to_list() == [1, 2, 3]


def _written(path, columns):
    path.write_text(makers.log_text(columns))
    return path
