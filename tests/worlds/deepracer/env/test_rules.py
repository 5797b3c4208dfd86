"""Rules of a race made definite: how long, from where, and how many abreast; numbers by hand."""

import numpy as np
import pytest

from racecraft.contract.errors import ContractError, SettingError
from racecraft.worlds.deepracer.env import race
from racecraft.worlds.deepracer.env.actions import ActionTable
from racecraft.worlds.deepracer.env.race_spec import CRITIC_NAME, with_objects_in_critic, world_spec
from racecraft.worlds.deepracer.env.rules import first_starts, most_ticks, require_grid, rules_of
from racecraft.worlds.deepracer.env.settings import CameraConfig, RaceConfig
from racecraft.worlds.deepracer.env.vehicle import PROFILES
from racecraft.worlds.deepracer.tracks.track import Track


def straight(length):
    x = np.array([0.0, 1.0, length])
    return Track.from_rows("straight", np.column_stack([x, 0 * x, x, 0 * x + 0.5, x, 0 * x - 0.5]))


def square_of(length):
    corners = np.array([(0, -1), (1, -1), (1, 1), (-1, 1), (-1, -1), (0, -1)]) / 2
    return Track.from_rows(
        "square", np.hstack([corners * side for side in (length / 4, length / 4 - 1, length / 4 + 1)])
    )


def square(reverse=False):
    """A road round a square of 20 m, counter-clockwise, or the other way."""
    track = square_of(20.0)
    return track.reversed() if reverse else track


@pytest.mark.parametrize(
    ("config", "length", "laps", "ticks"),
    [
        ({}, 20.0, 1, 1500),  # 100 s
        ({}, 20.0, 3, 4500),
        ({}, 60.0, 1, 2250),  # at 0.4 m/s it takes 150 s
        ({}, 60.0, 2, 4500),
        ({"max_episode_seconds": 4.0}, 60.0, 1, 60),
        ({"max_episode_seconds": 4.0}, 60.0, 3, 180),
        ({"fidelity": "aws"}, 60.0, 3, 100_000),
        ({"fidelity": "aws", "max_episode_seconds": 4.0}, 60.0, 1, 60),
    ],
)
def test_an_episode_has_so_many_ticks(config, length, laps, ticks):
    assert most_ticks(RaceConfig(**config), length, laps) == ticks
    assert rules_of(RaceConfig(**config), square_of(length), laps, 0.0).max_ticks == ticks


@pytest.mark.parametrize(("seconds", "ticks"), [(0.0, 2), (0.1, 2), (0.2, 3), (1.0, 15), (10.04, 151)])
def test_seconds_are_whole_ticks_and_two_at_least(seconds, ticks):
    assert race.max_ticks(seconds) == ticks


def test_rules_are_those_of_the_settings_and_of_the_fidelity():
    """The original's steps stray by 8.5 %, its wheels by 1.1 degrees (facts)."""
    sane = rules_of(RaceConfig(start_advance=0.2), square(), 2, 1.5)
    assert sane == race.Rules(3000, 2, 0.2, start_ahead=1.5)
    aws = rules_of(RaceConfig(start_advance=0.2, change_start=False, fidelity="aws"), square(), 1, 0.0)
    assert (aws.start_advance, aws.cut_ends, aws.keeps_wheels, aws.start_ahead) == (0.0, True, True, 0.0)
    assert (aws.jitter, np.degrees(aws.wheel_kick)) == pytest.approx((0.085, 1.1))
    assert race.Rules(30, 1, 0.0) == race.Rules(30, 1, 0.0, False, 0.0, 0.0, False, 0.0)


def test_starts_are_spread_evenly_where_nobody_says():
    assert first_starts(square(), None, 4).tolist() == [0.0, 0.25, 0.5, 0.75]
    assert first_starts(square(), [0.3, 0.1], 2).tolist() == [0.3, 0.1]
    for wrong in ([0.3], [0.1, 0.2, 0.3], [[0.1, 0.2]]):
        with pytest.raises(ContractError, match="expected \\(2,\\)"):
            first_starts(square(), wrong, 2)


def test_a_grid_may_be_just_as_long_as_the_lap():
    require_grid(straight(3.0), 4)
    with pytest.raises(SettingError, match="expected at most 3 cars"):
        require_grid(straight(2.99), 4)


@pytest.mark.parametrize(("reverse", "left"), [(False, [-0.5, 0.5, -0.5]), (True, [0.5, -0.5, 0.5])])
def test_cars_line_up_in_two_lanes_three_quarters_of_a_metre_behind_one_another(reverse, left):
    """0.75 m of 20 m are 3.75 %; who would stand before the line stands at the end of the lap."""
    cars = race.new_cars(square(reverse), 3, np.array([0.0, 0.5]))
    assert cars["start_share"] == pytest.approx(np.array([[0.0, 0.9625, 0.925], [0.5, 0.4625, 0.425]]))
    assert np.sign(cars["start_left"]).tolist() == [np.sign(left).tolist()] * 2
    assert np.abs(cars["start_left"]).tolist() == [[race.START_LANE] * 3] * 2
    assert cars.dtype == race.CAR_STATE
    others = [name for name in cars.dtype.names if name not in ("start_share", "start_left")]
    assert not any(cars[name].any() for name in others)


def test_a_car_alone_starts_on_the_centre_line_and_on_an_open_road_the_last_stands_at_the_line():
    assert race.new_cars(square(), 1, np.array([0.25]))[["start_share", "start_left"]].tolist() == [[(0.25, 0.0)]]
    cars = race.new_cars(straight(15.0), 3, np.array([0.0]))
    assert cars["start_share"] == pytest.approx(np.array([[0.1, 0.05, 0.0]]))


def test_profiles_become_records():
    records = race.car_profiles([PROFILES["v4"], PROFILES["kinematic"]])
    assert (records.shape, records.dtype) == ((2,), race.PROFILE)
    assert tuple(records[0]) == tuple(PROFILES["v4"])


def test_a_race_is_judged_by_the_numbers_of_the_original():
    """simapp: `reset/rules`, NUMBER_OF_REVERSE_COUNTS, START_POS_OFFSET; lanes and objects near a start: facts 5.4."""
    assert (race.IMMOBILISED_TICKS, race.IMMOBILISED_M, race.REVERSED_TICKS) == (15, 0.0003, 15)
    assert (race.START_GAP_M, race.START_LANE, race.START_OBJECT_M) == (0.75, 0.5, 1.0)


def test_a_critic_is_told_of_the_road_two_metres_ahead_and_of_two_objects_three_metres_ahead():
    """Five numbers of the car, a sine and a cosine at each of six places; two numbers of each object."""
    assert race.CRITIC_LOOKS_AHEAD_M == (0.25, 0.5, 0.75, 1.0, 1.5, 2.0)
    assert (race.CRITIC_NUMBERS, race.CRITIC_OBJECT_NUMBERS) == (17, 4)
    assert (race.CRITIC_OBJECT_REACH_M, race.CRITIC_OBJECT_BEHIND_M) == (3.0, 0.4)
    for has_objects, numbers in ((False, 17), (True, 21)):
        spec = world_spec(ActionTable((0.0,), (1.0,)), CameraConfig(16, 12), has_objects=has_objects)
        assert spec.observations[CRITIC_NAME].shape == (numbers,)
        assert spec.observations[CRITIC_NAME].privileged
        assert (spec.num_worlds, spec.num_agents, spec.tick_seconds) == (1, 1, 1 / 15)
        assert with_objects_in_critic(spec).observations[CRITIC_NAME].shape == (21,)
    assert world_spec(ActionTable((0.0,), (1.0,)), CameraConfig(16, 12)).observations[CRITIC_NAME].shape == (17,)
