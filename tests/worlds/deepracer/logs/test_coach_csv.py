"""The CSV that Coach kept of a training: rewards and lengths of episodes, and nothing of the road."""

import polars as pl
import pytest
from tests.worlds.deepracer.logs import makers

from racecraft.worlds.deepracer.actions.logs import logs
from racecraft.worlds.deepracer.analysis.logs import PlotError, rewards_and_lengths
from racecraft.worlds.deepracer.logs import read

NAME = "worker_0.simple_rl_graph.main_level.main_level.agent_0.csv"
HEAD = "Episode #,Training Iter,In Heatup,Episode Length,Total steps,Training Reward,Evaluation Reward,Loss/Mean"
ROWS = ("1,0.0,1.0,17.0,17.0,,,", "2,0.0,0.0,23.0,40.0,10.5,,", "3,1.0,0.0,30.0,70.0,20.5,40.0,0.1")


def write(path, *rows, head=HEAD):
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text("\n".join([head, *rows, ""]))
    return path


def test_every_episode_has_its_reward_its_length_and_its_iteration(tmp_path):
    found = read(write(tmp_path / "any.csv", *ROWS))
    told = found.metrics.select("phase", "iteration", "episode", "steps", "reward").collect()
    assert told.with_columns(pl.col("phase").cast(pl.String)).rows() == [
        ("training", 0, 0, 17, None), ("training", 0, 1, 23, 10.5), ("training", 1, 2, 30, 20.5),
        ("evaluation", 1, 2, None, 40.0),
    ]  # fmt: skip
    assert found.damaged == ()


def test_it_is_found_in_a_models_folder_by_its_name(tmp_path):
    write(tmp_path / "model" / NAME, *ROWS)
    makers.write(tmp_path / "model" / "training-simtrace" / "0-iteration.csv", makers.iteration(range(3)))
    found = read(tmp_path / "model")
    assert found.metrics.collect().height == 4
    assert found.ticks.select(pl.col("episode").n_unique()).collect().item() == 3


def test_rows_that_are_none_and_lacking_columns_are_named_with_their_line(tmp_path):
    found = read(write(tmp_path / NAME, ROWS[1], "what,ever", ROWS[2]))
    assert [(one.line, one.what) for one in found.damaged] == [(3, "no row of an episode; passed over")]
    assert found.metrics.collect().height == 3
    (damage,) = read(write(tmp_path / "b.csv", "1,2", head="Episode #,Training Iter")).damaged
    assert damage.line == 1
    assert "no column Episode Length" in damage.what


def test_the_command_tells_its_means(tmp_path):
    (training, evaluation) = logs(write(tmp_path / NAME, *ROWS))["metrics"]
    assert (training["episodes"], training["iterations"], training["mean_reward"]) == (3, 2, 15.5)
    assert evaluation["mean_reward"] == 40.0
    assert training["mean_progress_share"] is None


def test_rewards_and_lengths_are_of_the_episodes_that_have_both(tmp_path):
    plot = rewards_and_lengths(read(write(tmp_path / NAME, *ROWS)).metrics)
    assert plot.data["reward"].to_list() == [10.5, 20.5]
    assert plot.data["steps"].to_list() == [23, 30]
    assert plot._repr_png_()[:4] == b"\x89PNG"
    with pytest.raises(PlotError, match="No episode here"):
        rewards_and_lengths(plot.data.head(1).with_columns(pl.lit(None, pl.Float64).alias("reward")))
