"""The car's answer to steering and throttle: by hand, by twin, by law."""

import itertools
import math

import pytest

from racecraft.worlds.deepracer.env import vehicle
from racecraft.worlds.deepracer.env.kernels.vehicle import controls_after, drive
from racecraft.worlds.deepracer.env.vehicle import PROFILES, TICK_SECONDS, WHEELBASE_M


def drive_ticks(profile, ticks, steering, speed, start=(0.0, 0.0, 0.0, 0.0, 0.0)):
    """Drive a car or a named one with one command from the first tick on; return (x, y, yaw, speed, steering)."""
    car = PROFILES[profile] if isinstance(profile, str) else profile
    x, y, yaw, v, delta = start
    old = (0.0, 0.0)
    for _ in range(ticks):
        x, y, yaw, v, delta = drive(car, x, y, yaw, v, delta, *old, steering, speed)
        old = (steering, speed)
    return x, y, yaw, v, delta


def test_the_ideal_car_drives_the_textbook_circle():
    """Rear axle on a circle of radius L / tan(delta); 1 m/s for 3 s is 3 m of arc, a turn of 3 / R."""
    delta = math.radians(20)
    radius = WHEELBASE_M / math.tan(delta)
    rear = 0.081663
    x, y, yaw, _, _ = drive_ticks("kinematic", 45, delta, 1.0)
    turned = 45 * TICK_SECONDS / radius
    assert yaw == pytest.approx(math.remainder(turned, 2 * math.pi), abs=1e-9)
    # The rear axle began at (-rear, 0) and circles (-rear, radius); base_link rides `rear` ahead of it.
    axle = (-rear + radius * math.sin(turned), radius * (1 - math.cos(turned)))
    assert x == pytest.approx(axle[0] + rear * math.cos(yaw), abs=2e-3)
    assert y == pytest.approx(axle[1] + rear * math.sin(yaw), abs=2e-3)


def test_the_classic_car_takes_off_as_it_did_in_the_logs():
    """Recorded on the way from pose to pose in ticks 1 to 5 at 1 m/s: .12, .33, .54, .67, .86 m/s, jitter some .05."""
    path = [drive_ticks("v4", ticks, 0.0, 1.0)[:2] for ticks in range(6)]
    speeds = [math.dist(a, b) / TICK_SECONDS for a, b in itertools.pairwise(path)]
    assert speeds == pytest.approx([0.12, 0.33, 0.54, 0.67, 0.86], abs=0.09)


@pytest.mark.parametrize("profile", ["v4", "v5-classic", "v6", "v6-unlimited"])
def test_thirty_degrees_turn_wider_than_the_geometry_says(profile):
    """The wheelbase says 0.28 m."""
    far = drive_ticks(profile, 60, math.radians(30), 1.0)
    farther = drive_ticks(profile, 61, math.radians(30), 1.0)
    yaw_rate = math.remainder(farther[2] - far[2], 2 * math.pi) / TICK_SECONDS
    radius = far[3] / yaw_rate
    assert radius == pytest.approx(
        {"v4": 0.498, "v5-classic": 0.662, "v6": 0.497, "v6-unlimited": 0.497}[profile], abs=0.01
    )


@pytest.mark.parametrize("profile", PROFILES)
def test_left_and_right_are_mirrors(profile):
    even = PROFILES[profile]._replace(pull=0.0)
    left = drive_ticks(even, 20, 0.3, 1.5)
    right = drive_ticks(even, 20, -0.3, 1.5)
    assert right == (left[0], -left[1], -left[2], left[3], -left[4])


@pytest.mark.parametrize("profile", PROFILES)
def test_where_one_starts_does_not_change_how_one_drives(profile):
    """The same drive from another pose is the same path, turned and moved."""
    turn, move = 0.7, (3.0, -2.0)
    x, y, yaw, v, delta = drive_ticks(profile, 15, -0.2, 1.0)
    far = drive_ticks(profile, 15, -0.2, 1.0, start=(*move, turn, 0.0, 0.0))
    assert far[0] == pytest.approx(move[0] + x * math.cos(turn) - y * math.sin(turn))
    assert far[1] == pytest.approx(move[1] + x * math.sin(turn) + y * math.cos(turn))
    assert far[2:] == pytest.approx((yaw + turn, v, delta))


def test_a_new_command_waits_for_its_delay():
    """The v6 car steers 0.033 s after the command: in a tick of 0.067 s only 5 of 10 substeps feel it."""
    profile = PROFILES["v6"]
    _, _, _, _, delta = drive(profile, 0.0, 0.0, 0.0, 1.03, 0.0, 0.0, 1.0, 0.5, 1.0)
    share = 1 - math.exp(-5 * TICK_SECONDS / 10 / profile.steering_lag)
    assert delta == pytest.approx(0.5 * share)


def test_the_classic_car_pulls_to_the_left():
    """Told to go straight at full speed it drives a circle of 1 / pull = 23 m."""
    profile = PROFILES["v4"]
    *_, yaw, v, _ = drive_ticks("v4", 45, 0.0, 2.0)
    *_, later, _, _ = drive(profile, 0.0, 0.0, yaw, v, 0.0, 0.0, 2.0, 0.0, 2.0)
    assert (later - yaw) / (v * TICK_SECONDS) == pytest.approx(profile.pull, rel=1e-3)
    assert PROFILES["v6"].pull == 0.0


@pytest.mark.parametrize("profile", PROFILES)
def test_a_tick_of_the_clock_is_a_tick(profile):
    """Naming the world's own tick changes no bit, and two half ticks come to where one whole tick comes."""
    car = PROFILES[profile]._replace(steering_delay=0.0, speed_delay=0.0)
    start, command = (1.0, 2.0, 0.3, 0.8, 0.1), (-0.2, 0.5, 0.4, 1.5)
    whole = drive(car, *start, *command)
    assert whole == drive(car, *start, *command, TICK_SECONDS)
    half = drive(car, *drive(car, *start, *command, TICK_SECONDS / 2), *command, TICK_SECONDS / 2)
    assert half == pytest.approx(whole, rel=1e-12)
    assert drive(car, *start, *command, 0.05)[0] != whole[0]


@pytest.mark.parametrize("profile", PROFILES)
@pytest.mark.parametrize("substep_seconds", [TICK_SECONDS / 10, TICK_SECONDS / 3])
def test_speed_and_wheels_alone_come_to_what_the_whole_drive_does(profile, substep_seconds):
    controls = (0.8, 0.1, -0.2, 0.5, 0.4, 1.5)
    *_, speed, steering = drive(PROFILES[profile], 1.0, 2.0, 0.3, *controls, TICK_SECONDS, substep_seconds)
    assert controls_after(PROFILES[profile], *controls, TICK_SECONDS, substep_seconds) == (speed, steering)


def steady_turn(profile, degrees, speed):
    """Return the share of the geometric curvature and the lateral acceleration (m/s²) once all lags are over."""
    car = PROFILES[profile]._replace(pull=0.0)
    before = drive_ticks(car, 90, math.radians(degrees), speed)
    after = drive_ticks(car, 91, math.radians(degrees), speed)
    curvature = math.remainder(after[2] - before[2], 2 * math.pi) / TICK_SECONDS / before[3]
    return curvature * WHEELBASE_M / math.tan(math.radians(degrees)), abs(curvature) * before[3] ** 2


@pytest.mark.parametrize(("speed", "share"), [(0.45, 0.63), (1.05, 0.47), (1.8, 0.34), (2.75, 0.28), (3.9, 0.22)])
def test_the_later_classic_car_turns_less_the_faster_it_goes(speed, share):
    """Regressed from the consoles' logs tick by tick; the car that strays least in a second turns a little less."""
    assert steady_turn("v5-classic", 15.0, speed / 0.965)[0] == pytest.approx(share, abs=0.08)


def test_the_later_classic_car_holds_twice_what_the_earlier_one_holds():
    """Recorded above 3 m/s at 30 degrees: up to 9 m/s² (facts: generations)."""
    assert 6.0 < steady_turn("v5-classic", 30.0, 3.6)[1] < steady_turn("v5-classic", 30.0, 4.0)[1] < 9.0


def test_the_earlier_classic_car_slides_at_three_metres_a_second_squared():
    """Recorded: lateral acceleration levels off at 3 to 4 m/s² at larger angles (facts: generations)."""
    for speed in (2.0, 3.0, 4.0):
        assert 2.6 < steady_turn("v4", 25.0, speed)[1] < 3.1
    assert steady_turn("v4", 25.0, 1.0)[1] < 2.0


@pytest.mark.parametrize("degrees", [10, 20, 30])
def test_todays_car_holds_nine_metres_a_second_squared(degrees):
    """Read off circles and steps of two teams at up to 4 m/s (docs/fidelity.md); the car without limits holds more."""
    assert steady_turn("v6", degrees, 4.0)[1] < 9.0
    assert steady_turn("v6-unlimited", degrees, 4.0)[1] > 11.0
    assert steady_turn("v6", degrees, 1.3)[1] == pytest.approx(steady_turn("v6-unlimited", degrees, 1.3)[1], rel=0.01)


def test_todays_car_reaches_three_and_a_half_metres_a_second_and_takes_a_third_of_a_second():
    """Wheels of 36 mm that turn at 100 rad/s, and 10 m/s² from rest: 3.6 m/s after 0.36 s and a little."""
    speeds = [drive_ticks("v6", ticks, 0.0, 4.0)[3] for ticks in (3, 5, 8)]
    assert speeds[0] == pytest.approx(10.0 * (3 * TICK_SECONDS - PROFILES["v6"].speed_delay), abs=0.01)
    assert speeds[1] < 3.4
    assert speeds[2] == pytest.approx(3.6, abs=0.01)


@pytest.mark.parametrize(
    ("car", "speed", "is_beyond"),
    [("v6", 2.5, False), ("v6", 2.6, True), ("v6-unlimited", 3.0, True), ("v4", 4.0, False), ("kinematic", 4.0, False)],
)
def test_a_speed_that_no_log_reaches_is_named(car, speed, is_beyond):
    sentence = vehicle.beyond_logs(car, speed)
    assert (sentence is not None) == is_beyond
    assert not is_beyond or "beyond the logs: limits inferred" in sentence


@pytest.mark.parametrize(("profile", "speeds_up", "brakes"), [("v4", 3.15, 3.86), ("v5-classic", 3.14, 4.27)])
def test_classic_cars_speed_up_and_brake_as_hard_as_their_logs_say(profile, speeds_up, brakes):
    """m/s² of a full command from rest, and of none at 4 m/s (fitted to the logs of both generations)."""
    faster = drive(PROFILES[profile], 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 4.0, 0.0, 4.0)[3]
    slower = drive(PROFILES[profile], 0.0, 0.0, 0.0, 4.0, 0.0, 0.0, 0.0, 0.0, 0.0)[3]
    assert faster / TICK_SECONDS == pytest.approx(speeds_up)
    assert (4.0 - slower) / TICK_SECONDS == pytest.approx(brakes)


def test_a_car_has_the_measures_of_the_original():
    """m and rad (simapp `track_geom/constants.py`, `agent_ctrl/constants.py`, `racecar.gazebo`)."""
    assert pytest.approx(0.082311 + 0.081663) == vehicle.WHEELBASE_M
    assert (vehicle.REAR_WHEELS_M, vehicle.FRONT_WHEELS_M) == ((-0.081663, 0.08105), (0.082311, 0.079601))
    assert pytest.approx((0.32352, 0.1961)) == (2 * vehicle.BODY_HALF_LENGTH_M, 2 * vehicle.BODY_HALF_WIDTH_M)
    assert (vehicle.FRONT_POINT_M, vehicle.TICKS_PER_SECOND, TICK_SECONDS) == (0.14, 15.0, 1 / 15)
    assert math.degrees(vehicle.MAX_STEERING_RAD) == pytest.approx(30.0)
    assert (vehicle.MIN_SPEED_MPS, vehicle.MAX_SPEED_MPS) == (0.1, 4.0)
