"""Boxes on the road: what touches what, where they go, what a reward is told of them, how an episode ends on one."""

import math

import numpy as np
import pytest
import shapely

from racecraft.contract.conformance import WorldConformance
from racecraft.contract.errors import SettingError
from racecraft.contract.world import allocate
from racecraft.worlds.deepracer.env import race
from racecraft.worlds.deepracer.env.actions import ActionTable
from racecraft.worlds.deepracer.env.kernels.objects import (
    corner_inside,
    hits,
    objects_around,
    rectangles_touch,
)
from racecraft.worlds.deepracer.env.objects import (
    CLEAR_AHEAD_M,
    CLEAR_BEHIND_M,
    DEEPRACER_BOX,
    KINDS,
    OBJECT_STATE,
    no_objects,
    read_positions,
)
from racecraft.worlds.deepracer.env.race_spec import CRITIC_NAME
from racecraft.worlds.deepracer.env.settings import BoxesConfig, CameraConfig, RaceConfig
from racecraft.worlds.deepracer.env.world import RaceWorld
from racecraft.worlds.deepracer.tracks.catalogue import load_track

ACTIONS = ActionTable.of([(math.radians(angle), speed) for angle in (-30, 0, 30) for speed in (0.5, 1.0)])
STRAIGHT_SLOW = 2
CAR_HALVES = 0.5 * 0.32352, 0.5 * 0.1961  # facts 1.1


def make_world(boxes=None, worlds=1, track="reinvent_base", reward=None, race_config=None, **options):
    race_config = race_config or RaceConfig(type="OBJECT_AVOIDANCE")
    options.setdefault("camera_config", CameraConfig(16, 12))
    return RaceWorld(
        load_track(track), ACTIONS, reward, race_config=race_config, num_cars=worlds, objects=boxes, **options
    )


def begin(world, seed=0):
    buffers = allocate(world.spec)
    world.reset(buffers, seed)
    return buffers


def polygons(poses, halves):
    """Return rectangles as Shapely polygons: poses (R, 3), half lengths and widths (R, 2)."""
    signs = np.array([(1, 1), (-1, 1), (-1, -1), (1, -1)])
    local = signs * halves[:, None, :]
    cos, sin = np.cos(poses[:, 2])[:, None], np.sin(poses[:, 2])[:, None]
    x = poses[:, :1] + cos * local[..., 0] - sin * local[..., 1]
    y = poses[:, 1:2] + sin * local[..., 0] + cos * local[..., 1]
    return shapely.polygons(np.stack([x, y], axis=-1))


class TestObjectAvoidance(WorldConformance):
    """Boxes at random sit the exam."""

    ticks = 60

    def make_world(self, num_worlds):
        config = RaceConfig(type="OBJECT_AVOIDANCE", max_episode_seconds=1.5)
        return make_world(worlds=num_worlds, race_config=config)


@pytest.fixture(scope="module")
def pairs():
    """20 000 pairs of rectangles near one another, and their polygons."""
    chance = np.random.default_rng(12)
    count = 20_000
    poses = [np.column_stack([chance.uniform(-0.5, 0.5, (count, 2)), chance.uniform(-9, 9, count)]) for _ in range(2)]
    halves = [chance.uniform(0.02, 0.4, (count, 2)) for _ in range(2)]
    return poses, halves, [polygons(pose, half) for pose, half in zip(poses, halves, strict=True)]


def told_by(kernel, pairs):
    (one, other), (half, other_half), _ = pairs
    rows = np.column_stack([one, half, other, other_half]).tolist()
    return np.array([kernel(*row) for row in rows])


def test_rectangles_touch_where_shapely_says_so(pairs):
    shapes, others = pairs[2]
    expected = shapely.intersects(shapes, others)
    assert 0.2 < expected.mean() < 0.8
    assert (told_by(rectangles_touch, pairs) == expected).all()


def test_a_corner_is_inside_where_shapely_says_so(pairs):
    shapes, others = pairs[2]
    corners = shapely.points(shapely.get_coordinates(shapes).reshape(-1, 5, 2)[:, :4])
    expected = shapely.intersects(corners, others[:, None]).any(axis=1)
    assert (told_by(corner_inside, pairs) == expected).all()
    assert (expected != shapely.intersects(shapes, others)).mean() > 0.02  # what the original does not feel


@pytest.mark.parametrize(("speed", "spare"), [(0.0, 0.05), (1.0, 0.0)])
def test_at_aws_a_box_that_stands_is_felt_five_centimetres_before_its_sides(speed, spare):
    """A box of 0.4 by 0.3 m is one of 0.5 by 0.4 to a corner of the car (facts 3.5); one that drives is as it is."""
    chance = np.random.default_rng(5)
    places = np.column_stack([chance.uniform(-0.5, 0.5, (4000, 2)), chance.uniform(-9, 9, 4000)])
    cars = shapely.get_coordinates(polygons(places, np.tile(CAR_HALVES, (4000, 1)))).reshape(-1, 5, 2)[:, :4]
    felt = polygons(np.array([[0.1, -0.1, 0.4]]), np.array([[0.2 + spare, 0.15 + spare]]))[0]
    expected = shapely.intersects(shapely.points(cars), felt).any(axis=1)
    plan = no_objects()._replace(kinds=np.zeros(1, np.int64), corners_only=True, speed=speed)
    boxes = np.array([[0.1, -0.1, 0.4, 0.2, 0.15, 0.33]])
    assert [hits.py_func(plan, boxes, None, 0, *place) for place in places.tolist()] == expected.tolist()


def test_random_places_keep_their_distance_and_every_start_clear():
    config = RaceConfig(type="OBJECT_AVOIDANCE", start_advance=0.37, max_episode_seconds=1)
    world = make_world(BoxesConfig(number=6, min_distance=1.5), worlds=40, race_config=config)
    buffers, length = begin(world), world.track.length
    places = []
    for _ in range(60):
        cars, arcs = world.cars[:, 0], np.sort(world._objects.states["arc"], axis=1)
        gaps = np.diff(arcs, axis=1, append=arcs[:, :1] + length)
        assert (gaps > 1.5 - 0.05).all()  # a box in a bend projects a little off its place
        starts = cars["ticks"] == 0
        past_start = (world._objects.states["arc"] - cars["start_share"][:, None] * length)[starts] % length
        assert (past_start > CLEAR_AHEAD_M - 0.05).all()
        assert (past_start < length - CLEAR_BEHIND_M + 0.05).all()
        places.append(arcs)
        world.step(np.full((40, 1), STRAIGHT_SLOW), buffers)
    assert world.cars["episode"].min() >= 3
    assert len(np.unique(np.concatenate(places).round(9), axis=0)) > 120  # every world, every episode has its own


def test_places_are_spread_over_the_whole_lap_and_both_lanes():
    world = make_world(BoxesConfig(number=3), worlds=400)
    begin(world)
    states = world._objects.states
    past_start = (states["arc"] - world.start_shares[:, None] * world.track.length) % world.track.length
    counts, _ = np.histogram(past_start, bins=5, range=(CLEAR_AHEAD_M, world.track.length - CLEAR_BEHIND_M))
    assert counts.min() > 0.6 * counts.mean()
    assert 0.42 < (states["lane"] > 0).mean() < 0.58


def test_fixed_places_are_spread_lane_by_lane():
    world = make_world(BoxesConfig(number=4, random=False, min_distance=2.0))
    begin(world)
    states = world._objects.states[0]
    assert states["arc"] == pytest.approx(np.linspace(2.0, world.track.length - 1.0, 4), abs=0.05)
    assert world.track.is_ccw
    assert states["is_left"].tolist() == [True, False, True, False]  # inner, outer, inner …
    assert states["centre_distance"] == pytest.approx(0.762 / 4, abs=0.01)


def test_listed_places_say_how_many_and_where():
    world = make_world(BoxesConfig(positions="0.25,-1; 0.5,1;0.75,2", type="deepracer_box_obstacle"))
    begin(world)
    states = world._objects.states[0]
    assert states["arc"] / world.track.length == pytest.approx([0.25, 0.5, 0.75], abs=2e-3)
    assert states["is_left"].tolist() == [False, True, True]
    assert (world.kinds == DEEPRACER_BOX).all()
    assert (2 * world.boxes[0, :, 3] == KINDS[DEEPRACER_BOX].length).all()


@pytest.mark.parametrize(
    ("asked", "said"),
    [
        ({"number": 40}, "at most"),
        ({"number": 60, "random": False}, "at most"),
        ({"type": "crate"}, "crate"),
        ({"positions": "0.5,1;0.505,1"}, "overlap"),
    ],
)
def test_what_cannot_be_placed_is_named(asked, said):
    with pytest.raises(SettingError, match=said):
        make_world(BoxesConfig(**asked))


def test_a_start_on_a_box_moves_to_the_free_lane_and_past_a_blocked_road_further_back():
    world = make_world(BoxesConfig(positions="0.0,1;0.5,1;0.5,-1"), worlds=2, start_shares=[0.0, 0.5])
    begin(world)
    beside, behind = world.cars[:, 0]
    assert beside["start_share"] == 0.0
    assert beside["border_inner"] > beside["border_outer"]  # the box stands in the inner lane
    assert behind["start_share"] == pytest.approx(0.5 - race.START_GAP_M / world.track.length)
    poses = np.array([[car["x"], car["y"], car["yaw"]] for car in (beside, behind)])
    shapes = polygons(poses, np.tile(CAR_HALVES, (2, 1)))
    for box in world.boxes[0]:
        assert (shapely.distance(shapes, polygons(box[None, :3], box[None, 3:5])[0]) > 0.09).all()


def test_random_boxes_leave_the_whole_grid_its_room():
    world = make_world(BoxesConfig(number=6), worlds=64, cars_per_world=4, start_shares=[0.3] * 64)
    begin(world)
    length = world.track.length
    behind = (0.3 * length - world._objects.states["arc"]) % length
    assert (behind > 4 * CLEAR_BEHIND_M - 0.05).all()  # a box in a bend projects a little off its place
    assert (behind < 4 * CLEAR_BEHIND_M + 1.0).any(), "the room ends where it is said to"
    assert np.allclose(world.cars["start_share"][:, 0], 0.3)


@pytest.mark.parametrize("track", ["reinvent_base", "2022_april_open_cw"])
@pytest.mark.parametrize("reverse", [False, True])
def test_the_inner_lane_is_inside_whichever_way_round(track, reverse):
    race_config = RaceConfig(type="OBJECT_AVOIDANCE", reverse=reverse)
    world = make_world(BoxesConfig(positions="0.3,1;0.6,-1"), track=track, race_config=race_config)
    begin(world)
    middles = world.boxes[0, :, :2]
    place = world.track.locate(middles)
    to_inner, to_outer = (np.hypot(*(edge - middles).T) for edge in (place.inner_point, place.outer_point))
    assert (to_inner < to_outer).tolist() == [True, False]


@pytest.mark.parametrize("lane", [1, -1])
def test_a_start_behind_a_box_is_in_the_other_lane(lane):
    """The box stands 0.7 m ahead, out of reach of the car, whose own lane it is all the same."""
    world = make_world(BoxesConfig(positions=f"0.04,{lane}"), start_shares=[0.0])
    begin(world)
    car = world.cars[0, 0]
    assert car["start_share"] == 0.0
    assert (car["border_inner"] > car["border_outer"]) == (lane == 1)


def test_driving_into_a_box_is_a_crash_that_ends_the_episode():
    world = make_world(BoxesConfig(positions="0.08,1;0.08,-1"), reward=lambda params: float(params["is_crashed"]))
    buffers = begin(world)
    for _ in range(200):
        world.step(np.array([[STRAIGHT_SLOW]]), buffers)
        report = world.reports[0, 0]
        shape = polygons(np.array([[report["x"], report["y"], report["yaw"]]]), np.array([CAR_HALVES]))[0]
        boxes = polygons(world.seen_boxes[0, :, :3], world.seen_boxes[0, :, 3:5])
        assert bool(report["is_crashed"]) == shapely.intersects(boxes, shape).any()
        if report["is_crashed"]:
            break
    assert report["steps"] > 6
    assert race.STATUSES[report["status"]] == "crashed"
    assert buffers.terminated[0, 0]
    assert buffers.reward[0, 0] == 1.0
    assert world.pop_episodes()[0].status == "crashed"


def reference_params(track, boxes, front):
    """Return the object keys as facts 3.1 tell them, the slow way."""
    line = shapely.LineString(track.centre)
    ring = shapely.Polygon(track.centre).symmetric_difference(shapely.Polygon(track.inner))
    points = shapely.points(boxes[:, :2])
    arcs = line.project(points)
    car = line.project(shapely.Point(front))
    ahead = (arcs - car) % track.length
    ahead[ahead == 0] = track.length
    return {
        "objects_location": boxes[:, :2].tolist(),
        "objects_left_of_center": [bool(ring.contains(point)) == track.is_ccw for point in points],
        "objects_distance": arcs.tolist(),
        "objects_distance_from_center": shapely.distance(points, line).tolist(),
        "objects_heading": [0.0] * len(boxes),
        "objects_speed": [0.0] * len(boxes),
        "closest_objects": [int(np.argmax(ahead)), int(np.argmin(ahead))],
    }


def test_an_object_level_with_the_car_is_the_previous_one_and_never_the_next():
    states = np.zeros(2, OBJECT_STATE)
    states["arc"] = 3.0, 5.0
    assert objects_around(states, 3.0, 10.0) == (0, 1)
    assert objects_around(states, 5.0, 10.0) == (1, 0)
    assert objects_around(states[:1], 3.0, 10.0) == (0, 0)


@pytest.mark.parametrize("track", ["reinvent_base", "2022_april_open_cw"])
def test_every_object_key_is_that_of_a_slow_reference(track):
    told = []
    world = make_world(worlds=6, track=track, reward=lambda params: told.append(params) or 0.0)
    buffers, checked = begin(world), 0
    chance = np.random.default_rng(3)
    for _ in range(40):
        told.clear()
        world.step(chance.integers(0, 6, (6, 1)), buffers)
        called = np.flatnonzero(world.reports["status"][:, 0] != race.PREPARE)
        for n, params in zip(called, told, strict=True):
            expected = reference_params(world.track, world.seen_boxes[n], (params["x"], params["y"]))
            for name, value in expected.items():
                assert np.array(params[name]) == pytest.approx(np.array(value), abs=1e-9), name
            checked += 1
    assert checked > 150


def test_the_next_object_is_in_the_camera_when_it_is_ahead_and_not_when_the_car_looks_away():
    told = []
    world = make_world(
        BoxesConfig(positions="0.1,1"), reward=lambda params: told.append(params["object_in_camera"]) or 0.0
    )
    buffers = begin(world)
    for _ in range(3):
        world.step(np.array([[STRAIGHT_SLOW]]), buffers)
    assert told[-1]
    for _ in range(60):
        world.step(np.array([[4]]), buffers)  # hard left, until it looks back or is off
        if not told[-1]:
            break
    assert not told[-1]


def test_the_critic_is_told_of_the_two_boxes_ahead():
    world = make_world(BoxesConfig(positions="0.05,1;0.12,-1;0.5,1"))
    buffers = begin(world)
    numbers = buffers.observations[CRITIC_NAME][0, 0, race.CRITIC_NUMBERS :]
    front = world.cars[0, 0]["arc"]
    gaps = world._objects.states[0]["arc"][:2] - front + race.CRITIC_OBJECT_BEHIND_M
    assert numbers[[0, 2]] == pytest.approx(1 - gaps / race.CRITIC_OBJECT_REACH_M, abs=1e-6)
    assert numbers[1] == pytest.approx(0.5, abs=0.02)
    assert numbers[3] == pytest.approx(-0.5, abs=0.02)


def test_at_aws_the_distance_slips_away():
    config = RaceConfig(type="OBJECT_AVOIDANCE", fidelity="aws", start_advance=0.0)
    world = make_world(BoxesConfig(number=6, min_distance=2.0), worlds=20, race_config=config)
    buffers, closest = begin(world), []
    for _ in range(90):
        arcs = np.sort(world._objects.states["arc"], axis=1)
        closest.append(np.diff(arcs, axis=1).min())
        world.step(np.full((20, 1), 4), buffers)
    assert min(closest) < 0.3
    sane = make_world(BoxesConfig(number=6, min_distance=2.0), worlds=20)
    begin(sane)
    assert np.diff(np.sort(sane._objects.states["arc"], axis=1), axis=1).min() > 1.9


def test_at_aws_fixed_boxes_stand_where_the_original_puts_them():
    """Evenly between a metre before the line and 2 m taken per cent of the lap once when the world is made, and once
    more before each episode: 6 cm past the line in the first, 1 cm in the second.
    """
    config = RaceConfig(type="OBJECT_AVOIDANCE", fidelity="aws", max_episode_seconds=1.0)
    world = make_world(BoxesConfig(number=4, random=False, min_distance=2.0), race_config=config)
    buffers, length = begin(world), world.track.length
    for episode in range(2):
        least = 2.0 * (length / 100.0) ** (episode + 2)
        expected = np.linspace(least, length - 1.0, 4)
        np.testing.assert_allclose(world._objects.states["arc"][0], expected, atol=2e-3)
        assert np.sign(world._objects.states["lane"][0]).tolist() == [1, -1, 1, -1], "inner lane first"
        while world.episodes_started == episode:
            world.step(np.full((1, 1), 4), buffers)
    listed = make_world(BoxesConfig(positions="0.23,-1;0.46,1"), race_config=config)
    begin(listed)
    np.testing.assert_allclose(listed._objects.states["arc"][0] / length, [0.23, 0.46], atol=1e-4)


def test_boxes_and_bots_have_the_sizes_and_colours_of_the_original():
    """Length, width and height in m, and RGB of the paint (facts 6.1, 6.2, 1.1)."""
    brown = (122.9, 96.9, 78.8)
    assert [tuple(kind) for kind in KINDS] == [
        ("box_obstacle", 0.40, 0.30, 0.25, brown),
        ("deepracer_box_obstacle", 0.36, 0.265, 0.24, brown),
        ("amazon_box_obstacle", 0.40, 0.30, 0.25, (181.0, 141.0, 99.0)),
        ("bot_car", 0.32352, 0.1961, 0.195, (39.8, 39.8, 39.8)),
    ]


@pytest.mark.parametrize(
    ("text", "places"),
    [
        (" ; ;", []),
        ("0,1;1,-1", [(0.0, True), (1.0, False)]),
        ("0.5, -1 ;0.25,0;0.75,2.5", [(0.5, False), (0.25, True), (0.75, True)]),
    ],
)
def test_places_are_read_as_shares_and_lanes(text, places):
    assert read_positions(text) == places


@pytest.mark.parametrize(
    ("text", "told"),
    [("1.2,1", "lies off the track"), ("nan,1", "lies off the track"), ("0.5,nan", "names no lane"),
     ("0.5", "is no place"), ("half,1", "is no place")],
)  # fmt: skip
def test_a_place_that_cannot_be_read_is_told(text, told):
    with pytest.raises(SettingError, match=told):
        read_positions(text)
