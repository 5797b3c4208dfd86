"""What a drive's laps came to, by hand: which are full, how long they took, and which driver is the better one."""

import math
from types import SimpleNamespace

import numpy as np
import pytest

from racecraft.contract.world import EpisodeRecord
from racecraft.worlds.deepracer.env import race
from racecraft.worlds.deepracer.evaluation import laps
from racecraft.worlds.deepracer.evaluation.laps import Lap, LapReport, judge_laps, judge_starts


def test_figures_of_laps_by_hand():
    full, other = Lap(0.0, 100.0, 12.5, "lap_complete", 188, 7.0), Lap(20.0, 100.0, 11.25, "lap_complete", 169, 3.0)
    part = Lap(40.0, 33.3333, None, "off_track", 90)
    report = LapReport((full, part, other))
    assert [lap.is_full for lap in report.laps] == [True, False, True]
    assert (len(report), report.full_laps, report.all_full, report.best_lap_seconds) == (3, 2, False, 11.25)
    assert LapReport((full, other)).all_full
    assert LapReport((part,)).best_lap_seconds is None
    assert report.mean_progress_percent == pytest.approx(77.7777667)
    assert report.merit("progress") == report.mean_progress_percent
    assert report.merit("reward") == pytest.approx(10 / 3), "who was paid nothing counts 0"
    assert report.merit("laptime") == pytest.approx(-(12_500 + 999_999 + 11_250) / 3), "ms; unfinished is a long lap"
    told = report.as_dictionary()
    assert (told["full_laps"], told["mean_progress_percent"], told["best_lap_seconds"]) == (2, 77.778, 11.25)
    assert told["laps"][1] == {
        "start_percent": 40.0, "progress_percent": 33.3333, "seconds": None, "status": "off_track", "steps": 90,
        "reward": None,
    }  # fmt: skip


@pytest.fixture
def drive(monkeypatch):
    """A compiled drive that tells what a test has written; `asked` is what it was asked for."""
    made = SimpleNamespace(asked=[], tries=[], records=[])

    def episode(seed, look):
        made.asked.append(seed)
        for figures in made.tries[seed]:
            report = np.zeros((1, 1), race.TICK_REPORT)
            for name, value in figures.items():
                report[name] = value
            look(SimpleNamespace(reports=report))

    made.episode = episode
    made.episodes = lambda seed: made.asked.append(seed) or made.records
    monkeypatch.setattr(laps, "compiled_drive", lambda policy, world: made)
    return made


LAP = {"status": race.LAP_COMPLETE, "progress": 100.0}


def test_laps_of_one_car_are_counted_over_as_many_tries_as_it_takes(drive):
    """A full lap and one that leaves the road; one that ran out of time; then flying laps, of which one is too many."""
    drive.tries = [
        [
            {"progress": 50.0, "lap_seconds": 9.0},
            LAP | {"lap_seconds": 12.00000049, "start_share": 0.25},
            {"status": race.OFF_TRACK, "terminated": True, "progress": -1.0, "lap_seconds": 2.0},
        ],
        [{"status": race.IN_PROGRESS, "truncated": True, "progress": 120.0, "lap_seconds": 60.0}],
        [LAP | {"lap_seconds": 11.0}, LAP | {"lap_seconds": 10.0, "truncated": True}, LAP | {"lap_seconds": 8.0}],
    ]
    report = judge_laps(None, None, 5)
    assert drive.asked == [0, 1, 2], "every try with a chance of its own"
    assert report.laps == (
        Lap(25.0, 100.0, 12.0, "lap_complete", 180),
        Lap(0.0, 0.0, None, "off_track", 30),
        Lap(0.0, 100.0, None, "truncated", 900),
        Lap(0.0, 100.0, 11.0, "lap_complete", 165),
        Lap(0.0, 100.0, 10.0, "lap_complete", 150),
    )


@pytest.mark.parametrize("has_reward", [True, False])
def test_a_lap_from_each_start_is_what_its_episode_came_to(drive, has_reward):
    def came(world, progress, seconds, status):
        return EpisodeRecord(world, 0, 99, 7.5, status, {"lap_seconds": seconds, "progress_percent": progress})

    drive.records = [came(1, 100.0, 10.12345678, "lap_complete"), came(0, -2.0, math.nan, "off_track"),
                     came(1, 130.0, math.nan, "truncated")]  # fmt: skip
    world = SimpleNamespace(start_shares=np.array([0.0, 1 / 3]), has_reward=has_reward)
    reward = 7.5 if has_reward else None
    assert judge_starts(None, world).laps == (
        Lap(33.333333, 100.0, 10.123457, "lap_complete", 99, reward),
        Lap(0.0, 0.0, None, "off_track", 99, reward),
        Lap(33.333333, 100.0, None, "truncated", 99, reward),
    )
    judge_starts(None, world, seed=7)
    assert drive.asked == [0, 7]
