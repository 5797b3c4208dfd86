"""Old laps are paid again with the parameters that the simulator would have given."""

import numpy as np
import polars as pl
import pytest

from racecraft.contract.errors import UserInputError
from racecraft.worlds.deepracer.driving.reward.lines_paid import lines_paid
from racecraft.worlds.deepracer.driving.reward.paying import Payer
from racecraft.worlds.deepracer.driving.reward.rescore import rescore, rows_of
from racecraft.worlds.deepracer.driving.reward.stock import read_stock
from racecraft.worlds.deepracer.env.reward_process import open_reward
from racecraft.worlds.deepracer.files.reward_samples import read_sample


@pytest.fixture
def payer(tmp_path):
    def opened(text):
        path = tmp_path / "reward_function.py"
        path.write_text(text)
        return Payer(open_reward(path))

    return opened


def as_log(drives, rewards=1.0):
    """Return drives of the stock as a table of ticks, each preceded by the row that holds the car."""
    frames = []
    for number, drive in enumerate(drives):
        rows = np.concatenate([drive.reports[:1], drive.reports])
        held = np.arange(len(rows)) == 0
        frames.append(pl.DataFrame({
            "x_m": rows["front_x"], "y_m": rows["front_y"], "yaw_rad": rows["yaw"], "steering_rad": rows["steering"],
            "speed_mps": rows["speed"], "tick": np.where(held, 1.0, rows["steps"]),
            "time_s": np.arange(len(rows)) / 15.0, "progress_share": rows["progress"] / 100.0,
            "reward": np.where(held, 0.0, rewards),
            "status": ["prepare", *["in_progress"] * (len(rows) - 2), "lap_complete" if drive.is_lap else "off_track"],
            "all_wheels_on_track": rows["all_wheels_on"], "unique_episode": number, "round": 1, "phase": "training",
        }))  # fmt: skip
    return pl.concat(frames)


SQUARE = "def reward_function(params):\n    return params['speed'] ** 2\n"
DRIVES = [drive for drive in read_stock() if drive.track.name == "reinvent_base"]


def test_a_log_earns_what_its_rows_earn_in_a_drive(payer):
    laps = [DRIVES[0], DRIVES[5], DRIVES[-1]]
    reward = payer(read_sample("pace_by_turn"))
    found = rescore(as_log(laps), DRIVES[0].track, reward)
    assert found.failures == ()
    for episode, lap in zip(found.episodes, laps, strict=True):
        assert episode.new == pytest.approx(reward.compute_rewards(lap.track, lap.reports).rewards.sum())
        assert episode.is_lap == lap.is_lap
        assert episode.old == len(lap.rows)
    assert [one.episode for one in found.laps] == [0, 1]


def test_laps_change_places_where_the_rewards_disagree(payer):
    """1 a tick prefers the slow lap; the square of the speed the fast one."""
    found = rescore(as_log([DRIVES[0], DRIVES[10]]), DRIVES[0].track, payer(SQUARE))
    assert [(lap.episode, old, new) for lap, old, new in found.places()] == [(0, 2, 1), (1, 1, 2)]
    assert found.agreement == -1.0
    assert found.time_ranks == (1.0, -1.0)


def test_rows_hold_what_the_world_wrote_down():
    rows, has_reward = rows_of(as_log(DRIVES[:1]), DRIVES[0].track)
    driven = DRIVES[0].reports
    assert has_reward.tolist() == [False, *[True] * len(driven)]
    for name in ("x", "y", "yaw", "arc", "centre_distance", "waypoint_before", "is_left", "all_wheels_on", "progress"):
        assert np.allclose(rows[name][1:], driven[name]), name


def test_a_row_that_fails_is_told_and_the_rest_is_paid(payer):
    found = rescore(
        as_log(DRIVES[:1]), DRIVES[0].track,
        payer("def reward_function(params):\n    return 1.0 if params['steps'] != 9 else params['nothing']\n"),
    )  # fmt: skip
    (failure,) = found.failures
    assert (failure.row, failure.line) == (7, 2)
    assert found.episodes[0].new == len(DRIVES[0].rows) - 1


def test_a_log_without_poses_is_refused():
    with pytest.raises(UserInputError, match="has no x_m"):
        rows_of(as_log(DRIVES[:1]).drop("x_m"), DRIVES[0].track)


def test_the_lines_of_a_row_add_up_to_its_pay(payer):
    reward = payer(
        "def reward_function(params):\n    reward = 1.0\n    if params['speed'] > 1.5:\n        reward += 2.0\n"
        "    reward *= 0.5\n    if params['is_offtrack']:\n        return -7.0\n    return reward\n"
    )
    rows = np.concatenate([drive.reports for drive in (DRIVES[0], DRIVES[-1])])
    found = lines_paid(reward, DRIVES[0].track, rows)
    assert found.variable == "reward"
    paid = {one.line: one.total for one in found.lines}
    fast, off = rows["speed"] > 1.5, rows["is_off"]
    assert paid[2] == (~off).sum()
    assert paid[4] == 2.0 * (fast & ~off).sum()
    assert paid[7] == -7.0 * off.sum()
    assert sum(paid.values()) == pytest.approx(found.total)
    assert all(one.by_part.sum() == pytest.approx(one.total) for one in found.lines)


CLASS = """\
WEIGHT = 0.5
class Reward:
    def speed(self, params):
        return params["speed"]
    def twice(self, value):
        twice = 2 * value
        return twice
    def add(self, amount):
        self.total += amount
    def pay(self, params):
        if params["steps"] < 0:
            return 0.0
        return (WEIGHT * self.speed(params)
                + self.twice(3.0) - 1.0)
    def built_up(self, params):
        self.total = 0.5
        self.add(2.0)
        self.total += self.speed(params)
        return self.total
def reward_function(params):
"""
HALF = "def half(x):\n    y = x / 2\n    return y\ndef reward_function(params):\n"


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        (CLASS + "    return Reward().pay(params)\n", {4: 1.0, 6: 6.0, 13: -1.0}),
        (CLASS + "    return Reward().built_up(params)\n", {16: 0.5, 9: 2.0, 4: 2.0}),
        (HALF + "    a = half(4.0)\n    b = half(6.0)\n    return float(a + 2 * b - half(1.0))\n", {2: 7.5}),
        (HALF + "    p = 1\n    p += half(4)\n    p -= 0.25\n    return max(p, 1e-3)\n", {5: 1.0, 2: 2.0, 7: -0.25}),
        (HALF + "    p = 0\n    for k in range(3):\n        p += half(k)\n    return p\n", {2: 1.5}),
        (HALF + "    p = half(4) * half(6)\n    return p\n", {5: 6.0}),
    ],
)
def test_pay_is_followed_into_functions_and_methods(payer, text, expected):
    rows = DRIVES[0].reports[:1].copy()
    rows["speed"] = 2.0
    found = lines_paid(payer(text), DRIVES[0].track, rows)
    assert {one.line: one.total for one in found.lines} == pytest.approx(expected)
    assert sum(expected.values()) == pytest.approx(found.total)
