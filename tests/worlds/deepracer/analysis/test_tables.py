"""Tables against ticks small enough to count by hand."""

import numpy as np
import polars as pl
import pytest

from racecraft.formats.episodes import write_episodes
from racecraft.formats.run_folder import RunFolder
from racecraft.worlds.deepracer.analysis.tables import (
    TableError,
    action_table,
    command_table,
    endings_table,
    exits_table,
    laps_table,
    load_episodes,
)


@pytest.fixture
def ticks():
    """Car 0 laps in three ticks and sets out again; car 1 leaves the road in two, then runs out of time in one."""
    return pl.DataFrame(
        {
            "world": [0, 0, 0, 0, 1, 1, 1],
            "episode": [0, 0, 0, 1, 0, 0, 1],
            "iteration": [1] * 7,
            "tick": [1, 2, 3, 1, 1, 2, 9],
            "x_m": [0.0, 1.0, 2.0, 0.0, 5.0, 6.0, 7.0],
            "y_m": [0.0, 0.0, 0.5, 0.0, 5.0, 5.5, 7.0],
            "steering_rad": [0.0, 0.5, -0.5, 0.0, 0.5, 0.5, 0.0],
            "speed_mps": [1.0] * 7,
            "velocity_mps": [0.0, 1.0, 2.0, 0.0, 0.0, 3.0, 1.0],
            "action": [1, 0, 2, 1, 0, 0, 1],
            "reward": [0.0, 1.0, 2.0, 0.0, 0.0, 0.5, 4.0],
            "done": [False, False, True, False, False, True, True],
            "status": ["prepare", "in_progress", "lap_complete", "prepare", "prepare", "off_track", "in_progress"],
            "progress_share": [0.0, 0.5, 1.02, 0.0, 0.0, 0.25, 0.75],
            "closest_waypoint": [0, 5, 0, 0, 20, 31, 60],
        }
    )


def test_laps_are_counted_by_hand(ticks):
    laps = laps_table(ticks)
    assert laps["status"].to_list() == ["lap_complete", "off_track", "time_up"]
    assert laps["lap_seconds"].to_list() == [pytest.approx(3 / 15), None, None]
    assert laps["progress_percent"].to_list() == [100.0, 25.0, 75.0]
    assert laps["mean_speed_mps"].to_list() == [1.5, 3.0, 1.0]
    assert laps["reward"].to_list() == [3.0, 0.5, 4.0]
    assert laps["whole"].to_list() == [True, True, False]
    assert laps.row(1)[-3:] == (6.0, 5.5, 31)


def test_an_episode_under_way_is_no_lap_yet_and_one_over_two_files_is_one(ticks, tmp_path):
    run = RunFolder.create(tmp_path / "run")
    for number, rows in ((2, ticks[:1]), (10, ticks[1:4])):
        write_episodes(
            run.episodes / f"{number}.parquet",
            {"time_s": np.zeros(len(rows)), **{name: rows[name].to_numpy() for name in rows.columns}},
        )
    together = load_episodes(run)
    assert together["tick"].to_list() == [1, 2, 3, 1]  # file 2 before file 10
    assert laps_table(together)["ticks"].to_list() == [3]
    assert load_episodes(run, last_rows=2)["tick"].to_list() == [2, 3, 1]
    assert "time_s" not in together.columns


def test_actions_are_counted_left_first_without_held_ticks(ticks):
    table = action_table(ticks)
    assert table["action"].to_list() == [0, 1, 2]
    assert table["count"].to_list() == [2, 1, 1]
    assert table["share"].to_list() == [0.5, 0.25, 0.25]
    assert table["mean_reward"].to_list() == [0.75, 4.0, 2.0]


def test_continuous_commands_are_counted_in_bands_of_angle(ticks):
    """Angles of -0.5, 0 and 0.5 rad: in two bands of half a rad the middle is the left one's lower end."""
    continuous = ticks.with_columns(action=pl.lit(-1), speed_mps=pl.Series([9.0, 1.0, 2.0, 9.0, 9.0, 3.0, 4.0]))
    assert action_table(continuous).is_empty()
    assert command_table(ticks).is_empty()
    table = command_table(continuous, bands=2)
    assert table["steering_low_rad"].to_list() == [0.0, -0.5]
    assert table["steering_high_rad"].to_list() == [0.5, 0.0]
    assert table["count"].to_list() == [3, 1]
    assert table["share"].to_list() == [0.75, 0.25]
    assert table["speed_mps"].to_list() == [pytest.approx(8 / 3), 2.0]
    assert table["mean_reward"].to_list() == [pytest.approx(5.5 / 3), 2.0]


def test_endings_and_exits_are_counted(ticks):
    laps = laps_table(pl.concat([ticks, ticks.with_columns(world=pl.col("world") + 2)]))
    assert sorted(endings_table(laps).rows()) == [
        ("lap_complete", 2, pytest.approx(1 / 3)),
        ("off_track", 2, pytest.approx(1 / 3)),
        ("time_up", 2, pytest.approx(1 / 3)),
    ]
    assert exits_table(laps).rows() == [(31, 2, 3.0)]
    hit = laps.with_columns(pl.col("status").cast(pl.String).replace("time_up", "crashed"))
    assert exits_table(hit)["count"].sum() == 4


def test_tables_leave_their_ticks_alone_and_name_what_is_missing(ticks, tmp_path):
    before = ticks.clone()
    action_table(ticks), laps_table(ticks)
    assert ticks.equals(before)
    with pytest.raises(TableError, match="no column reward, status"):
        laps_table(ticks.drop("reward", "status"))
    assert load_episodes(RunFolder.create(tmp_path / "run")).is_empty()
