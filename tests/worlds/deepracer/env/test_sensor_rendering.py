"""What a car's own sensors come to: whose LiDAR, which grey, how much room for eyes."""

import math
from types import SimpleNamespace

import numpy as np
import pytest

from racecraft.worlds.deepracer.env.fidelity import habits
from racecraft.worlds.deepracer.env.race_spec import CRITIC_NAME
from racecraft.worlds.deepracer.env.sensor_rendering import EYE_PAIR, SensorRenderer, grey_weights
from racecraft.worlds.deepracer.env.sensors import car_sensors

LEVELS = np.arange(12.0).reshape(4, 3)
"""Red, green and blue of four materials."""


def seeing(names, fidelity="sane"):
    optics = tuple(range(13))
    camera = SimpleNamespace(scene=SimpleNamespace(palette=LEVELS), optics=optics, width=8, height=6)
    return SensorRenderer(camera, car_sensors(names), habits(fidelity), (2, 3))


@pytest.mark.parametrize(
    ("names", "weights"),
    [(["LEFT_CAMERA"], [0.2989, 0.587, 0.114]), (["STEREO_CAMERAS"], [0.299, 0.587, 0.114])],
)
def test_every_car_sees_materials_in_the_grey_of_its_camera(names, weights):
    own = seeing(names)
    np.testing.assert_allclose(own.palettes, np.broadcast_to(LEVELS @ weights, (2, 3, 4)))
    assert grey_weights(own.sensors).tolist() == weights


def test_a_lidar_has_the_habits_of_its_fidelity():
    """At AWS backward, ten times a second, with a centimetre of noise; sane ahead, every tick, exact."""
    sane, aws = (seeing(["LEFT_CAMERA", "LIDAR"], fidelity).lidar for fidelity in ("sane", "aws"))
    assert (sane.yaw, sane.hertz, sane.noise) == (0.0, 15, 0.0)
    assert (aws.yaw, aws.hertz, aws.noise) == (math.pi, 10, 0.01)
    assert seeing(["LEFT_CAMERA", "LIDAR"]).ranges.shape == (2, 3, 64)


def test_one_eye_is_drawn_where_its_observation_lies_and_two_into_room_of_their_own():
    named = {"FRONT_FACING_CAMERA": np.zeros((2, 3, 6, 8), np.uint8), CRITIC_NAME: np.zeros((2, 3, 5), np.float32)}
    one = seeing(["LEFT_CAMERA"])
    for frames, critic, lidar in (one.views(named), one.last_views(named)):
        assert frames.shape == (2, 3, 1, 6, 8)
        assert np.shares_memory(frames, named["FRONT_FACING_CAMERA"])
        assert critic is named[CRITIC_NAME]
        assert (lidar.shape, lidar.dtype) == ((2, 3, 0), np.float32)
    named = {
        "STEREO_CAMERAS": np.zeros((2, 3, 6, 8, 2), np.uint8),
        CRITIC_NAME: named[CRITIC_NAME],
        "LIDAR": np.ones(4),
    }
    two = seeing(["STEREO_CAMERAS", "LIDAR"])
    now, last = two.views(named)[0], two.last_views(named)[0]
    assert now.shape == last.shape == (2, 3, 2, 6, 8)
    assert not np.shares_memory(now, last)
    assert not np.shares_memory(now, named["STEREO_CAMERAS"])
    assert two.views(named)[2] is named["LIDAR"]


def test_two_eyes_are_joined_for_every_car_after_a_tick_and_for_those_whose_episode_ended():
    own, critic = seeing(["STEREO_CAMERAS"]), np.zeros((2, 3, 5), np.float32)
    shown, final = np.zeros((2, 3, 6, 8, 2), np.uint8), np.zeros((2, 3, 6, 8, 2), np.uint8)
    named, ended = (
        {"STEREO_CAMERAS": shown, CRITIC_NAME: critic},
        np.array([[True, False, False], [False, False, True]]),
    )
    own.views(named)[0][:, :, 0], own.views(named)[0][:, :, 1] = 11, 22
    own.last_views(named)[0][:, :, 0], own.last_views(named)[0][:, :, 1] = 33, 44
    own.show(named)
    own.show_last(ended, {"STEREO_CAMERAS": final, CRITIC_NAME: critic})
    assert (shown == [11, 22]).all()
    assert (final[ended] == [33, 44]).all()
    assert not final[~ended].any()
    assert EYE_PAIR.itemsize == 2


def test_what_a_car_draws_takes_the_place_of_what_is_common_to_all():
    own = seeing(["LEFT_CAMERA"])
    _, optics, eyes, lidar, palettes = own.sight
    assert optics.shape == (2, 3)
    assert eyes.tolist() == [0.0]
    assert lidar is own.lidar
    assert palettes is own.palettes
    drawn = SimpleNamespace(optics=np.ones(1), palettes=np.ones(2))
    own.vary(drawn)
    assert own.sight[1] is drawn.optics
    assert own.sight[4] is drawn.palettes


def test_who_carries_no_lidar_is_told_nothing_of_one():
    own = seeing(["LEFT_CAMERA", "LIDAR"])
    assert (
        own.look_around_with(car_sensors(["LEFT_CAMERA"]), None, None, np.zeros((1, 2)), None, np.zeros((1, 64))) == {}
    )
