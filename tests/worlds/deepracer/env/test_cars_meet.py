"""Cars of one world see, touch and are told of each other: against a ray caster, Shapely and slow references."""

import math

import numpy as np
import pytest
import shapely

from racecraft.contract.world import allocate
from racecraft.worlds.deepracer.env import race
from racecraft.worlds.deepracer.env.actions import ActionTable
from racecraft.worlds.deepracer.env.camera import MOUNT_V3, Camera
from racecraft.worlds.deepracer.env.kernels.localise import locate
from racecraft.worlds.deepracer.env.objects import BOT_CAR
from racecraft.worlds.deepracer.env.race_spec import CAMERA_NAME, CRITIC_NAME
from racecraft.worlds.deepracer.env.scene import build_scene
from racecraft.worlds.deepracer.env.sensors import FRONT_CAMERA, car_sensors
from racecraft.worlds.deepracer.env.settings import BotsConfig, BoxesConfig, CameraConfig, RaceConfig
from racecraft.worlds.deepracer.env.world import RaceWorld
from racecraft.worlds.deepracer.tracks.catalogue import load_track
from ray_caster import HEIGHT, LEVELS, WIDTH, cast

ACTIONS = ActionTable.of([(math.radians(angle), speed) for angle in (-30, 0, 30) for speed in (0.5, 2.0)])
SLOW, FAST = 2, 3
LENGTH_M, WIDTH_M, HEIGHT_M = 0.32352, 0.1961, 0.195  # facts 1.1
CAR_MATERIAL = 10 + BOT_CAR


def make_world(worlds=1, cars=2, reward=None, track="reinvent_base", **options):
    options.setdefault("camera_config", CameraConfig(16, 12))
    options.setdefault("race_config", RaceConfig(type="HEAD_TO_MODEL"))
    return RaceWorld(load_track(track), ACTIONS, reward, num_cars=worlds, cars_per_world=cars, **options)


def begin(world, seed=0):
    buffers = allocate(world.spec)
    world.reset(buffers, seed)
    return buffers


def put(world, buffers, poses, **fields):
    """Put cars at poses (N, M, 3) under way; other fields of all cars by name."""
    cars, arrays = world.cars, world.track.arrays()
    cars["x"], cars["y"], cars["yaw"] = np.moveaxis(poses, -1, 0)
    cars["preparing"] = False
    for name, value in fields.items():
        cars[name] = value
    for car in cars.reshape(-1, 1):
        locate(arrays, car[0])
    state = world.save_state()
    state |= {f"car.{name}": cars[name] for name in race.CAR_STATE.names}
    world.load_state(state, buffers)


def near_the_line(world, chance, spread_m, stretch_m=1.0):
    """Return poses (N, M, 3) of cars that crowd on a stretch of the road."""
    shape = world.cars.shape
    arcs = chance.uniform(0, world.track.length, (shape[0], 1)) + chance.uniform(0, stretch_m, shape)
    line = shapely.LineString(world.track.centre)
    points = shapely.get_coordinates(line.interpolate(arcs.ravel() % world.track.length)).reshape(*shape, 2)
    points += chance.uniform(-spread_m, spread_m, points.shape)
    return np.concatenate([points, chance.uniform(-math.pi, math.pi, (*shape, 1))], axis=-1)


def rectangle(pose):
    x, y, yaw = pose
    cos, sin = math.cos(yaw), math.sin(yaw)
    corners = [(a * LENGTH_M / 2, b * WIDTH_M / 2) for a, b in ((1, 1), (1, -1), (-1, -1), (-1, 1))]
    return shapely.Polygon([(x + a * cos - b * sin, y + a * sin + b * cos) for a, b in corners])


def box_of(pose):
    return np.array([*pose, LENGTH_M / 2, WIDTH_M / 2, HEIGHT_M])


def test_a_car_is_in_the_frame_where_a_ray_caster_sees_it():
    """Over the frame of a car alone: pixels inside a face to a grey level, pixels beside it to the bit."""
    chance = np.random.default_rng(1)
    camera = CameraConfig(WIDTH, HEIGHT)
    world, lone = make_world(4, 3, camera_config=camera), make_world(12, 1, camera_config=camera)
    buffers, own = begin(world), begin(lone)
    seen = 0
    for _ in range(2):
        poses = near_the_line(world, chance, 0.2, 3.0)
        poses[..., 2] = chance.uniform(-0.6, 0.6, poses.shape[:2]) + poses[..., :1, 2]
        put(world, buffers, poses)
        put(lone, own, poses.reshape(12, 1, 3))
        for n, m in np.ndindex(4, 3):
            others = np.array([box_of(poses[n, k]) for k in range(3) if k != m])
            if min(np.hypot(*(others[:, :2] - poses[n, m, :2]).T)) < 0.45:
                continue  # the eye is inside another car
            cast_frame, plain = cast(others, [BOT_CAR, BOT_CAR], MOUNT_V3, poses[n, m])
            found = buffers.observations[CAMERA_NAME][n, m].astype(float)
            empty = own.observations[CAMERA_NAME][3 * n + m, 0].astype(float)
            is_car = cast_frame > 60
            level = world.camera.scene.grey_palette[CAR_MATERIAL] / LEVELS[CAR_MATERIAL]
            assert np.abs(found - cast_frame * level)[plain & is_car].max(initial=0.0) <= 1.0
            assert (found == empty)[plain & ~is_car].all()
            seen += int((plain & is_car).sum())
    assert seen > 1000


def test_cars_touch_where_shapely_says_and_the_one_behind_has_crashed():
    """By 7,500 random poses: a crash is a touch of which the car behind, nose by nose, is to blame."""
    chance = np.random.default_rng(2)
    world = make_world(2500, 2, camera_config=CameraConfig(8, 6))
    buffers, length = begin(world), world.track.length
    touched = 0
    for _ in range(3):
        poses = near_the_line(world, chance, 0.2, 0.6)
        put(world, buffers, poses)
        noses = world.cars["arc"]
        world.step(np.zeros((2500, 2), int), buffers)
        a, b = (np.array([rectangle(pose) for pose in poses[:, m]]) for m in range(2))
        meet, shared = shapely.intersects(a, b), shapely.area(shapely.intersection(a, b))
        close = meet & (shared < 1e-9)  # a touch of which rounding decides
        assert (world.reports["object_hit"] == np.where(meet, 0, -1)[:, None])[~close].all()
        behind = (noses[:, ::-1] - noses) % length < length / 2
        assert (world.reports["is_crashed"] == behind & meet[:, None])[~close].all()
        touched += int(meet.sum())
    assert 1900 < touched < 5600


@pytest.mark.parametrize("into", ["a car", "a bot"])
def test_bots_drive_on_when_it_is_a_car_that_is_to_blame(into):
    """By the second car: after a crash of the first the bots would begin anew."""
    world = make_world(objects=BotsConfig(number=1, speed=0.5, min_distance=2.0))
    buffers = begin(world)
    bot, driven = world.boxes[0, 0], world._objects.states["driven"].copy()
    behind_bot = (bot[0] - 0.25 * math.cos(bot[2]), bot[1] - 0.25 * math.sin(bot[2]), bot[2])
    second = world.track.pose_at(8.0) if into == "a car" else behind_bot
    put(world, buffers, np.array([[world.track.pose_at(8.2), second]]))
    world.step(np.full((1, 2), SLOW), buffers)
    # The bot comes first among what each finds around it, the other car second.
    assert world.reports["object_hit"].tolist() == ([[1, 1]] if into == "a car" else [[-1, 0]])
    assert world.reports["is_crashed"].tolist() == [[False, True]]
    assert (world._objects.states["driven"] - driven).item() == pytest.approx(0.5 / 15)


def test_at_aws_corners_and_places_on_the_lap_decide():
    chance = np.random.default_rng(3)
    world = make_world(2000, 2, camera_config=CameraConfig(8, 6), race_config=RaceConfig(fidelity="aws"))
    buffers = begin(world)
    poses = near_the_line(world, chance, 0.15, 0.3)
    put(world, buffers, poses)
    noses = world.cars["arc"]
    world.step(np.zeros((2000, 2), int), buffers)
    for n in range(2000):
        for m in range(2):
            corners = shapely.points(rectangle(poses[n, m]).exterior.coords[:4])
            inside = shapely.contains(rectangle(poses[n, 1 - m]), corners).any()
            assert (world.reports["object_hit"][n, m] == 0) == inside
            assert world.reports["is_crashed"][n, m] == (inside and noses[n, m] < noses[n, 1 - m])


def test_who_is_hit_drives_on_and_who_hits_starts_again():
    world = make_world()
    buffers = begin(world)
    first = world.cars[0, 0]
    poses = np.array([[[first["x"], first["y"], first["yaw"]]] * 2])
    poses[0, 1, 0] -= 0.35  # the road runs east here
    put(world, buffers, poses, speed=np.array([[0.5, 2.0]]))
    for _ in range(6):
        world.step(np.array([[SLOW, FAST]]), buffers)
        if buffers.terminated.any():
            break
    assert buffers.terminated.tolist() == [[False, True]]
    assert [race.STATUSES[code] for code in world.reports["status"][0]] == ["in_progress", "crashed"]
    assert world.reports["object_hit"].tolist() == [[0, 0]]
    assert world.cars["ticks"][0].tolist()[1] == 0
    world.step(np.array([[SLOW, FAST]]), buffers)
    assert not buffers.terminated.any()


def reference(world, poses, speeds, own, front):
    """Return the object keys of one car, the slow way (facts 3.1)."""
    line, track = shapely.LineString(world.track.centre), world.track
    ring = shapely.Polygon(track.centre).symmetric_difference(shapely.Polygon(track.inner))
    boxes = world.seen_boxes[0]
    others = [k for k in range(len(poses)) if k != own]
    spots = np.concatenate([boxes[:, :2], poses[others, :2]])
    points = shapely.points(spots)
    arcs = line.project(points)
    ahead = (arcs - line.project(shapely.Point(front))) % track.length
    ahead[ahead == 0] = track.length
    return {
        "objects_location": spots,
        "objects_left_of_center": [bool(ring.contains(point)) == track.is_ccw for point in points],
        "objects_distance": arcs,
        "objects_distance_from_center": shapely.distance(points, line),
        "objects_heading": np.append(np.zeros(len(boxes)), poses[others, 2]),
        "objects_speed": np.append(np.zeros(len(boxes)), speeds[others]),
        "closest_objects": [int(np.argmax(ahead)), int(np.argmin(ahead))],
    }


def test_every_object_key_tells_of_boxes_and_of_the_other_cars():
    told = []
    world = make_world(1, 4, lambda params: told.append(params) or 0.0, objects=BoxesConfig(number=2))
    buffers, chance, checked = begin(world), np.random.default_rng(5), 0
    for _ in range(60):
        told.clear()
        cars = world.cars[0]
        poses = np.column_stack([cars["x"], cars["y"], cars["yaw"]])
        world.step(chance.integers(0, 6, (1, 4)), buffers)
        called = np.flatnonzero(world.reports["status"][0] != race.PREPARE)
        for own, params in zip(called, told, strict=True):
            expected = reference(world, poses, cars["speed"], own, (params["x"], params["y"]))
            on_road = np.array(expected["objects_distance_from_center"]) < 0.37  # beside it the ring tells nothing
            sides = np.array(params["objects_left_of_center"]) == expected.pop("objects_left_of_center")
            assert sides[on_road].all()
            for name, value in expected.items():
                assert np.array(params[name]) == pytest.approx(np.array(value), abs=1e-9), name
            checked += 1
    assert checked > 150


def test_nobody_meets_a_parked_car():
    told = []
    world = make_world(1, 3, lambda params: told.append(params) or 0.0, camera_config=CameraConfig(40, 30))
    buffers = begin(world)
    for _ in range(2):
        world.step(np.zeros((1, 3), int), buffers)
    world.freeze(np.array([[False, True, False]]))
    told.clear()
    world.step(np.full((1, 3), SLOW), buffers)
    assert [len(params["objects_location"]) for params in told] == [1, 1]
    last, first = world.cars[0, 2], world.cars[0, 0]
    pair = make_world(1, 2, camera_config=CameraConfig(40, 30))
    other = begin(pair)
    put(pair, other, np.array([[[car["x"], car["y"], car["yaw"]] for car in (first, last)]]))
    for name in (CAMERA_NAME, CRITIC_NAME):
        shown = other.observations[name][0, 1]
        assert np.array_equal(buffers.observations[name][0, 2][:3], shown[:3]), name


def test_a_car_that_waits_is_let_through_and_its_clock_runs():
    world = make_world(reward=lambda params: 1.0)
    buffers = begin(world)
    pose = [float(world.cars[0, 0][name]) for name in ("x", "y", "yaw")]
    put(world, buffers, np.array([[pose, pose]]), held=np.array([[3, 0]]))
    for waited in range(3):
        world.step(np.array([[FAST, 0]]), buffers)
        assert race.STATUSES[world.reports["status"][0, 0]] == "pause"
        assert world.reports["object_hit"].tolist() == [[-1, -1]]
        assert buffers.reward.tolist() == [[0.0, 1.0]]
        assert world.reports["steps"][0, 0] == waited + 1
        assert world.cars[0, 0]["x"] == pose[0]
    world.step(np.array([[FAST, 0]]), buffers)
    assert race.STATUSES[world.reports["status"][0, 0]] != "pause"


def test_a_car_that_is_put_back_starts_ahead_of_another():
    world = make_world(3, 2, start_ahead=1.5, race_config=RaceConfig(max_episode_seconds=3.0))
    buffers, put_back = begin(world), 0
    for _ in range(100):
        world.step(np.tile([SLOW, FAST], (3, 1)), buffers)
        for n, m in np.argwhere(buffers.ended & ~buffers.ended[:, ::-1]):
            cars = world.cars[n]
            gap = (cars[m]["start_share"] * world.track.length - cars[1 - m]["arc"]) % world.track.length
            assert gap == pytest.approx(1.5, abs=1e-9)
            put_back += 1
    assert put_back > 3


def test_the_faster_car_starts_behind_the_slower_one_and_that_one_ahead_of_it():
    world = make_world(3, 2, start_ahead=1.5, race_config=RaceConfig(max_episode_seconds=3.0))
    world.profiles["speed_gain"][:, 1] *= 0.5
    buffers, put_back = begin(world), [0, 0]
    for _ in range(100):
        world.step(np.tile([SLOW, FAST], (3, 1)), buffers)
        for n, m in np.argwhere(buffers.ended & ~buffers.ended[:, ::-1]):
            cars = world.cars[n]
            gap = (cars[m]["start_share"] * world.track.length - cars[1 - m]["arc"]) % world.track.length
            assert gap == pytest.approx(1.5 if m == 1 else world.track.length - 1.5, abs=1e-9)
            put_back[m] += 1
    assert min(put_back) > 0


def test_another_camera_sees_what_a_world_of_such_cameras_shows():
    """By twin: a frame of 40 x 30 asked of a world of 16 x 12 is that of a world of 40 x 30; so are two eyes."""
    for sensors in (FRONT_CAMERA, car_sensors(("STEREO_CAMERAS",), None)):
        small = make_world(2, 3)
        large = make_world(2, 3, camera_config=CameraConfig(40, 30), sensors=sensors)
        begin(small)
        shown = begin(large)
        rows = np.array([(0, 2), (1, 1)])
        camera = Camera(build_scene(small.drawn_track, "2026"), 40, 30, MOUNT_V3)
        (found,) = small.look_with(camera, sensors, rows).values()
        expected = shown.observations[sensors.camera_name][rows[:, 0], rows[:, 1]]
        assert found.shape == expected.shape
        assert np.abs(found.astype(int) - expected).max() == 0
