"""A drive that is taken up again is the same drive to the bit, and a change is what was changed, nothing else."""

import math

import numpy as np
import pytest

from racecraft.contract.world import allocate
from racecraft.worlds.deepracer.env.actions import ActionTable
from racecraft.worlds.deepracer.env.sensors import car_sensors
from racecraft.worlds.deepracer.env.settings import BotsConfig, BoxesConfig, CameraConfig, RaceConfig
from racecraft.worlds.deepracer.env.world import RaceWorld
from racecraft.worlds.deepracer.evaluation import rerun
from racecraft.worlds.deepracer.evaluation.counterfactuals import Options, Trials, try_alternatives
from racecraft.worlds.deepracer.evaluation.recorded_drives import record_drives
from racecraft.worlds.deepracer.evaluation.rerun import Change, rerun_with_change, states_of
from racecraft.worlds.deepracer.tracks.catalogue import load_track

TRACK = load_track("reinvent_base")
ACTIONS = ActionTable.of([(math.radians(angle), 1.5) for angle in (30, 0, -30)])
LEFT, STRAIGHT, RIGHT = range(3)
SANE = RaceConfig()
RESTLESS = BotsConfig(lane_change=True, lane_change_after_low=0.2, lane_change_after_high=0.6)


def world(count, race=SANE, objects=None, sensors="FRONT_FACING_CAMERA", shares=None):
    return RaceWorld(
        TRACK, ACTIONS, race_config=race, camera_config=CameraConfig(width=16, height=12), num_cars=count,
        start_shares=np.arange(count) / count if shares is None else shares, sensors=car_sensors(sensors.split()),
        objects=objects,
    )  # fmt: skip


class Weaves:
    """Drives by the number of ticks it has seen: a policy that is nothing but memory."""

    def __init__(self, plan=(STRAIGHT, STRAIGHT, LEFT, STRAIGHT, RIGHT)):
        self.plan, self.seen = np.array(plan), np.zeros(0, int)

    def act(self, observations, action_mask=None):
        count = len(next(iter(observations.values())))
        if len(self.seen) != count:
            self.seen = np.zeros(count, int)
        self.seen += 1
        return self.plan[self.seen % len(self.plan)]

    def reset_state(self, rows):
        if len(self.seen) == len(rows):
            self.seen[rows] = 0


KINDS = {
    "plain": {},
    "aws": {"race": RaceConfig(fidelity="aws", max_episode_seconds=20.0)},
    "boxes and LiDAR": {
        "race": RaceConfig(type="OBJECT_AVOIDANCE"), "objects": BoxesConfig(),
        "sensors": "STEREO_CAMERAS LIDAR",
    },
    "bots": {"race": RaceConfig(type="HEAD_TO_BOT"), "objects": RESTLESS},
    "all the original's noise": {
        "race": RaceConfig(type="HEAD_TO_BOT", fidelity="aws", max_episode_seconds=20.0),
        "sensors": "FRONT_FACING_CAMERA SECTOR_LIDAR",
    },
}  # fmt: skip


@pytest.mark.parametrize("kind", KINDS)
def test_a_drive_taken_up_again_is_the_same_to_the_bit(kind):
    """Rows of other ticks and in another order, one world beside the other, drive on as each did alone."""
    drives = record_drives(Weaves(), world(4, **KINDS[kind]), seed=3)
    rows = np.array([2, 0, 3, 3])
    begin = drives.last[rows] - [9, 6, 9, 4]
    again = world(4, **KINDS[kind])
    buffers = allocate(again.spec)
    again.load_state(states_of(drives, begin, rows), buffers)
    for step in range(4):
        again.step(drives.actions[begin + step, rows][:, None], buffers)
        there = drives.reports[begin + step, rows]
        for name in there.dtype.names:
            np.testing.assert_array_equal(again.reports[:, 0][name], there[name], err_msg=name)


def test_no_change_saves_nobody_and_what_a_policy_remembers_comes_along():
    drives = record_drives(Weaves(), world(4))
    assert len(drives.failed) == 4
    same = [Change(int(row), int(drives.last[row] - 20), drives.actions[drives.last[row] - 20, row], 1)
            for row in drives.failed]  # fmt: skip
    assert not rerun_with_change(Weaves(), world, drives, same, remembers=True).any()


class Forks:
    """Steers by its memory: left for good once it has seen so many ticks."""

    def __init__(self, turn_at):
        self.turn_at, self.seen = turn_at, np.zeros(0, int)

    def act(self, observations, action_mask=None):
        count = len(next(iter(observations.values())))
        self.seen = np.zeros(count, int) if len(self.seen) != count else self.seen
        self.seen += 1
        return np.where(self.seen >= self.turn_at, LEFT, STRAIGHT)

    def reset_state(self, rows):
        if len(self.seen) == len(rows):
            self.seen[rows] = 0


def test_a_memory_is_as_old_as_the_episode_at_the_change():
    """Of a policy that turns at its 15th tick: told its own action once at tick 12 it still turns then, not at 27."""
    drives = record_drives(Forks(15), world(1))
    change = [Change(0, 12, drives.actions[12, 0], 1)]
    assert not rerun_with_change(Forks(15), world, drives, change, remembers=True, past_m=0.6).any()
    turned = Change(0, 5, np.int64(LEFT), 40)
    saved = rerun_with_change(Forks(15), world, drives, [turned, *change], remembers=False, past_m=0.6)
    assert saved.tolist() == [False, True], "its own turn comes 12 ticks later, 1.2 m on; answers keep their order"


def test_a_change_is_held_as_long_as_it_says(monkeypatch):
    monkeypatch.setattr(rerun, "AT_ONCE", 1)
    drives = record_drives(Forks(15), world(1))
    changes = [Change(0, 14, np.int64(STRAIGHT), hold) for hold in (1, 12, 1)]
    saved = rerun_with_change(Forks(15), world, drives, changes, remembers=True, past_m=0.6)
    assert saved.tolist() == [False, True, False]


@pytest.mark.parametrize(
    ("saves", "first"),
    [
        ([[1, 0, 0], [0, 0, 0]], [(0, LEFT)]),  # of five failures one is enough where none saves more
        ([[5, 0, 4], [0, 3, 0]], [(0, LEFT), (0, RIGHT), (1, STRAIGHT)]),  # 4 is nearly 5 (a fifth less), 3 is not
        ([[5, 0, 0], [0, 4, 0]], [(1, STRAIGHT), (0, LEFT)]),  # nearly as many, and later
        ([[2, 0, 2], [0, 0, 0]], [(0, RIGHT), (0, LEFT)]),  # as many: what is nearer to what was done
    ],
)
def test_the_latest_of_the_best_changes_comes_first(saves, first):
    """By hand: five failures, changes 9 and 3 ticks before, of three options, held for a tick."""
    saved = np.arange(5)[:, None, None, None] < np.array(saves)[None, :, :, None]
    trials = Trials(np.arange(5), np.array([9, 3]), np.array([1]), Options.of(ACTIONS), saved)
    ranked = trials.ranked(np.tile([math.radians(-20), 1.5], (2, 1)))
    assert [(moment, option) for moment, option, _ in ranked[: len(first)]] == first
    assert trials.best_share.tolist() == [[max(row) / 5] for row in saves]


def test_what_it_did_anyway_is_not_tried():
    drives = record_drives(Forks(15), world(1))
    trials = try_alternatives(Forks(15), world, drives, drives.failed, ACTIONS, remembers=True)
    last = int(drives.last[0])
    done = drives.actions[last - trials.moments, 0]
    assert not trials.saved[0, np.arange(len(done)), done].any()
