"""What a race of cars leaves for AWS's tools, of ticks written down by hand."""

import numpy as np

from racecraft.worlds.deepracer.env import race
from racecraft.worlds.deepracer.files.training_metrics import read_metrics_file
from racecraft.worlds.deepracer.logs.one_trace import read_sim_trace
from racecraft.worlds.deepracer.training.aws.head_to_head_files import waits_of, write_aws_heads

GOES, LAP = race.IN_PROGRESS, race.LAP_COMPLETE
STORY = (
    race.PREPARE, GOES, race.OFF_TRACK, race.PAUSE, race.PAUSE, GOES, LAP, GOES, race.CRASHED, race.PAUSE, GOES, LAP,
)  # fmt: skip
"""A lap with one mishap and two ticks of penalty, then one with a crash."""


def ticks_of(story, parked=3):
    ticks = np.zeros(len(story) + parked, race.TICK_REPORT)
    ticks["status"] = (*story, *[race.PARK] * parked)
    ticks["laps"] = np.cumsum(ticks["status"] == LAP)
    ticks["steps"], ticks["progress"] = np.arange(1, len(ticks) + 1), 40.0
    return ticks


def written(tmp_path, story):
    stamp = write_aws_heads(tmp_path, ticks_of(story), 20.0)
    [metrics] = tmp_path.rglob(f"evaluation-{stamp}.json")
    [trace] = tmp_path.rglob("*-iteration.csv")
    return read_metrics_file(metrics).rows, read_sim_trace(trace)


def test_every_lap_is_a_row_with_its_own_mishaps(tmp_path):
    first, second = written(tmp_path, STORY)[0]
    assert (first.trial, first.off_track_count, first.crash_count, first.reset_count) == (1, 1, 0, 1)
    assert (second.trial, second.off_track_count, second.crash_count, second.reset_count) == (2, 0, 1, 1)
    assert (first.episode_status, second.episode_status) == ("In progress", "Lap complete")
    assert first.completion_percentage == second.completion_percentage == 100
    # 7 and 5 ticks of 1/15 s, penalties in.
    assert (first.elapsed_time_in_milliseconds, second.elapsed_time_in_milliseconds) == (467, 333)
    assert second.start_time == first.metric_time


def test_a_car_that_is_out_ends_with_its_mishap_and_its_way(tmp_path):
    [row] = written(tmp_path, (race.PREPARE, GOES, race.REVERSED))[0]
    assert (row.trial, row.reversed_count, row.episode_status, row.completion_percentage) == (1, 1, "Reversed", 40)


def test_a_car_whose_time_is_out_says_so(tmp_path):
    ticks = ticks_of((race.PREPARE, GOES, GOES))
    ticks["truncated"][2] = True
    write_aws_heads(tmp_path, ticks, 20.0)
    [metrics] = tmp_path.rglob("metrics/**/evaluation-*.json")
    assert [row.episode_status for row in read_metrics_file(metrics).rows] == ["Time Up"]


def test_the_trace_ends_where_the_car_is_carried_off_the_road(tmp_path):
    columns = written(tmp_path, STORY)[1].columns
    assert len(columns["done"]) == len(STORY)
    assert np.flatnonzero(columns["done"]).tolist() == [len(STORY) - 1]


def test_a_penalty_counts_down():
    waits = waits_of(np.array([False, True, True, False, True]))
    np.testing.assert_allclose(waits * 15, [0, 2, 1, 0, 1])
