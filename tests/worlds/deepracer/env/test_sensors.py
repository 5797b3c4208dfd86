"""What sensors tell, by name: shapes, ranges, where they sit (facts 2.1 to 2.4)."""

import math

import numpy as np
import pytest

from racecraft.contract.world import ArraySpec
from racecraft.worlds.deepracer.env.sensors import (
    AWS_HERTZ,
    BEAM_STEP_RAD,
    FIRST_BEAM_RAD,
    FRONT_CAMERA,
    LAST_BEAM_RAD,
    LIDAR_NOISE_M,
    NEAREST_M,
    LidarView,
    MountedLidar,
    car_sensors,
    lidar_view,
    mounted_lidar,
)


def test_one_eye_is_a_grey_frame_and_two_are_two_channels():
    assert FRONT_CAMERA.specs(40, 30) == {
        "FRONT_FACING_CAMERA": ArraySpec((30, 40), np.uint8, 0, 255, doc="Front camera, grey.")
    }
    assert car_sensors(["STEREO_CAMERAS"]).specs(40, 30) == {
        "STEREO_CAMERAS": ArraySpec((30, 40, 2), np.uint8, 0, 255, doc="Left and right eye, grey.")
    }


@pytest.mark.parametrize(
    ("names", "told"),
    [
        (["FRONT_FACING_CAMERA"], ["FRONT_FACING_CAMERA"]),
        (["LEFT_CAMERA", "LIDAR"], ["FRONT_FACING_CAMERA", "LIDAR"]),
        (["observation"], ["FRONT_FACING_CAMERA"]),
        (["observation", "LIDAR"], ["observation", "LIDAR"]),
        (["SECTOR_LIDAR", "STEREO_CAMERAS"], ["STEREO_CAMERAS", "SECTOR_LIDAR"]),
    ],
)
def test_what_one_eye_sees_has_one_name_but_for_observation_beside_a_lidar(names, told):
    assert list(car_sensors(names).specs(8, 6)) == told


@pytest.mark.parametrize(
    ("name", "config", "view", "shape", "low", "high"),
    [
        ("LIDAR", None, LidarView("LIDAR", 1.0, 0, 1), (64,), 0.15, 1.0),
        ("SECTOR_LIDAR", None, LidarView("SECTOR_LIDAR", 0.5, 8, 1), (8,), 0.0, 1.0),
        ("DISCRETIZED_SECTOR_LIDAR", None, LidarView("DISCRETIZED_SECTOR_LIDAR", 2.0, 8, 8), (64,), 0.0, 1.0),
        (
            "DISCRETIZED_SECTOR_LIDAR", {"num_sectors": 4, "clipping_dist": 3.0},
            LidarView("DISCRETIZED_SECTOR_LIDAR", 3.0, 4, 8), (32,), 0.0, 1.0,
        ),
    ],
)  # fmt: skip
def test_a_lidar_is_told_beam_by_beam_or_by_sectors(name, config, view, shape, low, high):
    found = lidar_view(name, config)
    assert found == view
    assert (found.spec.shape, found.spec.dtype, found.spec.low, found.spec.high) == (shape, np.float32, low, high)
    assert car_sensors(["LEFT_CAMERA", name], config).lidar == view


def test_sixty_four_beams_spread_over_three_hundred_degrees():
    assert math.degrees(FIRST_BEAM_RAD) == pytest.approx(-150, abs=1e-3)
    assert math.degrees(LAST_BEAM_RAD) == pytest.approx(150, abs=1e-3)
    assert math.degrees(BEAM_STEP_RAD) == pytest.approx(300 / 63, abs=1e-3)
    assert (AWS_HERTZ, LIDAR_NOISE_M, NEAREST_M) == (10, 0.01, 0.15)


def test_a_lidar_sits_where_the_original_has_it_and_reads_once_a_tick_unless_told_otherwise():
    assert mounted_lidar(lidar_view("LIDAR")) == MountedLidar(0.02913, 0.1847, 0.0, 15, 0.0, 1.0, 1.0, 0, 1)
    aws = mounted_lidar(lidar_view("LIDAR"), backward=True, hertz=10, noise=0.25)
    assert (aws.yaw, aws.hertz, aws.noise) == (math.pi, 10, 0.25)
    assert aws.reach == 3.0, "eight standard deviations beyond the range nothing comes near enough"
