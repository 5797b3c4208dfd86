"""A drive is the same whether a world or an episode file tells it."""

import numpy as np
import polars as pl
import pytest
from numpy.testing import assert_allclose

from racecraft.worlds.deepracer.analysis.drive import Drive, DriveError, as_drive
from racecraft.worlds.deepracer.env import race
from racecraft.worlds.deepracer.env.vehicle import TICK_SECONDS


def as_rows(reports):
    """Return the reports as an episode file has them."""
    return pl.DataFrame(
        {
            "episode": reports["episode"],
            "world": np.zeros(len(reports), int),
            "tick": reports["steps"].astype(int),
            "x_m": reports["front_x"],
            "y_m": reports["front_y"],
            "yaw_rad": reports["yaw"],
            "velocity_mps": reports["driven_speed"],
            "speed_mps": reports["speed"],
            "steering_rad": reports["steering"],
            "progress_share": reports["progress"] / 100.0,
            "status": np.array(race.STATUSES)[reports["status"]],
        }
    )


def test_reports_and_episode_files_tell_the_same_drive(reports_along):
    first = reports_along(40)
    second = reports_along(25, race.OFF_TRACK, share=0.3)
    second["steps"] += 40  # a flying lap of the same episode goes on counting its ticks
    reports = np.concatenate([first, second])
    from_world, from_file = Drive.from_reports(reports), Drive.from_episodes(as_rows(reports))
    for name in Drive.__dataclass_fields__:
        if name == "status":
            assert (from_world.status == from_file.status).all()
        elif name in ("trial", "resets", "penalty_seconds", "boxes"):
            assert getattr(from_world, name) is getattr(from_file, name) is None, (
                "told of judged races and drives among boxes only"
            )
        else:
            assert_allclose(getattr(from_file, name), getattr(from_world, name), atol=1e-9, err_msg=name)
    assert from_world.lap[[0, 39, 40, 64]].tolist() == [1, 1, 2, 2]
    assert from_world.endings.tolist() == [39, 64]
    assert [from_world.outcome(row) for row in from_world.endings] == ["lap complete 2.67 s", "off track at 30 %"]
    assert from_world.best_lap_seconds == pytest.approx(40 * TICK_SECONDS)
    assert len(from_world.of_lap(2)) == 25
    assert len(as_drive(reports)) == len(as_drive(as_rows(reports))) == len(as_drive(from_world)) == 65


def test_poses_are_of_base_link(reports_along):
    reports = reports_along(20)
    poses = Drive.from_reports(reports).poses
    assert_allclose(poses, np.column_stack([reports["x"], reports["y"], reports["yaw"]]), atol=1e-12)


def test_a_world_that_was_reset_begins_another_lap(reports_along):
    off = reports_along(10, race.OFF_TRACK, share=0.1)
    again = np.concatenate([off, off])  # both are episode 0
    for drive in (Drive.from_reports(again), Drive.from_episodes(as_rows(again))):
        assert drive.lap.tolist() == [1] * 10 + [2] * 10
        assert_allclose(drive.lap_seconds[10:], drive.lap_seconds[:10])


def test_a_drive_that_was_cut_short_says_so(reports_along):
    reports = reports_along(10, race.IN_PROGRESS, share=0.5)
    reports["truncated"][-1] = True
    assert Drive.from_reports(reports).outcome(9) == "out of time at 50 %"


def test_what_is_no_drive_is_refused_in_a_letter(reports_along):
    rows = as_rows(reports_along(10))
    with pytest.raises(DriveError, match=r"no rows; expected the ticks of one car"):
        Drive.from_episodes(rows.head(0))
    with pytest.raises(DriveError, match="rows without yaw_rad"):
        Drive.from_episodes(rows.drop("yaw_rad"))
    with pytest.raises(DriveError, match="rows of 2 cars"):
        Drive.from_episodes(pl.concat([rows, rows.with_columns(world=pl.lit(1).cast(pl.Int64))]))
