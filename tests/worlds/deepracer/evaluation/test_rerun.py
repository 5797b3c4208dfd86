"""A drive that is taken up again is the same drive to the bit, and a change is what was changed, nothing else."""

import math
from types import SimpleNamespace

import numpy as np
import pytest

from racecraft.contract.world import allocate
from racecraft.worlds.deepracer.env import race
from racecraft.worlds.deepracer.env.actions import ActionBox, ActionTable
from racecraft.worlds.deepracer.env.sensors import car_sensors
from racecraft.worlds.deepracer.env.settings import BotsConfig, BoxesConfig, CameraConfig, RaceConfig
from racecraft.worlds.deepracer.env.vehicle import TICKS_PER_SECOND
from racecraft.worlds.deepracer.env.world import RaceWorld
from racecraft.worlds.deepracer.evaluation import counterfactuals, rerun
from racecraft.worlds.deepracer.evaluation.counterfactuals import HOLDS, MOMENTS, Options, Trials, try_alternatives
from racecraft.worlds.deepracer.evaluation.failure_clusters import APART_M, LONGEST_M, cluster_failures
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
    assert rerun_with_change(
        Forks(15), world, drives, change, remembers=False, past_m=0.6
    ).all()  # 12 ticks later, 1.2 m on


def test_a_change_is_held_as_long_as_it_says():
    drives = record_drives(Forks(15), world(1))
    changes = [Change(0, 14, np.int64(STRAIGHT), hold) for hold in (1, 12)]
    saved = rerun_with_change(Forks(15), world, drives, changes, remembers=True, past_m=0.6)
    assert saved.tolist() == [False, True]


def test_options_of_a_table_and_of_ranges():
    assert Options.of(ACTIONS).labels == ("left 30° at 1.5 m/s", "straight at 1.5 m/s", "right 30° at 1.5 m/s")
    grid = Options.of(ActionBox((-0.5, 0.5), (1.0, 3.0)))
    assert grid.actions.shape == (15, 2)
    assert grid.commands[:, 1].min() == 1.0
    assert grid.commands[:, 0].max() == 0.5


def test_changes_are_tried_at_the_moments_that_the_page_names():
    """Eleven, within two seconds of fifteen ticks each; held for a tick, 0.2 and 0.6 s."""
    assert (len(set(MOMENTS)), max(MOMENTS)) == (11, 2 * TICKS_PER_SECOND)
    assert [hold / TICKS_PER_SECOND for hold in HOLDS] == pytest.approx([1 / 15, 0.2, 0.6])


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


def test_nothing_is_tried_in_the_first_tick_which_holds_the_car(monkeypatch):
    tried = []

    def noted(policy, worlds, drives, changes, remembers):
        tried.extend((change.tick, change.hold) for change in changes)
        return [False] * len(changes)

    monkeypatch.setattr(counterfactuals, "rerun_with_change", noted)
    drives = SimpleNamespace(last=np.array([3]), actions=np.full((4, 1), LEFT))
    try_alternatives(Forks(15), world, drives, np.array([0]), ACTIONS)
    ticks = [3 - moment for moment in MOMENTS if moment < 3]
    assert 1 in ticks
    assert sorted(tried) == sorted((tick, hold) for tick in ticks for hold in HOLDS for _ in (STRAIGHT, RIGHT))


def test_what_it_did_anyway_is_not_tried():
    drives = record_drives(Forks(15), world(1))
    trials = try_alternatives(Forks(15), world, drives, drives.failed, ACTIONS, remembers=True)
    last = int(drives.last[0])
    done = drives.actions[last - trials.moments, 0]
    assert not trials.saved[0, np.arange(len(done)), done].any()


def test_places_lie_across_the_start_line_and_are_never_long():
    rng = np.random.default_rng(0)
    for _ in range(50):
        arcs, length = rng.uniform(0, 17.67, 40), 17.67
        places = cluster_failures(arcs, length)
        assert sorted(np.concatenate(places).tolist()) == list(range(40))
        for place in places:
            along = (arcs[place] - arcs[place[0]]) % length
            assert (np.diff(along) >= 0).all()
            assert along[-1] <= LONGEST_M
            assert (np.diff(along) <= APART_M).all()
    assert cluster_failures(np.zeros(0), 10.0) == []
    assert len(cluster_failures(np.array([0.1, 9.9]), 10.0, closed=False)) == 2


class Line:
    """N cars on a road of 10 m: told a number they come so many per cent further; below 0 they are off."""

    made = []

    def __init__(self, count):
        self.count, self.loaded, self.told = count, None, []
        self.spec, self.track = None, SimpleNamespace(length=10.0)
        Line.made.append(self)

    def load_state(self, state, buffers):
        self.progress = state["progress"].copy()
        self.loaded = self.progress.tolist()
        self._show(buffers)

    def _show(self, buffers):
        buffers.observations["progress"] = self.progress.reshape(-1, 1, 1)

    def step(self, actions, buffers):
        assert actions.shape == (self.count, 1)
        self.told.append(actions[:, 0].tolist())
        self.progress = self.progress + actions[:, 0]
        self.reports = np.zeros((self.count, 1), race.TICK_REPORT)
        self.reports["progress"][:, 0] = self.progress
        self.reports["terminated"][:, 0] = (self.progress < 0) | (self.progress >= 100)
        self.reports["status"][:, 0] = np.where(self.progress >= 100, race.LAP_COMPLETE, 0)
        self._show(buffers)


class Same:
    """Says the same number always, and notes whom it is to forget."""

    def __init__(self, says):
        self.says, self.forgot, self.shapes = says, [], set()

    def act(self, observations, action_mask=None):
        self.shapes.add(observations["progress"].shape)
        return np.full(len(observations["progress"]), self.says)

    def reset_state(self, rows):
        self.forgot.append(rows.tolist())


@pytest.fixture
def line(monkeypatch):
    """Three drives of four ticks that failed at 40, 60 and 95 per cent, where they had come by tens."""
    monkeypatch.setattr(rerun, "allocate", lambda spec: SimpleNamespace(observations={}))
    monkeypatch.setattr(Line, "made", [])
    ends = np.array([40.0, 60.0, 95.0])
    endings = np.zeros(3, race.TICK_REPORT)
    endings["progress"] = ends
    before = [{"progress": ends - 10.0 * back} for back in (4, 3, 2, 1)]
    return SimpleNamespace(last=np.full(3, 3), endings=endings, states=before, actions=np.full((4, 3), 10.0))


@pytest.mark.parametrize(
    ("row", "action", "saved"),
    [
        (0, 25.0, True),  # 1.5 m of 10 m further than 40 per cent, at once
        (0, 24.999, False),
        (1, 25.0, True),
        (2, 14.5, False),  # beyond the end of the lap nothing more is asked for, but the lap has to be full
        (2, 15.0, True),
        (0, -31.0, False),  # off the road
    ],
)
def test_a_car_is_past_its_place_a_metre_and_a_half_beyond(line, row, action, saved):
    """It is told otherwise in its last tick, and then stands until nobody waits any longer."""
    assert rerun_with_change(Same(0.0), Line, line, [Change(row, 3, np.float64(action), 1)]).tolist() == [saved]
    assert len(Line.made[0].told) == (1 if saved or action < 0 else 61), "60 ticks after that of the failure"


def test_a_change_is_held_and_then_the_policy_drives_on(line):
    policy = Same(1.0)
    rerun_with_change(policy, Line, line, [Change(0, 1, np.float64(4.0), 2)])
    (world,) = Line.made
    assert world.loaded == [10.0]
    assert [told[0] for told in world.told[:4]] == [4.0, 4.0, 1.0, 1.0]
    assert policy.forgot[0] == [True]
    assert not any(map(any, policy.forgot[1:]))
    assert policy.shapes == {(1, 1)}
    assert len(world.told) == 2 + 37, "from 10 per cent to 18, then one a tick up to 55"


def test_who_remembers_is_driven_from_the_first_tick_as_it_drove(line):
    rerun_with_change(Same(1.0), Line, line, [Change(1, 2, np.float64(-90.0), 3)], remembers=True)
    (world,) = Line.made
    assert world.loaded == [20.0]
    assert [told[0] for told in world.told] == [10.0, 10.0, -90.0], "and the drive ends where it leaves the road"


def test_many_changes_share_worlds_the_short_ones_together(line, monkeypatch):
    monkeypatch.setattr(rerun, "AT_ONCE", 2)
    ticks = [0, 3, 1]
    changes = [Change(0, tick, np.float64(100.0 if tick < 3 else -99.0), 1) for tick in ticks]
    assert rerun_with_change(Same(0.0), Line, line, changes).tolist() == [True, False, True]
    (world,) = Line.made
    assert world.count == 2
    assert world.told[0] == [-99.0, 100.0], "ticks 3 and 1: who begins latest is soonest done"
    assert world.told[1:] == [[100.0, 100.0]], "the last one is driven twice where a place is free"
    assert rerun_with_change(Same(0.0), Line, line, []).tolist() == []
    assert len(Line.made) == 1
