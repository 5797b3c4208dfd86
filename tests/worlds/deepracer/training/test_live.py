"""Live ticks: nothing is written that nobody wished for, and what is written is what was driven."""

import os
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from racecraft.formats.episodes import STATUSES
from racecraft.formats.live_ticks import LIVE_SECONDS, WISH_SECONDS, read_live_ticks, request_ticks
from racecraft.formats.run_folder import RunFolder
from racecraft.worlds.deepracer.analysis.watching.playback import live_playback
from racecraft.worlds.deepracer.training import live
from racecraft.worlds.deepracer.training.live import RING_TICKS, LivePublisher

sys.path.append(str(Path(__file__).resolve().parents[3]))
from kept_run import drive, make_courses, make_world  # noqa: E402


@pytest.fixture
def run(tmp_path):
    return RunFolder.create(tmp_path / "r", {"kind": "deepracer"})


@pytest.fixture
def at_once(monkeypatch):
    """Look for a wish at every tick."""
    monkeypatch.setattr(live, "LOOK_SECONDS", 0.0)


@pytest.fixture
def clock(monkeypatch):
    """The publisher's clock, which goes a tick's time at every look: `[now, a tick]`, s."""
    told = [100.0, 0.001]

    class Clock:
        @staticmethod
        def monotonic():
            told[0] += told[1]
            return told[0]

    monkeypatch.setattr(live, "time", Clock)
    return told


def wish(run, before=0.0):
    """Wish for ticks so many seconds ago; no two wishes fall on one moment."""
    request_ticks(run)
    moment = time.time_ns() - int(before * 1e9)
    os.utime(run.watched, ns=(moment, moment))


class Seen:
    def __init__(self):
        self.x, self.status, self.rewards = [], [], []

    def __call__(self, world, buffers, actions):
        self.x.append(world.reports["front_x"].reshape(-1).copy())
        self.status.append(world.reports["status"].reshape(-1).copy())


def test_nothing_is_written_when_nobody_watches(run, at_once):
    before = sorted(path.name for path in run.path.iterdir())
    drive(make_world(), RING_TICKS + 9, [LivePublisher(run)])
    assert sorted(path.name for path in run.path.iterdir()) == before


def test_a_wish_is_answered_by_the_ticks_that_follow_it(run, at_once):
    world, seen, publisher = make_world(2, 2), Seen(), LivePublisher(run)
    buffers = drive(world, 9, [publisher, seen])
    wish(run)
    drive(world, RING_TICKS + 37, [publisher, seen], 1, buffers)
    left = read_live_ticks(run)
    assert left.last == 10 + RING_TICKS, "the tenth tick is only looked at"
    assert left.columns["x_m"].shape == (RING_TICKS, 4)
    np.testing.assert_array_equal(left.columns["x_m"], np.array(seen.x, np.float32)[10 : 10 + RING_TICKS])
    from racecraft.worlds.deepracer.env.race import STATUSES as OF_RACE

    words = np.array(OF_RACE)[np.array(seen.status)[10 : 10 + RING_TICKS]]
    np.testing.assert_array_equal(np.array(STATUSES)[left.columns["status"]], words)
    assert (words != "in_progress").any(), "some of these cars left the road"


def test_nobody_is_answered_who_wished_long_ago(run, at_once):
    wish(run, WISH_SECONDS + 0.5)
    drive(make_world(), RING_TICKS + 5, [LivePublisher(run)])
    assert read_live_ticks(run) is None


def test_a_slow_training_leaves_what_it_has_and_a_reader_who_wishes_on_gets_every_tick(run, clock):
    """Ten ticks a second: a part a second, and no gap while somebody wants more."""
    clock[1] = 0.1
    world, publisher, buffers, after, told, lengths = make_world(), LivePublisher(run), None, 0, [], []
    wish(run)
    for tick in range(200):
        buffers = drive(world, 1, [publisher], tick, buffers)
        reel = live_playback(run, after)
        if reel is None:
            wish(run)
            continue
        assert reel["first"] == max(after, 1) + 1, "the first tick is only looked at"
        told += reel["cars"][0]["tick"]
        lengths.append(reel["ticks"])
        after = reel["last"]
    assert after >= 190
    assert max(lengths) <= 12
    assert all(b == a + 1 or b == 1 for a, b in zip(told, told[1:], strict=False))
    drive(world, 200, [publisher], 200, buffers)
    assert read_live_ticks(run).last <= 200 + 12 + RING_TICKS


def test_old_ticks_are_not_live_and_a_training_that_goes_on_leaves_none_of_the_earlier(run, at_once, monkeypatch):
    wish(run)
    drive(make_world(), RING_TICKS + 1, [LivePublisher(run)])
    last = read_live_ticks(run).last
    assert live_playback(run, 0)["ticks"] == RING_TICKS
    assert live_playback(run, last) is None
    assert live_playback(run, last + 1000)["ticks"] == RING_TICKS, "a reader of the training before this one"
    now = time.time()
    with monkeypatch.context() as later:
        later.setattr(time, "time", lambda: now + LIVE_SECONDS + 1)
        assert live_playback(run, 0) is None
    LivePublisher(run)
    assert read_live_ticks(run) is None


def test_a_damaged_file_shows_nothing(run, at_once):
    wish(run)
    drive(make_world(), RING_TICKS + 1, [LivePublisher(run)])
    data = run.live.read_bytes()
    for damaged in (b"", data[: len(data) // 2], b"\0" * 64, b"{}"):
        run.live.write_bytes(damaged)
        assert read_live_ticks(run) is None


def test_a_full_disk_costs_the_training_nothing(run, at_once, monkeypatch):
    wish(run)

    def full(self, data):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(Path, "write_bytes", full)
    drive(make_world(), RING_TICKS + 1, [LivePublisher(run)])
    assert read_live_ticks(run) is None


class Stood:
    """Where objects were in each tick, course by course."""

    def __init__(self):
        self.boxes, self.x = [], []

    def __call__(self, world, buffers, actions):
        self.boxes.append([course.seen_boxes[..., :3].copy() for course in world.courses])
        self.x.append(world.reports["front_x"].reshape(-1).copy())


def test_cars_of_every_course_are_left_and_boxes_and_bots_stand_where_they_stood(run, at_once):
    wish(run)
    world, stood = make_courses(), Stood()
    drive(world, RING_TICKS + 1, [LivePublisher(run), stood])
    left = read_live_ticks(run)
    np.testing.assert_array_equal(left.columns["x_m"], np.array(stood.x, np.float32)[-RING_TICKS:])
    assert sorted(name for name in left.columns if name.startswith("objects.")) == ["objects.2", "objects.4"]
    for course, name in ((1, "objects.2"), (2, "objects.4")):
        true = np.array([tick[course] for tick in stood.boxes], np.float32)[-RING_TICKS:]
        np.testing.assert_array_equal(left.columns[name], true)
        assert len(np.unique(true.reshape(RING_TICKS, -1), axis=0)) > 1, "placed anew, or driven on"
    reel = live_playback(run, left.last - 20)
    assert set(reel["objects"]) == {"2", "3", "4"}
    for world_number, told in reel["objects"].items():
        course, own = (1, int(world_number) - 2) if world_number != "4" else (2, 0)
        for tick in range(20):
            _, places = [one for one in told if one[0] <= tick][-1]
            true = stood.boxes[len(stood.boxes) - 20 + tick][course][own]
            np.testing.assert_allclose(places, true, atol=5.1e-4)
    assert len(reel["objects"]["4"]) == 20, "bots drive"
    assert len(reel["objects"]["2"]) < 10, "a box that stands still is told once"
