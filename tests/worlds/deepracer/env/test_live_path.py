"""What a training really hears of its cars, held to values from outside: recorded races, plain geometry, the facts.

Each test goes the way that a training goes: commands in, `RaceWorld.step`, and out by the reward function's dictionary
or by the columns of the episode files.
"""

import math

import numpy as np
import pytest

from racecraft.contract.world import allocate
from racecraft.worlds.deepracer.env.actions import ActionTable
from racecraft.worlds.deepracer.env.settings import CameraConfig, RaceConfig
from racecraft.worlds.deepracer.env.vehicle import FRONT_POINT_M
from racecraft.worlds.deepracer.env.world import RaceWorld
from racecraft.worlds.deepracer.tracks.catalogue import load_track
from racecraft.worlds.deepracer.training.recorder import EpisodeRecorder

ACTIONS = ActionTable.of(
    [(math.radians(angle), speed) for angle, speed in ((-30, 1.0), (0, 1.0), (30, 1.0), (45, 5.0))]
)
RIGHT, STRAIGHT, LEFT, BEYOND = range(4)

RECORDED = np.array([
    # X, Y (m), yaw (degrees), start (share of the lap), progress before, progress (%), closest waypoint, all wheels on
    # track, reward; then: wheels on the road, and distance from the centre line over the road's width, by Shapely.
    (6.851205, 0.961722, 34.2085, 0.00, 21.4568, 21.8846, 26, True, 1, 4, 0.07),
    (6.706049, 0.758533, 13.0979, 0.70, 50.1362, 50.5774, 24, True, 1, 4, 0.05),
    (6.160033, 2.742592, 161.3164, 0.15, 21.2743, 21.8262, 43, True, 1, 4, 0.04),
    (0.914150, 2.778829, -84.5654, 0.65, 13.8807, 14.2485, 93, True, 1, 4, 0.07),
    (4.640147, 0.548751, 12.4491, 0.85, 23.5091, 23.9240, 11, True, 0.5, 4, 0.18),
    (4.731139, 2.969252, 149.4186, 0.20, 24.7727, 25.2499, 53, True, 0.5, 4, 0.18),
    (1.255791, 4.259361, -152.7105, 0.30, 38.3324, 38.9929, 81, True, 0.5, 4, 0.19),
    (3.023294, 4.582550, 137.4538, 0.60, 98.3522, 98.6410, 69, True, 0.5, 4, 0.15),
    (4.007883, 3.907985, 114.5369, 0.10, 41.9871, 42.4151, 62, True, 0.1, 4, 0.36),
    (5.031099, 0.457465, -15.0250, 0.05, 5.5343, 6.1315, 13, True, 0.1, 4, 0.30),
    (1.267032, 1.950061, -62.4507, 0.55, 28.5268, 29.2316, 99, True, 0.1, 4, 0.30),
    (4.146402, 3.788960, 93.2079, 0.15, 36.0797, 36.3993, 61, True, 0.1, 4, 0.40),
    (6.276487, 1.044947, 21.7827, 0.55, 62.5997, 63.3305, 22, False, 0.1, 3, 0.46),
    (3.619112, 4.369451, 143.2895, 0.30, 25.2837, 25.8276, 66, False, 0.1, 3, 0.35),
    (1.653433, 4.110555, -158.4315, 0.55, 10.9096, 11.3522, 78, False, 0.1, 3, 0.48),
    (3.711450, 4.416179, 117.5690, 0.35, 20.1454, 20.7051, 66, False, 0.1, 2, 0.48),
    (0.628509, 2.124617, -69.4337, 0.45, 37.0135, 37.5352, 97, False, 0.1, 2, 0.48),
    (1.865995, 1.024710, -26.9023, 0.80, 12.0345, 12.8768, 110, False, 0.1, 2, 0.41),
    (3.496848, 4.726075, 84.6914, 0.45, 11.7808, 12.0146, 67, False, 0.001, 3, 0.60),
    (1.959625, 0.235137, -52.4068, 0.90, 3.7297, 4.0771, 111, False, 0.001, 3, 0.60),
    (1.800904, 0.260404, -64.1306, 0.90, 3.0862, 3.2420, 110, False, 0.001, 3, 0.59),
    (7.371444, 0.810238, 22.1384, 0.05, 17.8353, 18.0795, 27, False, 0.001, 2, 0.55),
    (0.834992, 4.649800, -169.9234, 0.45, 24.4325, 24.5910, 82, False, 0.001, 2, 0.54),
    (1.414686, 4.868874, -171.6177, 0.85, 81.9183, 82.4561, 80, False, 0.001, 2, 0.54),
    (5.671515, 1.199432, 20.0477, 0.50, 64.0155, 64.7473, 17, False, 0.001, 1, 0.68),
    (0.352482, 4.225182, -155.5044, 0.45, 26.9809, 27.0645, 85, False, 0.001, 1, 0.66),
    (4.192011, 2.531995, -162.6379, 0.40, 6.2485, 6.5964, 55, False, 0.001, 1, 0.67),
])  # fmt: skip
"""Rows of a training of the AWS console in 2022 on reinvent_base, spread over rewards and wheels, none of them on the
verge. The reward is the console's own: 1, 0.5, 0.1 within 10, 25, 50 % of the road's width of its middle, else 0.001.
(Source: the console's simulation traces, by way of aws-deepracer-community/deepracer-analysis.)"""


class Listener:
    """A reward function that keeps what it is told and pays what the console's first reward paid."""

    def __init__(self):
        self.told = []

    def __call__(self, params):
        self.told.append(params)
        shares = (0.1, 1.0), (0.25, 0.5), (0.5, 0.1)
        off = params["distance_from_center"] / params["track_width"]
        return next((paid for share, paid in shares if off <= share), 1e-3)


def make_world(reward=None, num_cars=1, **options):
    return RaceWorld(
        load_track("reinvent_base"), ACTIONS, reward, num_cars=num_cars, camera_config=CameraConfig(16, 12), **options
    )


def put(world, buffers, **fields):
    """Line cars up, put them elsewhere and let the prepare tick find where they are."""
    world.reset(buffers, 0)
    state = world.save_state()
    for name, values in fields.items():
        state[f"car.{name}"][:, 0] = values
    world.load_state(state, buffers)
    world.step(np.full((world.spec.num_worlds, 1), STRAIGHT), buffers)


@pytest.fixture(scope="module")
def heard():
    """What a reward function is told where the recorded cars stood, and what it pays."""
    listener = Listener()
    world = make_world(listener, len(RECORDED))
    buffers = allocate(world.spec)
    x, y, yaw, start, before = (
        RECORDED[:, 0],
        RECORDED[:, 1],
        np.radians(RECORDED[:, 2]),
        RECORDED[:, 3],
        RECORDED[:, 4],
    )
    put(
        world, buffers, x=x - FRONT_POINT_M * np.cos(yaw), y=y - FRONT_POINT_M * np.sin(yaw), yaw=yaw,
        start_share=start, progress=before,
    )  # fmt: skip
    assert not listener.told, "nobody is called while preparing"
    world.step(np.full((len(RECORDED), 1), LEFT), buffers)
    return listener.told, buffers.reward[:, 0].copy()


def test_place_heading_and_command_are_those_of_the_log(heard):
    told, _ = heard
    for name, column in (("x", 0), ("y", 1), ("heading", 2)):
        np.testing.assert_allclose([params[name] for params in told], RECORDED[:, column], atol=1e-6, err_msg=name)
    assert {(params["steering_angle"], params["speed"], params["steps"]) for params in told} == {(30.0, 1.0, 2.0)}


def test_progress_and_waypoints_are_those_of_the_log(heard):
    told, _ = heard
    np.testing.assert_allclose([params["progress"] for params in told], RECORDED[:, 5], atol=0.03)
    for params, nearest in zip(told, RECORDED[:, 6], strict=True):
        before, after = params["closest_waypoints"]
        assert nearest in (before, after)
        assert after - before in (1, -118)


def test_wheels_on_the_track_are_those_of_the_log(heard):
    told, _ = heard
    assert [params["all_wheels_on_track"] for params in told] == RECORDED[:, 7].astype(bool).tolist()
    assert set(RECORDED[:, 9]) == {1, 2, 3, 4}, "one wheel off is enough"
    assert not any(params["is_offtrack"] for params in told), "and one wheel on is enough not to be off"


def test_the_console_would_have_paid_what_it_paid(heard):
    _, paid = heard
    np.testing.assert_allclose(paid, RECORDED[:, 8], rtol=1e-6)


def test_distance_and_side_are_those_of_plain_geometry(heard):
    """By hand: the nearest point of the polygon of waypoints, and on which side of that edge the car is."""
    told, _ = heard
    sides = []
    for params in told:
        line = np.array(params["waypoints"])
        start, along = line[:-1], np.diff(line, axis=0)
        away = np.array([params["x"], params["y"]]) - start
        share = np.clip((away * along).sum(axis=1) / (along**2).sum(axis=1), 0.0, 1.0)
        gaps = np.linalg.norm(away - share[:, None] * along, axis=1)
        edge = gaps.argmin()
        assert params["distance_from_center"] == pytest.approx(gaps[edge], abs=1e-9)
        left = bool(along[edge, 0] * away[edge, 1] - along[edge, 1] * away[edge, 0] > 0)
        assert params["is_left_of_center"] is left
        sides.append(left)
    np.testing.assert_allclose(
        [params["distance_from_center"] / params["track_width"] for params in told], RECORDED[:, 10], atol=0.006
    )
    assert 5 < sum(sides) < len(sides) - 5, "both sides are among them"


@pytest.mark.parametrize("reverse", [False, True])
def test_north_of_the_start_line_is_left_for_who_drives_east(reverse):
    """The track begins eastward along y = 0.68: 20 cm north of it is left, and right for who drives the other way."""
    listener = Listener()
    world = make_world(listener, 2, race_config=RaceConfig(reverse=reverse))
    buffers = allocate(world.spec)
    put(world, buffers, x=[3.2, 3.2], y=[0.88, 0.48], yaw=math.pi if reverse else 0.0, start_share=0.0)
    world.step(np.full((2, 1), STRAIGHT), buffers)
    north, south = listener.told
    assert (north["is_left_of_center"], south["is_left_of_center"]) == (not reverse, reverse)
    assert (north["distance_from_center"], south["distance_from_center"]) == pytest.approx((0.2, 0.2), abs=0.01)
    assert abs(north["heading"]) == (180.0 if reverse else 0.0)
    assert north["is_reversed"] == reverse


def test_a_car_is_called_reversed_when_its_progress_fell_fifteen_times_in_a_row():
    listener = Listener()
    world = make_world(listener)
    buffers = allocate(world.spec)
    put(world, buffers, x=5.0, y=0.68, yaw=math.pi, start_share=0.9, progress=20.0)
    while not buffers.terminated.any():
        world.step(np.array([[STRAIGHT]]), buffers)
    falls = np.diff([params["progress"] for params in listener.told]) < 0
    # The first tick of the drive is seen at the row after, so that row's fall is told; the one it was put down with
    # is not, for a car that is prepared does not drive.
    assert falls.all()
    assert len(falls) == 15
    assert world.pop_episodes()[0].status == "reversed"


def test_the_files_tell_the_speed_that_a_car_had_and_the_one_it_was_told():
    """From rest a classic car told 1 m/s was logged at .12, .33, .54, .67, .86 m/s, step after step (facts 1.4)."""
    recorder = EpisodeRecorder()
    world = make_world(race_config=RaceConfig(car="v4"), start_shares=[0.0])
    buffers, ahead = allocate(world.spec), np.array([[STRAIGHT]])
    world.reset(buffers, 0)
    for _ in range(12):
        world.step(ahead, buffers)
        recorder(world, buffers, ahead)
    columns = recorder.pop(1)
    assert set(columns["speed_mps"]) == {1.0}
    assert columns["velocity_mps"][1] == 0.0, "the first row after preparing is of a car at rest"
    np.testing.assert_allclose(columns["velocity_mps"][2:7], [0.12, 0.33, 0.54, 0.67, 0.86], atol=0.12)
    way = np.hypot(np.diff(columns["x_m"]), np.diff(columns["y_m"]))
    np.testing.assert_allclose(
        way[2:] * 15, (columns["velocity_mps"][2:-1] + columns["velocity_mps"][3:]) / 2, rtol=0.1
    )


@pytest.mark.parametrize(("fidelity", "seen"), [("sane", (30.0, 4.0)), ("aws", (45.0, 5.0))])
def test_a_command_beyond_the_car_is_driven_and_seen_as_sent_and_at_aws_seen_as_written(fidelity, seen):
    """45 degrees at 5 m/s: the car drives 30 degrees at 4 m/s."""
    fastest = ActionTable.of([(math.radians(30), 4.0)])
    stories = []
    for actions, choice in ((ACTIONS, BEYOND), (fastest, 0)):
        listener, recorder = Listener(), EpisodeRecorder()
        world = RaceWorld(
            load_track("reinvent_base"), actions, listener, camera_config=CameraConfig(16, 12), start_shares=[0.0],
            race_config=RaceConfig(fidelity=fidelity),
        )  # fmt: skip
        buffers, told = allocate(world.spec), np.array([[choice]])
        world.reset(buffers, 0)
        for _ in range(6):
            world.step(told, buffers)
            recorder(world, buffers, told)
        stories.append((listener.told, recorder.pop(1)))
    (heard, files), (plain, plain_files) = stories
    assert {(params["steering_angle"], params["speed"]) for params in heard} == {seen}
    assert {(params["steering_angle"], params["speed"]) for params in plain} == {(30.0, 4.0)}
    np.testing.assert_allclose(np.degrees(files["steering_rad"]), seen[0])
    assert set(files["speed_mps"]) == {seen[1]}
    for name in ("x_m", "y_m", "yaw_rad", "velocity_mps"):
        assert files[name].tobytes() == plain_files[name].tobytes(), name
