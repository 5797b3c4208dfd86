"""What is kept of drives side by side: which failed, each row's own episode, and its world before any tick."""

import numpy as np
import pytest

from racecraft.worlds.deepracer.env import race
from racecraft.worlds.deepracer.evaluation.recorded_drives import RecordedDrives


@pytest.fixture
def drives():
    """Five ticks of seven rows; a row's report tells tick and row, its status how it ended at its last tick."""
    reports = np.zeros((5, 7), race.TICK_REPORT)
    reports["x"] = 10 * np.arange(5)[:, None] + np.arange(7)
    last = np.array([0, 4, 2, 3, 1, 2, 3])
    ends = [
        race.OFF_TRACK,
        race.LAP_COMPLETE,
        race.CRASHED,
        race.TIME_UP,
        race.IMMOBILISED,
        race.OFF_TRACK,
        race.REVERSED,
    ]
    reports["status"][last, np.arange(7)] = ends
    reports["truncated"][2, 5] = True
    states = tuple({"x": 100 * tick + np.arange(7.0)} for tick in range(6))
    return RecordedDrives(reports, np.zeros((5, 7)), states, last)


def test_failures_are_mishaps_that_ended_an_episode_and_were_not_cut(drives):
    assert drives.failed.tolist() == [0, 2, 4, 6]
    assert len(drives) == 7


def test_a_row_has_its_own_end_its_own_ticks_and_its_own_world(drives):
    assert drives.endings["x"].tolist() == [0, 41, 22, 33, 14, 25, 36]
    assert drives.of(2)["x"].tolist() == [2, 12, 22]
    assert drives.of(0)["x"].tolist() == [0]
    assert drives.state(3, 4)["x"].tolist() == [304.0]
