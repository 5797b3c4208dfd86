"""Real logs of four origins, and deepracer-utils beside ours on the same folder."""

import numpy as np
import polars as pl
import pytest
from tests.reference import HAS_ALL, LARGE, TRACES

from racecraft.worlds.deepracer.logs import read
from racecraft.worlds.deepracer.logs.one_trace import read_sim_trace

ROWS = {"console-2022": (44247, 28, 560), "drfc-1-worker": (39392, 27, 540), "droa-2026-continuous": (3893, 8, 160)}


@pytest.mark.parametrize("name", ROWS)
def test_real_trainings_are_read_whole(name):
    if name == "console-2022" and not HAS_ALL:
        pytest.skip(LARGE)
    logs = read(TRACES / name)
    frame = logs.training.collect()
    assert (frame.height, frame["iteration"].n_unique(), frame["unique_episode"].n_unique()) == ROWS[name]
    assert logs.damaged == ()


def test_values_are_the_files_own_in_our_units():
    path = TRACES / "droa-2026-continuous" / "3-iteration.csv"
    theirs = read_sim_trace(path).columns
    ours = read(path).ticks.collect()
    for column, other in {
        "x_m": theirs["X"], "reward": theirs["reward"], "time_s": theirs["tstamp"],
        "wall_clock_s": theirs["wall_clock"],
        "yaw_rad": np.radians(theirs["yaw"]), "steering_rad": np.radians(theirs["steer"]),
        "progress_share": theirs["progress"] / 100.0, "tick": theirs["steps"], "action": theirs["action"],
    }.items():  # fmt: skip
        assert np.allclose(ours[column].to_numpy(), other, rtol=3e-16, atol=0), column


def test_deepracer_utils_frame_is_ours_under_its_names():
    from deepracer.logs import DeepRacerLog

    theirs = DeepRacerLog(str(TRACES / "drfc-1-worker"))
    theirs.load()
    ours = read(TRACES / "drfc-1-worker").to_pandas(names="deepracer-utils")
    ours = ours[ours["stream"] == ""]
    columns = [name for name in theirs.df.columns if name != "wall_clock"]
    assert set(columns) <= set(ours.columns)
    for name in columns:
        a, b = ours[name].to_numpy(), theirs.df[name].to_numpy()
        assert np.allclose(a, b, rtol=1e-12, atol=1e-12) if a.dtype.kind == "f" else (a == b).all(), name


def test_laps_of_an_evaluation_take_as_long_as_its_metrics_say():
    from racecraft.worlds.deepracer.analysis.logs import evaluation_table

    logs = read(TRACES / "drfc-1-worker")
    told = logs.metrics.filter((pl.col("phase") == "evaluation") & (pl.col("stream") == "20220709200242")).collect()
    laps = evaluation_table(logs.ticks)
    assert laps["complete"].to_list() == [True] * 3
    assert laps["seconds"].to_numpy()[1:] == pytest.approx(told["seconds"].to_numpy()[1:], abs=1e-9)
    assert laps["seconds"][0] == pytest.approx(told["seconds"][0], abs=0.06)  # the trace begins a moment later


def test_full_laps_of_a_training_take_as_long_as_its_metrics_say():
    from racecraft.worlds.deepracer.analysis.logs import simulation_agg

    logs = read(TRACES / "drfc-1-worker")
    told = logs.metrics.filter((pl.col("phase") == "training") & (pl.col("progress_share") == 1.0)).collect()
    full = simulation_agg(logs.training).filter(pl.col("complete"))
    both = full.join(told.select("episode", told=pl.col("seconds")), on="episode")
    assert both.height == full.height == 42
    assert np.abs(both["seconds"] - both["told"]).max() < 0.12


def test_evaluations_are_known_by_their_rows_where_no_path_tells(tmp_path):
    loose = tmp_path / "lap.csv"
    loose.write_bytes(
        (TRACES / "drfc-1-worker/evaluation-20220709200242/evaluation-simtrace/0-iteration.csv").read_bytes()
    )
    assert read(loose).ticks.collect()["phase"].unique().to_list() == ["evaluation"]
    loose.write_bytes((TRACES / "drfc-1-worker/training-simtrace/5-iteration.csv").read_bytes())
    assert read(loose).ticks.collect()["phase"].unique().to_list() == ["training"]
    assert read(loose, phase="leaderboard").ticks.collect()["phase"].unique().to_list() == ["leaderboard"]
