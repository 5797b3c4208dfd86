"""Two eyes: where each sees the same thing, in which order they are told, and what the one-eyed cameras are called."""

import math
from dataclasses import replace

import numpy as np
import pytest

from racecraft.contract.errors import SettingError
from racecraft.contract.world import allocate
from racecraft.worlds.deepracer.env.actions import ActionTable
from racecraft.worlds.deepracer.env.camera import HORIZONTAL_VIEW_RAD, MOUNT_V3, mounted_optics
from racecraft.worlds.deepracer.env.kernels.camera import render_frame
from racecraft.worlds.deepracer.env.kernels.eyes import render_pair
from racecraft.worlds.deepracer.env.scene import FIELD, ROAD, build_scene
from racecraft.worlds.deepracer.env.sensors import car_sensors
from racecraft.worlds.deepracer.env.settings import BoxesConfig, CameraConfig
from racecraft.worlds.deepracer.env.world import RaceWorld
from racecraft.worlds.deepracer.tracks.catalogue import load_track

ACTIONS = ActionTable.of([(0.0, 1.0), (0.3, 1.0)])
BRIGHT = 200.0


def race(*sensors, width=160, height=120, **options):
    return RaceWorld(
        load_track("reinvent_base"), ACTIONS, sensors=car_sensors(sensors),
        camera_config=CameraConfig(width, height), **options,
    )  # fmt: skip


def frames_over_a_line(left_m):
    """Return what the eyes see, (120, 160, 2), of ground that is bright right of a line along the car's middle plane.

    The car stands in the origin and looks along x; the line lies `left_m` left of its middle.
    """
    world = race("STEREO_CAMERAS")
    ring = np.array([(0.2, left_m), (30.0, left_m), (30.0, -30.0), (0.2, -30.0), (0.2, left_m)])  # clockwise from above
    scene = world.camera.scene._replace(
        vertices=ring, chunks=np.array([[0, 4, ROAD, FIELD]], np.int32), circles=np.array([[15.0, -15.0, 22.0]])
    )
    world.camera.scene = scene
    world._seeing.palettes[:] = 0.0
    world._seeing.palettes[..., ROAD] = BRIGHT
    buffers = allocate(world.spec)
    world.reset(buffers, 0)
    state = world.save_state()
    for name in ("x", "y", "yaw"):
        state[f"car.{name}"][:] = 0.0
    world.load_state(state, buffers)
    return buffers.observations["STEREO_CAMERAS"][0, 0]


@pytest.mark.parametrize("left_m", [0.0, -0.1, 0.07])
def test_a_known_point_is_as_far_apart_in_the_eyes_as_its_distance_says(left_m):
    """Disparity is f·b/z: facts 2.1 have f = 126.2 px, b = 0.06 m; z is the ground's depth in that row."""
    frames = frames_over_a_line(left_m)
    focal, baseline = 80 / math.tan(HORIZONTAL_VIEW_RAD / 2), 0.06
    assert focal == pytest.approx(126.2, abs=0.1)
    compared = 0
    edges = 160 - frames.sum(axis=1) / BRIGHT  # in each row and eye, the column at which the ground turns bright
    for row in range(60, 120, 5):
        slope = (row + 0.5 - 60) / focal
        depth = MOUNT_V3.z / (math.sin(MOUNT_V3.pitch) + slope * math.cos(MOUNT_V3.pitch))
        in_left, in_right = (80 - focal * (left_m - eye) / depth for eye in (baseline / 2, -baseline / 2))
        if 1 < in_right < in_left < 159:
            compared += 1
            assert edges[row, 0] == pytest.approx(in_left, abs=0.02)
            assert edges[row, 1] == pytest.approx(in_right, abs=0.02)
            assert edges[row, 0] - edges[row, 1] == pytest.approx(focal * baseline / depth, abs=0.03)
    assert compared > 5


def test_both_eyes_look_again_after_every_tick():
    world = race("STEREO_CAMERAS", width=16, height=12)
    buffers = allocate(world.spec)
    world.reset(buffers, 0)
    begun = buffers.observations["STEREO_CAMERAS"].copy()
    for _ in range(6):
        world.step(np.zeros((1, 1, 1), np.int64), buffers)
    driven = buffers.observations["STEREO_CAMERAS"].copy()
    assert (driven != begun).any(axis=(0, 1, 2, 3)).all(), "the left one and the right one"
    world.load_state(world.save_state(), buffers)
    np.testing.assert_array_equal(buffers.observations["STEREO_CAMERAS"], driven)


def test_left_and_front_camera_and_the_oldest_cars_observation_see_the_same():
    """The original gives only stereo cars a second camera; all others see from the car's middle."""
    frames = []
    for name in ("FRONT_FACING_CAMERA", "LEFT_CAMERA", "observation"):
        world = race(name, width=40, height=30, objects=BoxesConfig(positions="0.05,1;0.1,-1"))
        buffers = allocate(world.spec)
        world.reset(buffers, 0)
        frames.append(buffers.observations["FRONT_FACING_CAMERA"])
    assert (frames[0] == frames[1]).all()
    assert (frames[0] == frames[2]).all()
    assert frames[0].std() > 10


def test_both_eyes_see_boxes():
    world = race("STEREO_CAMERAS", objects=BoxesConfig(number=1))
    buffers = allocate(world.spec)
    world.reset(buffers, 0)
    without = race("STEREO_CAMERAS")
    empty = allocate(without.spec)
    without.reset(empty, 0)
    state, car = world.save_state(), world.cars[0, 0]
    ahead = car["x"] + 0.8 * math.cos(car["yaw"]), car["y"] + 0.8 * math.sin(car["yaw"])
    state["object.boxes"][0, 0, :3] = *ahead, car["yaw"]
    world.load_state(state, buffers)
    changed = buffers.observations["STEREO_CAMERAS"][0, 0] != empty.observations["STEREO_CAMERAS"][0, 0]
    columns = [np.flatnonzero(changed[..., eye].any(axis=0)) for eye in range(2)]
    near = 0.8 - 0.2 - MOUNT_V3.x  # the near face stands upright: its depth changes little from foot to top
    shift = columns[0].mean() - columns[1].mean()
    assert shift == pytest.approx(126.2 * 0.06 / near, rel=0.1)


@pytest.mark.parametrize("roll", [0.0, 0.12, -0.2])
@pytest.mark.parametrize("grain", [0.0, 30.0])
def test_each_eye_sees_what_a_camera_in_its_place_sees(roll, grain):
    """Whether the ground is worked out for both at once or, where the camera leans, for each by itself."""
    scene, half, yaw = build_scene(load_track("reinvent_base")), 0.03, 0.7
    optics = mounted_optics(80, 60, replace(MOUNT_V3, roll=roll))._replace(grain=grain)
    x, y, _ = load_track("reinvent_base").pose_at(2.0)
    pair, alone = np.zeros((2, 60, 80), np.uint8), np.zeros((60, 80), np.uint8)
    render_pair(scene, optics, x, y, yaw, half, scene.grey_palette, pair)
    for eye, left in enumerate((half, -half)):
        place = x - math.sin(yaw) * left, y + math.cos(yaw) * left
        render_frame(scene, optics, *place, yaw, scene.grey_palette, alone)
        assert (alone != pair[1 - eye]).mean() > 0.02, "the eyes should see apart"
        np.testing.assert_allclose(pair[eye].astype(int), alone.astype(int), atol=1)


def test_a_stereo_eye_turns_colours_grey_as_the_original_does():
    """PIL's "L" is 0.299 R + 0.587 G + 0.114 B; a single camera's red counts 0.2989 (facts 2.4)."""
    scene = build_scene(load_track("reinvent_base"))
    for name, red in (("STEREO_CAMERAS", 0.299), ("FRONT_FACING_CAMERA", 0.2989)):
        np.testing.assert_allclose(race(name)._seeing.palettes[0, 0], scene.palette @ [red, 0.587, 0.114])


@pytest.mark.parametrize(
    ("names", "told"),
    [
        (["FRONT_FACING_CAMERA", "STEREO_CAMERAS"], "exactly one camera"),
        (["LIDAR"], "exactly one camera"),
        (["FRONT_FACING_CAMERA", "LIDAR", "SECTOR_LIDAR"], "at most one LiDAR"),
        (["STEREO_CAMERA"], "Did you mean 'STEREO_CAMERAS'"),
    ],
)
def test_sensors_that_do_not_go_together_are_refused(names, told):
    with pytest.raises(SettingError, match=told):
        car_sensors(names)
