"""Several cars in one world: where they start, what they tell, and that nobody's story leaks into another's."""

import math
from itertools import combinations

import numpy as np
import pytest

from racecraft.contract.conformance import WorldConformance
from racecraft.contract.errors import ContractError, SettingError
from racecraft.contract.world import allocate
from racecraft.worlds.deepracer.env import race
from racecraft.worlds.deepracer.env.actions import ActionBox, ActionTable
from racecraft.worlds.deepracer.env.settings import CameraConfig, RaceConfig
from racecraft.worlds.deepracer.env.vehicle import PROFILES
from racecraft.worlds.deepracer.env.world import RaceWorld
from racecraft.worlds.deepracer.tracks.catalogue import load_track
from racecraft.worlds.deepracer.training.recorder import EpisodeRecorder

ACTIONS = ActionTable.of([(math.radians(angle), speed) for angle in (-30, 0, 30) for speed in (0.5, 2.0)])
LENGTH_M, WIDTH_M = 0.32352, 0.1961  # what the original calls a car in collisions (facts 1.1)


def make_world(worlds=1, cars=4, track="reinvent_base", reward=None, **options):
    options.setdefault("camera_config", CameraConfig(16, 12))
    return RaceWorld(load_track(track), ACTIONS, reward, num_cars=worlds, cars_per_world=cars, **options)


def begin(world, seed=0):
    buffers = allocate(world.spec)
    world.reset(buffers, seed)
    return buffers


def corners(car):
    """Return the four corners of a car's rectangle, (4, 2)."""
    cos, sin = math.cos(car["yaw"]), math.sin(car["yaw"])
    local = np.array([(a * LENGTH_M / 2, b * WIDTH_M / 2) for a, b in ((1, 1), (1, -1), (-1, -1), (-1, 1))])
    return local @ np.array([[cos, sin], [-sin, cos]]) + (car["x"], car["y"])


def overlap(one, other):
    """Tell whether two cars' rectangles meet: no side of either has the other wholly beyond it."""
    a, b = corners(one), corners(other)
    for shape in (a, b):
        for k in range(4):
            edge = shape[(k + 1) % 4] - shape[k]
            axis = np.array([-edge[1], edge[0]])
            if (a @ axis).max() < (b @ axis).min() or (b @ axis).max() < (a @ axis).min():
                return False
    return True


class TestSeveralCars(WorldConformance):
    """Three cars in each world, tables and chance as at AWS, sit the exam."""

    ticks = 60

    def make_world(self, num_worlds):
        config = RaceConfig(fidelity="aws", max_episode_seconds=1.5)
        return make_world(num_worlds, 3, reward=lambda params: params["progress"], race_config=config)


class TestContinuousCars(WorldConformance):
    """Two cars in each world, commanded by numbers, sit the exam."""

    ticks = 60

    def make_world(self, num_worlds):
        return RaceWorld(
            load_track("Oval_track"), ActionBox((-0.5, 0.5), (0.5, 3.0)), lambda params: params["speed"],
            race_config=RaceConfig(max_episode_seconds=1.5), camera_config=CameraConfig(16, 12),
            num_cars=num_worlds, cars_per_world=2,
        )  # fmt: skip


def test_the_reward_is_asked_world_by_world_and_car_by_car():
    asked = []
    world = make_world(2, 3, reward=lambda params: asked.append((params["x"], params["y"])) or float(len(asked)))
    buffers = begin(world)
    for _ in range(2):
        world.step(np.ones((2, 3)), buffers)
    told = world.reports
    assert asked == list(zip(told["front_x"].ravel().tolist(), told["front_y"].ravel().tolist(), strict=True))
    assert buffers.reward.ravel().tolist() == [1, 2, 3, 4, 5, 6]


def test_cars_start_in_two_lanes_behind_one_another():
    """Facts 5.4: odd ones in the inner lane, even ones in the outer, each 0.75 m behind the one before."""
    world = make_world(1, 4, start_shares=[0.5])
    begin(world)
    cars, length = world.cars[0], world.track.length
    # The lanes run beside the centre line, so arcs of front points differ a little from those of the starts.
    np.testing.assert_allclose(np.diff(cars["arc"]), -0.75, atol=0.05)
    assert cars["start_share"] == pytest.approx(0.5 - np.arange(4) * 0.75 / length)
    np.testing.assert_allclose(cars["centre_distance"], 0.761 / 4, atol=0.01)
    inner = cars["border_inner"] < cars["border_outer"]
    assert inner.tolist() == [False, True, False, True]
    assert (cars["wheels_on"] == 4).all()


def test_a_car_alone_starts_on_the_centre_line():
    world = make_world(2, 1)
    begin(world)
    np.testing.assert_allclose(world.cars["centre_distance"], 0.0, atol=5e-3)


@pytest.mark.parametrize("track", ["2022_reinvent_champ_ccw", "Monaco"])
def test_eight_cars_never_start_within_one_another(track):
    """By law, through hundreds of starts: a car that is put down overlaps no other, wherever that one is."""
    world = make_world(6, 8, track, race_config=RaceConfig(max_episode_seconds=2.0, start_advance=0.011))
    buffers = begin(world)
    rng, put_down = np.random.default_rng(0), 0
    for _ in range(120):
        for cars, ended in zip(world.cars, world.cars["ticks"] == 0, strict=True):
            for m in np.flatnonzero(ended):
                put_down += 1
                assert not any(overlap(cars[m], cars[other]) for other in range(8) if other != m)
        world.step(rng.integers(0, 6, (6, 8)), buffers)
    assert put_down > 150
    world.begin_episodes(buffers)
    for cars in world.cars:
        assert not any(overlap(one, other) for one, other in combinations(cars, 2))


def test_on_an_open_track_the_last_car_stands_at_the_start():
    world = make_world(1, 3, "Straight_track", start_shares=[0.0])
    begin(world)
    assert (world.cars["start_share"] * world.track.length)[0] == pytest.approx([1.5, 0.75, 0.0], abs=1e-9)
    assert (world.cars["wheels_on"][0] >= [4, 4, 2]).all(), "the last one's rear wheels stand before the road's end"


def test_more_cars_than_fit_are_refused_with_the_number_that_does():
    with pytest.raises(SettingError, match="expected at most 7 cars"):
        make_world(1, 8, "Straight_track")


def test_every_car_may_answer_in_its_own_way():
    world = make_world(2, 3, profiles=[PROFILES["v6"], PROFILES["v4"], PROFILES["kinematic"]])
    buffers = begin(world)
    for _ in range(3):
        world.step(np.full((2, 3), 3), buffers)
    speeds = world.cars["speed"]
    assert (speeds[0] == speeds[1]).all()
    assert speeds[0, 2] == 2.0, "the ideal car is at once as fast as it is told"
    assert speeds[0, 1] < 0.7 < 1.2 < speeds[0, 0], "the classic car gathers speed by 3 m/s², today's by 10"
    with pytest.raises(ContractError, match="1 profiles for 3 cars"):
        make_world(2, 3, profiles=[PROFILES["v6"]])


def test_every_car_has_its_own_dice():
    """Ticks last as long as chance says at AWS; told the same, the cars of one world and of two go different ways."""
    world = make_world(2, 3, race_config=RaceConfig(fidelity="aws"))
    buffers = begin(world, seed=4)
    for _ in range(6):
        world.step(np.full((2, 3), 3), buffers)
    assert len(set(world.cars["steering"].ravel())) == 6
    assert len({tuple(keys) for keys in world.save_state()["keys"].tolist()}) == 2


def test_episodes_are_told_with_world_and_car():
    world = make_world(2, 3, race_config=RaceConfig(max_episode_seconds=1.0))
    buffers = begin(world)
    for _ in range(15):
        world.step(np.full((2, 3), 2), buffers)
    told = [(episode.world, episode.agent) for episode in world.pop_episodes()]
    assert told == [(n, m) for n in range(2) for m in range(3)]


def test_a_parked_car_stands_while_the_others_of_its_world_drive():
    world = make_world(1, 3)
    buffers = begin(world)
    world.step(np.full((1, 3), 3), buffers)
    world.freeze(np.array([[False, True, False]]))
    before = world.cars
    for _ in range(5):
        world.step(np.full((1, 3), 3), buffers)
    assert (world.cars["x"] != before["x"]).tolist() == [[True, False, True]]
    assert world.reports["status"][0, 1] == race.PARK


def test_the_files_tell_whose_tick_it_was():
    world, recorder = make_world(2, 3, reward=lambda params: params["progress"]), EpisodeRecorder()
    buffers, rewards = begin(world), []
    for _ in range(4):
        actions = np.random.default_rng(0).integers(0, 6, (2, 3))
        world.step(actions, buffers)
        recorder(world, buffers, actions)
        rewards.append(buffers.reward.copy())
    columns = recorder.pop(1)
    assert columns["world"].tolist() == [0] * 12 + [1] * 12
    assert columns["agent"].tolist() == ([0] * 4 + [1] * 4 + [2] * 4) * 2
    assert columns["tick"].tolist() == [1, 2, 3, 4] * 6
    np.testing.assert_array_equal(columns["reward"], np.array(rewards).transpose(1, 2, 0).ravel())


def test_a_race_saved_when_worlds_had_one_car_and_no_lanes_goes_on():
    """Runs of before kept one number a world, (N,), and knew neither lanes nor dice."""
    worlds = [make_world(3, 1), make_world(3, 1)]
    buffers = [begin(world) for world in worlds]
    for row in np.random.default_rng(4).integers(0, 6, (20, 3, 1)):
        worlds[0].step(row, buffers[0])
    saved = {name: array.reshape(3) for name, array in worlds[0].save_state().items()}
    for name in ("car.start_left", "keys"):
        saved.pop(name)
    worlds[1].load_state(saved, buffers[1])
    assert (worlds[0].cars == worlds[1].cars).all()
