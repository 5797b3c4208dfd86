"""Beams against Shapely, and what a policy is told of them."""

import itertools
import math

import numpy as np
import pytest
import shapely

from racecraft.contract.world import allocate
from racecraft.worlds.deepracer.env.actions import ActionTable
from racecraft.worlds.deepracer.env.kernels.lidar import enters_at, look_around, scan_poses
from racecraft.worlds.deepracer.env.scene import build_scene
from racecraft.worlds.deepracer.env.sensors import (
    FARTHEST_M,
    LIDAR_NOISE_M,
    LIDAR_X_M,
    LIDAR_Z_M,
    STEREO,
    car_sensors,
    lidar_view,
    mounted_lidar,
)
from racecraft.worlds.deepracer.env.settings import BoxesConfig, CameraConfig, RaceConfig
from racecraft.worlds.deepracer.env.world import RaceWorld
from racecraft.worlds.deepracer.tracks.catalogue import load_track

ACTIONS = ActionTable.of([(0.0, 1.0), (0.3, 1.0)])
FAR = mounted_lidar(lidar_view("LIDAR"))._replace(reach=FARTHEST_M)
ANGLES = np.linspace(-2.61799, 2.61799, 64)
"""Facts 2.2: 64 rays from -150 to 150 degrees."""


def slow_ranges(pose, boxes, bounds, backward=False, reach=FARTHEST_M):
    """Return the 64 distances that Shapely measures: along each beam to the first outline it meets."""
    x, y, yaw = pose
    eye = shapely.Point(x + LIDAR_X_M * math.cos(yaw), y + LIDAR_X_M * math.sin(yaw))
    things = [shapely.box(*bounds).exterior]
    for box_x, box_y, box_yaw, half_length, half_width, height in boxes:
        if height > LIDAR_Z_M:
            flat = shapely.box(-half_length, -half_width, half_length, half_width)
            turned = shapely.affinity.rotate(flat, box_yaw, origin=(0, 0), use_radians=True)
            things.append(shapely.affinity.translate(turned, box_x, box_y))
    ends = [
        (eye.x + reach * math.cos(angle), eye.y + reach * math.sin(angle))
        for angle in yaw + ANGLES + (math.pi if backward else 0.0)
    ]
    beams = [shapely.LineString([(eye.x, eye.y), end]) for end in ends]
    met = shapely.intersection(np.array(beams)[:, None], np.array(things)[None, :])
    return np.fmin.reduce(shapely.distance(eye, met), axis=1, initial=reach)


def rooms(count, boxes_each, rng):
    """Return poses (R, 3) on a track's field and boxes (R, K, 6) around them, some of them too low to be seen."""
    track = load_track("reinvent_base")
    x0, y0, x1, y1 = track.field_bounds
    low, high = (x0 + 0.05, y0 + 0.05, -7.0), (x1 - 0.05, y1 - 0.05, 7.0)
    poses = rng.uniform(low, high, (count, 3))
    boxes = np.empty((count, boxes_each, 6))
    boxes[..., 0], boxes[..., 1] = rng.uniform(x0, x1, boxes.shape[:2]), rng.uniform(y0, y1, boxes.shape[:2])
    boxes[:, : boxes_each // 2, :2] = poses[:, None, :2] + rng.normal(0, 0.5, (count, boxes_each // 2, 2))
    boxes[..., 2] = rng.uniform(-7, 7, boxes.shape[:2])
    boxes[..., 3:5] = rng.uniform(0.05, 0.4, (*boxes.shape[:2], 2))
    boxes[..., 5] = rng.uniform(0.1, 0.4, boxes.shape[:2])
    return build_scene(track), track.field_bounds, poses, boxes


@pytest.mark.parametrize("backward", [False, True])
def test_every_beam_ends_where_shapely_says(backward):
    scene, bounds, poses, boxes = rooms(400, 6, np.random.default_rng(5))
    lidar = FAR._replace(yaw=math.pi if backward else 0.0)
    ranges = np.empty((len(poses), 64))
    scan_poses(lidar, scene, poses, boxes, ranges)
    expected = np.array([slow_ranges(pose, near, bounds, backward) for pose, near in zip(poses, boxes, strict=True)])
    assert (expected < 3.0).mean() > 0.5, "most beams should meet something"
    assert (expected == 0.0).any(), "some cars should stand in a box"
    np.testing.assert_allclose(ranges, expected, atol=1e-9)


@pytest.mark.parametrize(
    ("eye", "along", "met"),
    [
        ((0.5, -3.0), (0.0, 1.0), 2.0),  # along the short side, in line with the rectangle
        ((-4.0, -1.5), (1.0, 0.0), math.inf),  # beside it
        ((-4.0, 0.5), (-1.0, 0.0), math.inf),  # away from it
        ((0.5, 0.5), (0.0, 1.0), 0.0),  # within it
    ],
)
def test_a_beam_along_a_side_meets_a_rectangle_or_passes_it(eye, along, met):
    """Of 4 m by 2 m, in its own frame: what no drawn beam is, for none is parallel to the last bit."""
    assert enters_at(*eye, *along, 2.0, 1.0) == met


def test_a_short_reach_changes_nothing_within_it():
    scene, _, poses, boxes = rooms(300, 6, np.random.default_rng(6))
    far, near = np.empty((300, 64)), np.empty((300, 64))
    scan_poses(FAR, scene, poses, boxes, far)
    scan_poses(FAR._replace(reach=1.0), scene, poses, boxes, near)
    np.testing.assert_array_equal(near, np.minimum(far, 1.0))


def test_low_walls_are_looked_over_and_walls_from_outside_looked_through():
    scene, bounds, poses, boxes = rooms(20, 2, np.random.default_rng(7))
    ranges = np.empty((20, 64))
    scan_poses(FAR, scene._replace(wall_height=0.18), poses, boxes[:, :0], ranges)
    assert (ranges == FARTHEST_M).all()
    poses[:, 0] = bounds[0] - 0.5
    scan_poses(FAR, scene, poses, boxes[:, :0], ranges)
    assert (ranges == FARTHEST_M).all()


def race(sensors=("FRONT_FACING_CAMERA", "LIDAR"), lidar_config=None, boxes=1, **options):
    told = ("fidelity", "max_episode_seconds", "start_advance")
    config = RaceConfig(**{name: options.pop(name) for name in told if name in options})
    return RaceWorld(
        load_track("reinvent_base"), ACTIONS, sensors=car_sensors(sensors, lidar_config), race_config=config,
        camera_config=CameraConfig(16, 12), objects=BoxesConfig(number=boxes), **options,
    )  # fmt: skip


def lined_up(world, seed=0):
    """Return buffers in which every car has just been lined up."""
    buffers = allocate(world.spec)
    world.reset(buffers, seed)
    return buffers


def put_box(world, ahead_m, left_m=0.0):
    """Put every world's box, 20 cm square, so that its near face lies so far from the LiDAR of the world's car."""
    cars = world.cars[:, 0]
    cos, sin = np.cos(cars["yaw"]), np.sin(cars["yaw"])
    ahead = LIDAR_X_M + ahead_m + math.copysign(0.1, ahead_m)
    places = cars["x"] + ahead * cos - left_m * sin, cars["y"] + ahead * sin + left_m * cos
    world._objects.boxes[:, 0, :3] = np.column_stack([*places, cars["yaw"]])
    world._objects.boxes[:, 0, 3:] = 0.1, 0.1, 0.3


def looked(world):
    """Return what the first car of every world is told after looking round where it stands, (N, L)."""
    view = np.empty((len(world.cars), *world.sensors.lidar.spec.shape), np.float32)
    for n in range(len(view)):
        look_around(
            world.lidar, world.camera.scene, world._objects, world._cars, n, 0, world._keys[n, 0],
            world._seeing.ranges[n, 0], view[n],
        )  # fmt: skip
    return view


def test_what_stands_ahead_is_seen_ahead_where_sane_and_lies_in_the_blind_sector_at_aws():
    sane, aws = race(fidelity="sane"), race(fidelity="aws")
    for world in (sane, aws):
        lined_up(world)
        put_box(world, 0.5)
    seen = looked(sane)[0]
    assert seen[31:33] == pytest.approx(0.5, abs=1e-3), "the middle beams point ahead"
    assert (np.delete(seen, range(20, 44)) == 1.0).all()
    assert (looked(aws) == 1.0).all(), "what is straight ahead lies in the blind sector"
    for world in (sane, aws):
        put_box(world, -0.5)
    assert looked(aws)[0, 31:33] == pytest.approx(0.5, abs=4 * LIDAR_NOISE_M), "the middle beams point backward"
    assert (looked(sane) == 1.0).all()


@pytest.mark.parametrize("fidelity", ["sane", "aws"])
def test_readings_come_15_times_a_second_where_sane_and_10_times_at_aws(fidelity):
    world = race(fidelity=fidelity)
    buffers = lined_up(world)
    put_box(world, 0.3, left_m=0.4)
    seen = []
    for _ in range(13):
        world.step(np.zeros((1, 1), np.int64), buffers)
        seen.append(buffers.observations["LIDAR"][0, 0].copy())
    is_new = [(now != before).any() for before, now in itertools.pairwise(seen)][2:]
    assert is_new == [fidelity == "sane" or tick % 3 != 1 for tick in range(4, 14)]


def test_noise_is_of_one_centimetre_and_the_cars_own():
    world = race(fidelity="aws", num_cars=2)

    def told(seed):
        lined_up(world, seed)
        put_box(world, -0.5)
        return looked(world)

    noisy = told(3)
    exact = np.empty((2, 64))
    poses = np.column_stack([world.cars[part][:, 0] for part in ("x", "y", "yaw")])
    scan_poses(FAR._replace(yaw=math.pi), world.camera.scene, poses, world.boxes, exact)
    hit = (exact > 0.3) & (exact < 0.9)
    assert 0.5 * LIDAR_NOISE_M < (noisy - exact)[hit].std() < 2 * LIDAR_NOISE_M
    assert ((noisy - exact)[0] != (noisy - exact)[1])[hit[0]].all()
    assert (told(3) == noisy).all()
    assert (told(4) != noisy).any()


def test_what_is_nearer_than_it_measures_reads_as_the_nearest():
    world = race()
    lined_up(world)
    put_box(world, 0.05)
    told = looked(world)[0]
    assert told.min() == world.sensors.lidar.spec.low == np.float32(0.15)
    assert (told >= 0.15).all()


def test_a_parked_car_is_nowhere():
    world = race(cars_per_world=2, boxes=0)
    lined_up(world)
    assert (looked(world) < 1.0).any()
    world.freeze(np.array([[False, True]]))
    assert (looked(world) == 1.0).all()


def test_an_episode_begins_with_a_reading_of_its_own_place():
    """At AWS a LiDAR stands still every third tick, but not over a start elsewhere."""
    config = {"clipping_dist": 12.0}
    world = race(
        ("FRONT_FACING_CAMERA", "DISCRETIZED_SECTOR_LIDAR"), config, boxes=0, fidelity="aws",
        max_episode_seconds=1.1, start_advance=0.37,
    )  # fmt: skip
    buffers, exact, standing = lined_up(world), np.empty((1, 64)), 0
    for _ in range(160):
        world.step(np.zeros((1, 1), np.int64), buffers)
        if buffers.ended.any():
            car = world.cars[0, 0]
            scan_poses(
                FAR._replace(yaw=math.pi), world.camera.scene, np.array([[car["x"], car["y"], car["yaw"]]]),
                world.boxes, exact,
            )  # fmt: skip
            assert (exact < FARTHEST_M).any()
            np.testing.assert_allclose(world.lidar_ranges[0], exact, atol=6 * LIDAR_NOISE_M)
            standing += int(car["total_ticks"]) * 10 // 15 == (int(car["total_ticks"]) - 1) * 10 // 15
    assert standing > 0, "some episodes should begin while the LiDAR would stand still"


def test_the_last_observation_of_an_episode_is_what_the_car_would_have_seen_had_it_gone_on():
    """Of two worlds with the same boxes one ends its episode, the other does not."""
    sensors = ("STEREO_CAMERAS", "LIDAR")
    short, long = race(sensors, boxes=6, max_episode_seconds=1.0), race(sensors, boxes=6, max_episode_seconds=9.0)
    ending, going = lined_up(short, 4), lined_up(long, 4)
    for world in (short, long):
        put_box(world, 0.9, left_m=0.35)
    for _ in range(40):
        for world, buffers in ((short, ending), (long, going)):
            world.step(np.zeros((1, 1), np.int64), buffers)
        if ending.ended.any():
            break
    assert ending.ended.any()
    assert not going.ended.any()
    assert (going.observations["LIDAR"] < 1.0).any()
    for name in sensors:
        np.testing.assert_array_equal(ending.final_observations[name], going.observations[name], name)


def sector_by_hand(ranges, sectors, values, clip):
    """Return the original's formula, one sector after the other (facts 2.2)."""
    told = []
    for part in np.array_split(np.minimum(ranges, clip), sectors):
        row = np.zeros(values + 1)
        row[min(max(math.floor(part.min() / (clip / values)), 0), values)] = 1.0
        told += row[:-1].tolist()
    return np.array(told)


@pytest.mark.parametrize(
    ("name", "config", "sectors", "values", "clip"),
    [
        ("SECTOR_LIDAR", None, 8, 1, 0.5),
        ("DISCRETIZED_SECTOR_LIDAR", None, 8, 8, 2.0),
        ("DISCRETIZED_SECTOR_LIDAR", {"num_sectors": 4, "num_values_per_sector": 5, "clipping_dist": 3.0}, 4, 5, 3.0),
    ],
)
def test_sectors_are_told_as_in_the_original(name, config, sectors, values, clip):
    world = race(("FRONT_FACING_CAMERA", name), config, num_cars=40, boxes=3)
    lined_up(world)
    rng = np.random.default_rng(2)
    cars, boxes = world.cars, world._objects.boxes
    boxes[..., 0] = cars["x"] + rng.normal(0, 0.8, (40, 3))
    boxes[..., 1] = cars["y"] + rng.normal(0, 0.8, (40, 3))
    boxes[..., 2:] = rng.uniform((0, 0.1, 0.1, 0.1), (3, 0.2, 0.2, 0.4), (40, 3, 4))
    told = looked(world)
    poses = np.column_stack([cars[part][:, 0] for part in ("x", "y", "yaw")])
    ranges = np.empty((40, 64))
    scan_poses(FAR, world.camera.scene, poses, boxes, ranges)
    assert told.shape == (40, sectors * values)
    assert 0 < told.sum() < 40 * sectors
    for row in range(40):
        np.testing.assert_array_equal(told[row], sector_by_hand(ranges[row], sectors, values, clip))


def body_of(car):
    """Return the rectangle of a car's body (facts 1.1: x from -0.158 to 0.166 m, y ±0.094, 0.195 m high)."""
    middle = car["x"] + 0.004 * math.cos(car["yaw"]), car["y"] + 0.004 * math.sin(car["yaw"])
    return (*middle, car["yaw"], 0.162, 0.094, 0.195)


def test_the_cars_of_a_world_see_each_other():
    world = race(cars_per_world=2, boxes=0)
    buffers = lined_up(world)
    pair = world.cars[0]
    for mine, other in ((0, 1), (1, 0)):
        pose = tuple(pair[mine][["x", "y", "yaw"]])
        expected = np.clip(slow_ranges(pose, [body_of(pair[other])], world.track.field_bounds), 0.15, 1.0)
        assert expected.min() < 0.8
        np.testing.assert_allclose(buffers.observations["LIDAR"][0, mine], expected, atol=1e-6)


def test_a_loaded_race_shows_the_reading_that_stood():
    world = race(("STEREO_CAMERAS", "LIDAR"), fidelity="aws", num_cars=3)
    buffers = lined_up(world)
    put_box(world, -0.4)
    for _ in range(10):  # after ten ticks the LiDAR stands still for a tick
        world.step(np.zeros((3, 1), np.int64), buffers)
    state, shown = world.save_state(), {name: part.copy() for name, part in buffers.observations.items()}
    world.step(np.zeros((3, 1), np.int64), buffers)
    after = {name: part.copy() for name, part in buffers.observations.items()}
    world.load_state(state, buffers)
    for name, part in shown.items():
        np.testing.assert_array_equal(buffers.observations[name], part, name)
    world.step(np.zeros((3, 1), np.int64), buffers)
    for name, part in after.items():
        np.testing.assert_array_equal(buffers.observations[name], part, name)
    assert STEREO in shown
