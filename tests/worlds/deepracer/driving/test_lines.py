import numpy as np
import pytest

from racecraft.worlds.deepracer.driving.lines import LINES, classical_line
from racecraft.worlds.deepracer.driving.profile import corner_speeds, steady_curvature
from racecraft.worlds.deepracer.driving.road_frame import road_frame
from racecraft.worlds.deepracer.env.kernels.vehicle import driven_curvature
from racecraft.worlds.deepracer.env.vehicle import MAX_STEERING_RAD, PROFILES
from racecraft.worlds.deepracer.tracks.catalogue import load_track


@pytest.fixture(scope="module")
def track():
    return load_track("reinvent_base")


def test_a_road_is_as_long_and_wide_as_its_track(track):
    frame = road_frame(track, 0.1)
    assert frame.spacing * len(frame.xy) == pytest.approx(track.length, rel=0.01)
    assert (frame.left + frame.right).mean() == pytest.approx(track.width_mean, rel=0.01)
    assert frame.spacing * frame.curvature.sum() == pytest.approx(2 * np.pi, rel=0.01)  # counter-clockwise


@pytest.mark.parametrize("name", ["reinvent_base", "2022_reinvent_champ", "Straight_track"])
def test_the_shortest_line_is_shorter_and_the_line_of_least_curvature_bends_less_than_the_centre(name):
    centre, shortest, gentle = (classical_line(load_track(name), PROFILES["v5-classic"], 4.0, kind) for kind in LINES)
    assert shortest.arc[-1] <= gentle.arc[-1] + 1e-6
    assert shortest.arc[-1] <= centre.arc[-1] + 1e-6
    assert np.square(gentle.curvature).mean() <= np.square(centre.curvature).mean() + 1e-9
    assert gentle.lap_seconds <= centre.lap_seconds + 1e-6


def test_a_car_turns_as_sharply_at_its_corner_speed_as_the_corner_asks_and_not_faster():
    car, corner = PROFILES["v5-classic"], 1.2
    speed = float(corner_speeds(car, 4.0, np.array([corner]))[0])
    assert steady_curvature(car, np.array([speed]), np.array([MAX_STEERING_RAD]))[0] == pytest.approx(corner, rel=0.01)
    pulled = driven_curvature(car._replace(pull=0.0), speed, MAX_STEERING_RAD)
    assert pulled == pytest.approx(corner, rel=0.01)


def test_speeds_along_a_line_keep_to_acceleration_braking_and_top_speed(track):
    car = PROFILES["v5-classic"]
    line = classical_line(track, car, 3.0, "centre")
    work = np.diff(np.append(line.speed, line.speed[0]) ** 2) / (2 * np.diff(line.arc))
    assert line.speed.max() <= 3.0 * car.speed_gain + 1e-9
    assert work.max() <= car.max_acceleration + 1e-6
    assert work.min() >= -car.max_braking - 1e-6
