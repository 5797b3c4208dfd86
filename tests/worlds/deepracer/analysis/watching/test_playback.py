"""Reels say of every car and tick what the episode files say, whole episodes across iterations among them."""

import json
import sys
from pathlib import Path

import numpy as np
import polars as pl
import pytest

from racecraft.analysis.watching.facts import curves, run_facts
from racecraft.formats.episodes import read_episodes, write_episodes
from racecraft.formats.run_folder import RunFolder
from racecraft.worlds.deepracer.analysis.watching.playback import (
    ReelError,
    episode_playback,
    iteration_playback,
    kept_iterations,
)

sys.path.append(str(Path(__file__).resolve().parents[4]))
from kept_run import make_run  # noqa: E402


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    return make_run(tmp_path_factory.mktemp("runs") / "r")


def test_an_iteration_is_told_car_by_car(run):
    reel = iteration_playback(run, 2)
    kept = pl.read_parquet(run.episodes / "2.parquet")
    assert (reel["ticks"], [car["name"] for car in reel["cars"]]) == (40, ["0", "1", "2"])
    for car in reel["cars"]:
        rows = kept.filter(pl.col("world") == car["world"])
        np.testing.assert_allclose(car["x"], rows["x_m"], atol=5.1e-4)
        np.testing.assert_allclose(car["progress"], 100.0 * rows["progress_share"], atol=5.1e-3)
        assert car["tick"] == rows["tick"].to_list()
    ended = kept.with_columns(row=pl.int_range(pl.len()).over("world")).filter(pl.col("done"))
    assert len(ended) > 3, "cars that steer by chance leave the road"
    told = [(one["car"], one["tick"], one["status"]) for one in reel["endings"]]
    assert sorted(told) == sorted(ended.select("world", "row", "status").rows())
    json.dumps(reel, allow_nan=False)


def test_the_list_of_episodes_adds_up(run):
    reel = iteration_playback(run, 1)
    kept = pl.read_parquet(run.episodes / "1.parquet")
    sums = kept.group_by("world", "episode").agg(pl.col("reward").sum(), pl.len(), pl.col("status").last())
    for one in reel["episodes"]:
        row = sums.row(
            by_predicate=(pl.col("world") == one["world"]) & (pl.col("episode") == one["episode"]), named=True
        )
        assert one["reward"] == pytest.approx(row["reward"], abs=0.01)
        assert one["to"] - one["from"] + 1 == row["len"]
        assert one["status"] in (row["status"], "in_progress")
    assert len(reel["episodes"]) == len(sums)


def test_an_episode_over_two_iterations_is_whole(run):
    part = next(one for one in iteration_playback(run, 1)["episodes"] if one["status"] == "in_progress")
    reel = episode_playback(run, 1, part["world"], part["agent"], part["episode"])
    (car,) = reel["cars"]
    assert car["tick"] == list(range(1, reel["ticks"] + 1)), "from its first tick to its last"
    assert reel["endings"][-1]["tick"] == reel["ticks"] - 1
    again = next(one for one in iteration_playback(run, 2)["episodes"] if one["world"] == part["world"])
    assert again["episode"] == part["episode"]
    assert episode_playback(run, 2, again["world"], 0, again["episode"])["cars"] == reel["cars"], (
        "asked from either side"
    )


def test_worlds_of_several_cars_name_each(tmp_path):
    reel = iteration_playback(make_run(tmp_path / "r", 1, 10, worlds=2, cars=2), 1)
    assert [car["name"] for car in reel["cars"]] == ["0.0", "0.1", "1.0", "1.1"]
    one = reel["episodes"][-1]
    assert (
        episode_playback(RunFolder.open(tmp_path / "r"), 1, one["world"], 1, one["episode"])["cars"][0]["name"] == "1.1"
    )


def test_boxes_of_a_kept_iteration_stand_where_they_stood(tmp_path):
    """Two boxes in world 0, which move at tick 4 of 10; in world 1 one, and a place that this course does not have."""
    run = make_run(tmp_path / "r", 1, 10, worlds=2)
    kept = read_episodes(run.episodes / "1.parquet")
    columns = {name: kept[name].to_numpy() for name in kept.columns}
    columns["status"] = kept["status"].to_list()
    boxes = np.zeros(20, [(f"{axis}_{k}", "f4") for k in range(2) for axis in ("x", "y", "yaw")])
    first, second = np.arange(20) < 10, np.arange(20) >= 10
    boxes["x_0"][first], boxes["x_1"][first], boxes["yaw_1"][first] = 1.0, 2.0, 0.5
    boxes["x_0"][4:10] = 1.5
    boxes["y_0"][second] = 3.0
    for axis in ("x_1", "y_1", "yaw_1"):
        boxes[axis][second] = np.nan
    write_episodes(run.episodes / "1.parquet", {**columns, "objects": boxes})
    reel = iteration_playback(run, 1)
    assert reel["objects"] == {
        "0": [[0, [[1.0, 0.0, 0.0], [2.0, 0.0, 0.5]]], [4, [[1.5, 0.0, 0.0], [2.0, 0.0, 0.5]]]],
        "1": [[0, [[0.0, 3.0, 0.0]]]],
    }
    assert [len(car["x"]) for car in reel["cars"]] == [10, 10]
    one = next(part for part in reel["episodes"] if part["world"] == 1)
    alone = episode_playback(run, 1, 1, 0, one["episode"])
    assert alone["objects"] == {"1": [[0, [[0.0, 3.0, 0.0]]]]}
    json.dumps(reel, allow_nan=False)


def test_a_run_without_boxes_has_none(run):
    assert iteration_playback(run, 1)["objects"] == {}


def test_what_is_not_kept_is_named(run):
    with pytest.raises(ReelError, match="iteration 1 has no episode 999"):
        episode_playback(run, 1, 0, 0, 999)


def test_the_facts_and_the_curves(run):
    facts = run_facts(run, run.read_job())
    assert (facts["has_map"], facts["score_name"], facts["training"], facts["best"]) == (
        True,
        "progress %",
        False,
        None,
    )
    assert [row["iteration"] for row in curves(run, after=1)] == [2, 3]
    assert kept_iterations(run) == [1, 2, 3]
    with run.lock():
        assert run_facts(run, run.read_job())["training"], "who holds the folder trains"
    assert not run.is_training()
