"""Races of several cars: who wins, who overtakes, who waits; by drivers that follow a line beside the centre."""

import math
from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from tests.worlds.deepracer.training.test_courses import FOUR_CARS

from racecraft.contract.errors import SettingError
from racecraft.evaluation.rating import Result, rate, wilson
from racecraft.training.callbacks import NullCallback
from racecraft.training.worlds import train
from racecraft.worlds.deepracer.env.actions import ActionBox, ActionTable
from racecraft.worlds.deepracer.env.camera import MOUNT_V2, MOUNT_V3
from racecraft.worlds.deepracer.env.race import (
    CRASHED,
    IMMOBILISED,
    OFF_TRACK,
    PARK,
    PAUSE,
    TICK_REPORT,
)
from racecraft.worlds.deepracer.env.race_spec import CAMERA_NAME, CRITIC_NAME
from racecraft.worlds.deepracer.env.sensors import FRONT_CAMERA, car_sensors
from racecraft.worlds.deepracer.env.settings import CameraConfig, RaceConfig
from racecraft.worlds.deepracer.evaluation.head_to_head import (
    DriverResult,
    HeadToHead,
    RaceResult,
    _Field,
    _place,
    race_head_to_head,
    summed,
)
from racecraft.worlds.deepracer.players.driver import Driver, load_driver
from racecraft.worlds.deepracer.tracks.catalogue import load_track
from racecraft.worlds.deepracer.training.plan import RaceRequest

TRACK = load_track("Oval_track")
WHEELBASE_M = 0.164
BOX = ActionBox((-0.52, 0.52), (0.1, 4.0))


class Follower:
    """Drives at one speed so far beside the centre line (share of the half road), by what a critic is told."""

    def __init__(self, speed, beside=0.0, noise=0.0, seed=0):
        self.speed, self.beside, self.noise, self.chance = speed, beside, noise, np.random.default_rng(seed)

    def act(self, observations, action_mask=None):
        told = observations[CRITIC_NAME].astype(float)
        here, ahead = np.arctan2(told[:, 1], told[:, 2]), np.arctan2(told[:, 7], told[:, 8])  # half a metre on
        bend = np.arctan(WHEELBASE_M * (ahead - here) / 0.5)
        steering = bend + 0.5 * here - 0.15 * (told[:, 0] - self.beside)
        speed = self.speed * np.exp(self.noise * self.chance.normal(size=len(told)))
        return np.column_stack([np.clip(steering, -0.52, 0.52), speed])

    def reset_state(self, rows):
        pass


def driver(name, speed, beside=0.0, **options):
    policy = Follower(speed, beside, options.pop("noise", 0.0), options.pop("seed", 0))
    return replace(Driver(name, policy, BOX, "kinematic", CameraConfig(8, 6), MOUNT_V3, FRONT_CAMERA), **options)


def race(*drivers, config=None, **rules):
    rules.setdefault("laps", 1)
    return race_head_to_head(drivers, TRACK, HeadToHead(**rules), config)


def test_a_policy_is_level_with_its_mirror():
    """Its own twin wins about half of 100 races."""
    result = race(*(driver(name, 1.5, noise=0.3, seed=seed) for seed, name in enumerate("ab")), races=100)
    wins = sum(a.place < b.place for a, b in result.races)
    draws = sum(a.place == b.place for a, b in result.races)
    low, high = wilson(wins + draws / 2, 100)
    assert low < 0.5 < high
    assert draws < 50
    a, b = rate(2, [Result((0, 1), (one.place, other.place)) for one, other in result.races])
    assert a.low < b.high
    assert b.low < a.high
    fronts = sum(one.place == 1 for pair in result.races for one in pair if one.grid == 1)
    assert fronts > 70, "in one lane the front place is worth much: only taking turns makes the race fair"


def test_a_trained_network_is_level_with_itself(tmp_path):
    """The same weights in both cars: with seats changed, a race is its own mirror image, and nobody has won more."""
    asked = RaceRequest(run=tmp_path / "run", stops=("iterations=2",), overrides=FOUR_CARS)
    trained = train(asked, NullCallback(), lambda text: None)
    drivers = [replace(load_driver(f"{trained.run.path}:last"), name=name) for name in "ab"]
    rules = HeadToHead(laps=1, races=20, max_resets=2)
    races = race_head_to_head(drivers, load_track("reinvent_base"), rules).races
    for (a, b), (a_behind, b_before) in zip(races[::2], races[1::2], strict=True):
        assert [replace(one, driver="") for one in (a, b)] == [replace(one, driver="") for one in (b_before, a_behind)]
    assert len({(a.laps, b.laps, a.seconds, b.seconds) for a, b in races[::2]}) > 1, "from other places they differ"
    a, b = rate(2, [Result((0, 1), (one.place, other.place)) for one, other in races])
    assert a.points == pytest.approx(b.points, abs=1.0)


def test_a_faster_car_in_the_other_lane_overtakes_once_and_wins():
    result = race(driver("slow", 1.0, -0.5), driver("fast", 2.0, 0.5))
    for grid, (slow, fast) in enumerate(result.races):
        assert (slow.grid, fast.grid) == ((1, 2), (2, 1))[grid]
        assert (slow.place, fast.place) == (2, 1)
        assert fast.overtakes == slow.overtaken == (fast.grid == 2)
        assert slow.overtakes == fast.crashes == slow.crashes == fast.off_tracks == 0
        assert slow.ended == fast.ended == "finished"
        assert slow.laps == fast.laps == 1.0
        assert slow.seconds == pytest.approx(2 * fast.seconds, rel=0.12)  # lanes differ in length
    inner = TRACK.length - 2 * math.pi * 0.5 * 0.305  # half of a half road of 0.609 m nearer to the middle
    assert result.of(1)[0].seconds == pytest.approx(inner / 2.0, rel=0.05)


def test_who_runs_into_another_waits_and_who_was_hit_drives_on():
    lone = race(driver("slow", 1.0, 0.0), driver("fast", 2.0, 0.0)).races[1]  # the fast one is away at once
    slow, fast = race(driver("slow", 1.0, 0.0), driver("fast", 2.0, 0.0), races=1).races[0]
    assert (slow.grid, fast.grid) == (1, 2)
    assert fast.crashes == slow.was_hit >= 1
    assert slow.crashes == fast.was_hit == 0
    assert slow.seconds == pytest.approx(lone[0].seconds, rel=0.1)
    assert fast.seconds > 5.0 * fast.crashes
    free = race(driver("slow", 1.0, 0.0), driver("fast", 2.0, 0.0), races=1, collision_penalty=0.0).races[0]
    assert free[1].crashes > fast.crashes, "who does not wait runs into it again"


def test_of_three_cars_the_one_that_was_run_into_is_told():
    away, slow, fast = race(
        driver("away", 3.0, 0.5), driver("slow", 1.0, 0.0), driver("fast", 2.0, 0.0), races=1
    ).races[0]
    assert fast.crashes == slow.was_hit >= 1
    assert away.was_hit == away.crashes == 0


def test_a_car_that_ran_into_another_waits_where_it_is_and_its_clocks_of_mishaps_begin_anew():
    field = _Field([driver(name, 1.0) for name in "ab"], TRACK, HeadToHead(collision_penalty=2.0), RaceConfig())
    field.place_on_grid(0)
    car = field._world.cars[0, :1].copy()
    car["backward_ticks"], car["still_ticks"], car["speed"] = 7, 5, 2.0
    waits = field._set_back(0, car, CRASHED)
    assert (waits["x"], waits["y"], waits["yaw"]) == (car["x"], car["y"], car["yaw"])
    assert (waits["backward_ticks"], waits["still_ticks"], waits["speed"], waits["held"]) == (0, 0, 0.0, 30)
    assert waits["ticks"] == car["ticks"] + 1
    assert field._set_back(0, car, IMMOBILISED)["held"] == 0, "standing still costs nothing more"
    car["start_share"], car["progress"], car["last_progress"] = 0.1, 30.0, 20.0
    back = field._set_back(0, car, OFF_TRACK)
    assert back["arc"] / TRACK.length == pytest.approx(0.3, abs=0.02), "where it was a tick before"
    assert back["held"] == 75


def test_penalties_are_waited_in_simulated_time():
    result = race(driver("slow", 1.0, 0.0), driver("fast", 2.0, 0.0), races=1, collision_penalty=4.0)
    fast, status = result.races[0][1], result.ticks[0]["status"][:, 1]
    assert (status == PAUSE).sum() == 60 * fast.crashes > 0
    assert fast.seconds == pytest.approx((status != PARK).sum() / 15)


def test_ahead_is_who_is_a_whole_car_further():
    field = _Field([driver(name, 1.0) for name in "ab"], TRACK, HeadToHead(races=1), RaceConfig())
    for further, told in ((0.30, 0), (0.34, 1)):  # a car is 0.324 m long
        field._driven = np.array([[5.0, 5.0 + further]])
        assert field._ahead()[0].tolist() == [[0, -told], [told, 0]]


def test_to_pass_a_car_that_waits_is_no_overtaking():
    blind, calm = driver("blind", 1.0), driver("calm", 1.0, 0.0)
    blind.policy.act = lambda seen, mask=None: np.tile([0.4, 1.0], (len(seen[CRITIC_NAME]), 1))
    waits, passes = race(blind, calm, races=1, max_resets=1, off_track_penalty=60.0).races[0]
    assert (waits.grid, passes.grid) == (1, 2)
    assert passes.ended == "finished"
    assert passes.seconds < 60.0, "it was past while the other one waited"
    assert (passes.overtakes, waits.overtaken) == (0, 0)


def test_a_race_ends_with_the_first_or_with_the_last():
    slow, fast = race(driver("slow", 1.0, -0.5), driver("fast", 2.0, 0.5), done_condition="any").races[0]
    assert fast.ended == "finished"
    assert slow.ended == "not_finished"
    assert slow.laps == pytest.approx(0.5, abs=0.05)
    assert slow.seconds is None


def test_a_car_without_resets_left_is_out_and_out_of_the_way():
    blind, calm = driver("blind", 1.0), driver("calm", 1.0, 0.0)
    blind.policy.act = lambda seen, mask=None: np.tile([0.4, 1.0], (len(seen[CRITIC_NAME]), 1))
    lost, won = race(blind, calm, max_resets=2, off_track_penalty=1.0).races[0]
    assert lost.ended == "retired"
    assert lost.off_tracks == 3
    assert lost.place == 2
    assert won.ended == "finished"
    assert won.crashes == 0


def test_every_driver_sees_and_is_told_in_its_own_way():
    """One by a table and a frame of 20 x 15 of version 2, one by ranges, two eyes and a LiDAR, beside a third car."""
    seen = {}

    def table(observations, mask=None):
        seen["table"] = {name: part.shape[1:] for name, part in observations.items()}
        return np.full(len(observations[CAMERA_NAME]), 1)

    def eyes(observations, mask=None):
        seen["eyes"] = {name: part.shape[1:] for name, part in observations.items()}
        return np.tile([0.0, 0.5], (len(observations["STEREO_CAMERAS"]), 1))

    actions = ActionTable.of([(0.0, 0.5), (math.radians(20), 1.0)])
    first = driver("first", 1.0, 0.0)
    one = driver("one", 1.0, actions=actions, frame=CameraConfig(20, 15), mount=MOUNT_V2, car="v4")
    two = driver("two", 1.0, sensors=car_sensors(("STEREO_CAMERAS", "SECTOR_LIDAR"), None))
    one.policy.act, two.policy.act = table, eyes
    result = race(first, one, two, max_resets=0)
    assert seen == {"table": {CAMERA_NAME: (15, 20)}, "eyes": {"STEREO_CAMERAS": (6, 8, 2), "SECTOR_LIDAR": (8,)}}
    told = result.ticks[0][1]
    assert told["action"].tolist() == [-1, 1, -1]
    assert told["steering"][1] == pytest.approx(math.radians(20))
    assert told["speed"].tolist() == [1.0, 1.0, 0.5]


def test_ticks_of_every_race_are_kept_in_the_order_of_the_drivers(monkeypatch):
    monkeypatch.setattr("racecraft.worlds.deepracer.evaluation.head_to_head.KEPT_RACES", 2)
    result = race(driver("slow", 0.8), driver("fast", 1.6), races=3)
    assert len(result.ticks) == 2
    for ticks, (slow, fast) in zip(result.ticks, result.races, strict=False):
        assert ticks["speed"][1].tolist() == [pytest.approx(0.8), pytest.approx(1.6)], "whoever stands in front"
        assert len(ticks) == pytest.approx(15 * max(slow.seconds, fast.seconds), abs=1)


def test_of_three_cars_every_race_tells_in_the_order_of_the_drivers():
    names = ["a", "b", "c"]
    result = race(*(driver(name, 1.0) for name in names), config=RaceConfig(max_episode_seconds=1.0))
    assert [[one.driver for one in row] for row in result.races] == [names] * 3
    assert [[one.grid for one in row] for row in result.races] == [[1, 2, 3], [3, 1, 2], [2, 3, 1]]


def test_eight_cars_race_and_nine_are_refused():
    result = race(*(driver(f"car {k}", 1.0 + 0.1 * k, 0.5 if k % 2 else -0.5) for k in range(8)), races=1)
    assert sorted(one.grid for one in result.races[0]) == list(range(1, 9))
    assert all(one.ended == "finished" for one in result.races[0])
    assert [one.place for one in sorted(result.races[0], key=lambda one: one.seconds)] == sorted(
        one.place for one in result.races[0]
    )
    with pytest.raises(SettingError, match="9 cars were named for one race; expected 2 to 8"):
        race(*(driver(str(k), 1.0) for k in range(9)))
    with pytest.raises(SettingError, match="1 cars"):
        race(driver("alone", 1.0))


@pytest.mark.parametrize(
    ("rules", "said"),
    [
        ({"laps": 0}, "laps is 0; expected 1 to 1000"),
        ({"races": 0}, "races is 0; expected 1 to 10000"),
        ({"max_resets": -1}, "max_resets is -1; expected 0"),
        ({"done_condition": "some"}, "done_condition is 'some'. Known: any, all"),
    ],
)
def test_what_no_race_can_be_is_named(rules, said):
    with pytest.raises(SettingError, match=said):
        HeadToHead(**rules)


def test_a_race_of_which_nothing_is_said_is_that_of_deepracer_for_cloud():
    assert HeadToHead() == HeadToHead(3, None, "all", max_resets=100, off_track_penalty=5.0, collision_penalty=5.0)


def test_what_drivers_came_to_is_summed_by_hand():
    one = (
        DriverResult("a", 1, 1, 30.5, 3.0, "finished", 1, 0, 0, 1, 0),
        DriverResult("a", 2, 2, None, 1.25, "retired", 0, 1, 2, 0, 5),
        DriverResult("a", 1, 1, 31.25, 3.0, "finished", 1, 1, 0, 0, 0),
    )  # fmt: skip
    other = (
        DriverResult("b", 2, 2, None, 0.5, "time_up", 0, 1, 1, 0, 3),
        DriverResult("b", 1, 1, None, 2.0, "retired", 1, 0, 0, 2, 1),
        DriverResult("b", 2, 2, None, 2.5, "not_finished", 1, 1, 0, 0, 0),
    )  # fmt: skip
    result = RaceResult(("a", "b"), tuple(zip(one, other, strict=True)), ())
    assert (result.of(0), result.of(1)) == ([*one], [*other])
    assert result.overtakes_per_race == pytest.approx(4 / 3)
    told = result.as_dictionary()
    assert told["overtakes_per_race"] == 1.333
    assert told["races"][1][0] == vars(one[1])
    assert told["drivers"] == [
        {
            "driver": "a", "races": 3, "wins": 2, "mean_place": 1.333, "finishes": 2, "mean_seconds": 30.875,
            "overtakes": 2, "overtaken": 2, "crashes": 2, "was_hit": 1, "off_tracks": 5, "overtakes_per_race": 0.667,
        },
        {
            "driver": "b", "races": 3, "wins": 1, "mean_place": 1.667, "finishes": 0, "mean_seconds": None,
            "overtakes": 2, "overtaken": 2, "crashes": 1, "was_hit": 2, "off_tracks": 4, "overtakes_per_race": 0.667,
        },
    ]  # fmt: skip
    assert summed("b", other)["mean_seconds"] is None


def test_who_finished_stands_by_time_before_who_did_not_by_way_and_equals_share_a_place():
    row = [
        DriverResult("a", 1, seconds=10.0, laps=1.0), DriverResult("b", 2, laps=2.5),
        DriverResult("c", 3, seconds=9.0, laps=1.0),
        DriverResult("d", 4, laps=2.5), DriverResult("e", 5, laps=0.3), DriverResult("f", 6, seconds=9.0, laps=1.0),
    ]  # fmt: skip
    _place(row)
    assert [one.place for one in row] == [3, 4, 1, 4, 6, 1]


def test_to_overtake_is_to_be_a_car_behind_and_then_a_car_ahead():
    """Car 1 stands 0.75 m behind car 0; both cross the start line of the lap of 10 m."""
    field = _Field([driver(name, 1.0) for name in "ab"], TRACK, HeadToHead(races=1), RaceConfig())
    field._world = SimpleNamespace(track=SimpleNamespace(length=10.0))
    field._arcs, field._driven = np.array([[9.5, 8.75]]), np.array([[0.0, -0.75]])
    field._order = field._ahead()
    assert field._order[0].tolist() == [[0, 1], [-1, 0]]
    told = []
    for arcs in ((9.75, 9.5), (0.0, 0.0), (0.1, 0.6), (0.2, 0.9), (0.3, 0.5), (1.5, 0.6)):
        reports = np.zeros((1, 2), TICK_REPORT)
        reports["arc"] = arcs
        field._count_overtakes(reports)
        first, second = field._shown[0]
        told.append((first.overtakes, first.overtaken, second.overtakes, second.overtaken))
    # Beside each other nothing is decided; past it once; falling back to its side, nothing; past it in turn.
    assert told == [(0, 0, 0, 0), (0, 0, 0, 0), (0, 1, 1, 0), (0, 1, 1, 0), (0, 1, 1, 0), (1, 1, 1, 1)]
    assert field._driven[0] == pytest.approx([2.0, 1.1])


@pytest.mark.parametrize(
    ("races", "shares"),
    [(None, [0, 0]), (3, [0, 0, 1 / 2]), (6, [0, 0, 1 / 3, 1 / 3, 2 / 3, 2 / 3])],
)
def test_places_on_the_grid_change_and_after_a_round_the_grid_moves_round_the_track(races, shares):
    rules = HeadToHead(races=races, laps=4, max_resets=7)
    field = _Field([driver(name, 1.0) for name in "ab"], TRACK, rules, RaceConfig(change_start=True))
    assert field.whose.tolist() == ([[0, 1], [1, 0]] * 3)[: len(shares)]
    assert field._world.start_shares == pytest.approx(shares)
    assert [[one.grid for one in row] for row in field._shown] == [[1, 2]] * len(shares)
    assert [[one.driver for one in row] for row in field._shown] == ([["a", "b"], ["b", "a"]] * 3)[: len(shares)]
    assert (field._resets_left == 7).all()
    assert not field.is_over
