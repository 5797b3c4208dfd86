"""Bots on their rails: where they drive, how fast, when they change lanes and when they stand."""

import math

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

from racecraft.contract.conformance import WorldConformance
from racecraft.contract.errors import SettingError
from racecraft.contract.world import allocate
from racecraft.worlds.deepracer.env import race
from racecraft.worlds.deepracer.env.actions import ActionTable
from racecraft.worlds.deepracer.env.lanes import cubic_spline, lane_splines
from racecraft.worlds.deepracer.env.objects import BOT_CAR
from racecraft.worlds.deepracer.env.settings import BotsConfig, CameraConfig, RaceConfig
from racecraft.worlds.deepracer.env.vehicle import TICK_SECONDS
from racecraft.worlds.deepracer.env.world import RaceWorld
from racecraft.worlds.deepracer.tracks.catalogue import load_track

ACTIONS = ActionTable.of([(math.radians(angle), speed) for angle in (-30, 0, 30) for speed in (0.1, 1.0)])
CRAWL = np.array([[2]])


def make_world(bots=None, worlds=1, reward=None, fidelity="sane", track="reinvent_base", **options):
    config = RaceConfig(type="HEAD_TO_BOT", fidelity=fidelity)
    return RaceWorld(
        load_track(track), ACTIONS, reward, race_config=config, camera_config=CameraConfig(16, 12),
        num_cars=worlds, objects=bots, **options,
    )  # fmt: skip


def begin(world, seed=0):
    buffers = allocate(world.spec)
    world.reset(buffers, seed)
    return buffers


class TestHeadToBot(WorldConformance):
    """Bots that change lanes sit the exam."""

    ticks = 60

    def make_world(self, num_worlds):
        bots = BotsConfig(random=True, lane_change=True, lane_change_after_low=0.3, lane_change_after_high=1.0)
        return make_world(bots, num_worlds)


@pytest.mark.parametrize("closed", [True, False])
def test_a_spline_is_that_of_scipy(closed):
    chance = np.random.default_rng(1)
    knots, points = np.cumsum(chance.uniform(0.1, 0.5, 30)), chance.uniform(-1, 1, (30, 2))
    if closed:
        points[-1] = points[0]
    expected = CubicSpline(knots, points, bc_type="periodic" if closed else "natural")
    # Ours are (piece, axis, rising power), SciPy's (falling power, piece, axis).
    found = cubic_spline(knots, points, closed)
    assert found == pytest.approx(expected.c[::-1].transpose(1, 2, 0), abs=1e-9)


@pytest.mark.parametrize("name", ["reinvent_base", "reInvent2019_track", "2022_april_open_cw"])
def test_the_lanes_run_half_way_to_the_borders_and_close(name):
    track = load_track(name)
    knots, cubics = lane_splines(track)
    for side, lane in enumerate(cubics):
        place = track.locate(lane[:, :, 0])
        border = place.inner_point if (side == 1) == track.is_ccw else place.outer_point
        half = np.hypot(*(border - place.centre_point).T)
        assert place.distance == pytest.approx(0.5 * half, abs=0.05)
        powers = np.diff(knots)[-1] ** np.arange(4)
        assert lane[-1] @ powers == pytest.approx(lane[0, :, 0], abs=1e-9)


def test_bots_drive_at_their_speed_and_face_where_they_go():
    world = make_world(BotsConfig(speed=0.6, number=3))
    buffers = begin(world)
    before, driven = world.boxes[0], world._objects.states["driven"][0].copy()
    assert (world.kinds == BOT_CAR).all()
    for _ in range(30):
        world.step(CRAWL, buffers)
        after = world.boxes[0]
        way = after[:, :2] - before[:, :2]
        assert np.hypot(*way.T) == pytest.approx(0.6 * TICK_SECONDS, rel=0.7)  # more outside of a bend, less inside
        turn = np.arctan2(way[:, 1], way[:, 0]) - after[:, 2]
        assert np.abs(np.angle(np.exp(1j * turn))).max() < 0.08
        before = after
    way = (world._objects.states["driven"][0] - driven) % world.track.length  # one of them crosses the start line
    assert way == pytest.approx(30 * 0.6 * TICK_SECONDS)


def test_a_bot_that_changes_lanes_faces_where_it_goes():
    bots = BotsConfig(
        number=3, speed=0.6, lane_change=True, lane_change_after_low=0.2, lane_change_after_high=0.4,
        lane_change_distance=1.5,
    )  # fmt: skip
    world = make_world(bots)
    buffers, worst, before = begin(world), 0.0, None
    world.freeze(np.ones((1, 1), bool))  # nobody is in their way
    for _ in range(60):
        world.step(CRAWL, buffers)
        after = world.boxes[0]
        if before is not None:
            way = (after[:, :2] - before[:, :2]) @ [1.0, 1j]
            facing = np.exp(1j * before[:, 2]) + np.exp(1j * after[:, 2])
            worst = max(worst, np.abs(np.angle(way / facing)).max())
        before = after
    assert worst < 0.02


def test_lanes_are_changed_within_the_distance_and_not_before_the_time():
    bots = BotsConfig(
        number=1, speed=1.0, lane_change=True, lane_change_after_low=1.0, lane_change_after_high=2.0,
        lane_change_distance=1.0,
    )  # fmt: skip
    world = make_world(bots, worlds=20)
    buffers, sides, changing = begin(world), [], []
    world.freeze(np.ones((20, 1), bool))
    for _ in range(120):
        world.step(np.full((20, 1), 2), buffers)
        states = world._objects.states[:, 0]
        sides.append(states["is_left"].copy())
        changing.append(states["change_driven"] >= 0)
    sides, changing = np.array(sides), np.array(changing)
    assert (np.diff(sides.astype(int), axis=0) != 0).sum(axis=0).min() >= 2
    keeps = [run for column in changing.T for run in np.diff(np.flatnonzero(np.diff(column.astype(int))))]
    assert min(keeps) >= 15 - 1  # one second, either of keeping the lane or of changing it over one metre
    assert max(keeps) <= 30 + 1


def hit_from_behind(fidelity, car_arc, bot_arc):
    """Return the report and bots of a tick in which a car and a bot touch, with their places on the lap."""
    world = make_world(BotsConfig(number=2, speed=0.5, penalty=1.0), fidelity=fidelity)
    buffers = begin(world)
    world.step(CRAWL, buffers)
    car = world._cars[0, 0]
    box = world._objects.boxes[0, 0]
    box[0], box[1], box[2] = car["x"] - 0.2 * math.cos(car["yaw"]), car["y"] - 0.2 * math.sin(car["yaw"]), car["yaw"]
    world._cars["arc"][0, 0] = car_arc % world.track.length
    world._objects.states["arc"][0, 0] = bot_arc % world.track.length
    world.step(CRAWL, buffers)
    return world, buffers


def test_a_bot_that_runs_into_a_car_is_to_blame_and_all_bots_stand_for_the_penalty():
    world, buffers = hit_from_behind("sane", 1.0, 0.7)
    report = world.reports[0, 0]
    assert report["object_hit"] == 0
    assert not report["is_crashed"]
    assert race.STATUSES[report["status"]] == "in_progress"
    driven = world._objects.states["driven"].copy()
    world._objects.boxes[0, 0, :2] = 50.0  # out of the car's way again
    stood = 0
    while (world._objects.states["driven"] == driven).all() and stood < 60:
        world.step(CRAWL, buffers)
        stood += 1
    assert stood in (15, 16), "a second, that of the hit in it; rounding may leave a tick over"


def test_who_is_behind_is_told_across_the_start_line_but_not_at_aws():
    assert not hit_from_behind("sane", 0.1, -0.2)[0].reports["is_crashed"][0, 0]
    assert hit_from_behind("aws", 0.1, -0.2)[0].reports["is_crashed"][0, 0]
    assert hit_from_behind("sane", 0.7, 1.0)[0].reports["is_crashed"][0, 0]


def test_a_reward_is_told_speed_and_heading_of_bots():
    told = []
    world = make_world(BotsConfig(speed=0.4), reward=lambda params: told.append(params) or 0.0)
    buffers = begin(world)
    for _ in range(5):
        world.step(CRAWL, buffers)
    assert told[-1]["objects_speed"] == [0.4] * 3
    assert told[-1]["objects_heading"] == world.seen_boxes[0, :, 2].tolist()
    assert told[-1]["objects_location"] == world.seen_boxes[0, :, :2].tolist()
    assert told[-1]["objects_location"] != told[-2]["objects_location"]


def test_the_least_time_in_a_lane_is_no_longer_than_the_most():
    with pytest.raises(SettingError, match="no longer than the most"):
        make_world(BotsConfig(lane_change_after_low=6.0))


def test_a_route_file_that_repeats_a_row_has_lanes_all_the_same(tmp_path):
    own = load_track("reinvent_base")
    rows = np.hstack([own.centre, own.inner, own.outer])
    np.save(tmp_path / "mine.npy", np.insert(rows, 40, rows[40], axis=0))
    track = load_track(str(tmp_path / "mine.npy"))
    knots, cubics = lane_splines(track)
    assert np.isfinite(cubics).all()
    assert (np.diff(knots) > 0.0).all()
    assert len(knots) == len(own.arc)
