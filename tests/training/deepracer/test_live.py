"""Live ticks: nothing is written when nobody watches, and what is written is what was driven."""

import os
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from racecraft.analysis.watching.reels import live_reel
from racecraft.formats import live_ticks
from racecraft.formats.episodes import STATUSES
from racecraft.formats.live_ticks import read_live_ticks, say_watched
from racecraft.formats.run_folder import RunFolder
from racecraft.training.deepracer import live
from racecraft.training.deepracer.live import RING_TICKS, LivePublisher

sys.path.append(str(Path(__file__).resolve().parents[2]))
from kept_run import drive, make_courses, make_world  # noqa: E402


@pytest.fixture
def run(tmp_path):
    return RunFolder.create(tmp_path / "r", {"kind": "deepracer"})


@pytest.fixture
def at_once(monkeypatch):
    """Look and write after every tick."""
    monkeypatch.setattr(live, "EVERY_SECONDS", 0.0)


class Seen:
    def __init__(self):
        self.x, self.status, self.rewards = [], [], []

    def __call__(self, world, buffers, actions):
        self.x.append(world.reports["front_x"].reshape(-1).copy())
        self.status.append(world.reports["status"].reshape(-1).copy())


def test_nothing_is_written_when_nobody_watches(run, at_once):
    before = sorted(path.name for path in run.path.iterdir())
    drive(make_world(), 30, [LivePublisher(run)])
    assert sorted(path.name for path in run.path.iterdir()) == before


def test_the_latest_ticks_are_those_that_were_driven(run, at_once):
    say_watched(run)
    world, seen, publisher = make_world(2, 2), Seen(), LivePublisher(run)
    drive(world, RING_TICKS + 37, [publisher, seen])
    left = read_live_ticks(run)
    assert left.last == RING_TICKS + 37
    assert left.columns["x_m"].shape == (RING_TICKS, 4)
    np.testing.assert_array_equal(left.columns["x_m"], np.array(seen.x, np.float32)[-RING_TICKS:])
    from racecraft.envs.deepracer.race import STATUSES as OF_RACE

    words = np.array(OF_RACE)[np.array(seen.status)[-RING_TICKS:]]
    np.testing.assert_array_equal(np.array(STATUSES)[left.columns["status"]], words)
    assert (words != "in_progress").any(), "some of these cars left the road"


def test_a_reader_that_keeps_up_has_no_gap(run, at_once):
    say_watched(run)
    world, publisher, buffers, after, told = make_world(), LivePublisher(run), None, 0, []
    for part in range(6):
        buffers = drive(world, 20, [publisher], part, buffers)
        reel = live_reel(run, after)
        assert reel["first"] == max(after, 1) + 1, "the first tick is only looked at"
        told += reel["cars"][0]["tick"]
        after = reel["last"]
        assert live_reel(run, after) is None
    assert after == 120
    assert all(b == a + 1 or b == 1 for a, b in zip(told, told[1:], strict=False))


def test_a_training_whose_watcher_left_stops_writing(run, at_once):
    say_watched(run)
    world, publisher = make_world(), LivePublisher(run)
    buffers = drive(world, 10, [publisher])
    long_ago = time.time() - live_ticks.WATCHED_SECONDS - 1
    os.utime(run.watched, (long_ago, long_ago))
    buffers = drive(world, 1, [publisher], 1, buffers)
    last = read_live_ticks(run).last
    drive(world, 10, [publisher], 2, buffers)
    assert read_live_ticks(run).last == last
    LivePublisher(run)
    assert read_live_ticks(run) is None, "a training that goes on begins without what an earlier one left"


def test_a_damaged_file_shows_nothing(run, at_once):
    say_watched(run)
    drive(make_world(), 5, [LivePublisher(run)])
    data = run.live.read_bytes()
    for damaged in (b"", data[: len(data) // 2], b"\0" * 64, b"{}"):
        run.live.write_bytes(damaged)
        assert read_live_ticks(run) is None


def test_a_full_disk_costs_the_training_nothing(run, at_once, monkeypatch):
    say_watched(run)

    def full(self, data):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(Path, "write_bytes", full)
    drive(make_world(), 5, [LivePublisher(run)])
    assert read_live_ticks(run) is None


class Stood:
    """Where objects were in each tick, course by course."""

    def __init__(self):
        self.boxes, self.x = [], []

    def __call__(self, world, buffers, actions):
        self.boxes.append([course.seen_boxes[..., :3].copy() for course in world.courses])
        self.x.append(world.reports["front_x"].reshape(-1).copy())


def test_cars_of_every_course_are_left_and_boxes_and_bots_stand_where_they_stood(run, at_once):
    say_watched(run)
    world, stood = make_courses(), Stood()
    drive(world, RING_TICKS + 30, [LivePublisher(run), stood])
    left = read_live_ticks(run)
    np.testing.assert_array_equal(left.columns["x_m"], np.array(stood.x, np.float32)[-RING_TICKS:])
    assert sorted(name for name in left.columns if name.startswith("objects.")) == ["objects.2", "objects.4"]
    for course, name in ((1, "objects.2"), (2, "objects.4")):
        true = np.array([tick[course] for tick in stood.boxes], np.float32)[-RING_TICKS:]
        np.testing.assert_array_equal(left.columns[name], true)
        assert len(np.unique(true.reshape(RING_TICKS, -1), axis=0)) > 1, "placed anew, or driven on"
    reel = live_reel(run, left.last - 20)
    assert set(reel["objects"]) == {"2", "3", "4"}
    for world_number, told in reel["objects"].items():
        course, own = (1, int(world_number) - 2) if world_number != "4" else (2, 0)
        for tick in range(20):
            _, places = [one for one in told if one[0] <= tick][-1]
            true = stood.boxes[len(stood.boxes) - 20 + tick][course][own]
            np.testing.assert_allclose(places, true, atol=5.1e-4)
    assert len(reel["objects"]["4"]) == 20, "bots drive"
    assert len(reel["objects"]["2"]) < 10, "a box that stands still is told once"
