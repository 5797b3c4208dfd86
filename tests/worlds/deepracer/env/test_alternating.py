"""Cars that turn round after each episode: the exam, and each direction as it is driven alone."""

import numpy as np
import pytest
from tests.worlds.deepracer.env.test_multi_course import ACTIONS, course

from racecraft.contract.conformance import WorldConformance
from racecraft.contract.errors import ContractError
from racecraft.contract.world import allocate
from racecraft.worlds.deepracer.env.alternating import SEED_APART, AlternatingWorld
from racecraft.worlds.deepracer.env.settings import CameraConfig, RaceConfig
from racecraft.worlds.deepracer.env.variation import VariationConfig
from racecraft.worlds.deepracer.env.world import RaceWorld
from racecraft.worlds.deepracer.tracks.catalogue import load_track


def pair(cars):
    return [course("reinvent_base", cars, reverse) for reverse in (False, True)]


class TestInTurnSitsTheExam(WorldConformance):
    ticks = 60

    def make_world(self, num_worlds):
        return AlternatingWorld(*pair(num_worlds))


def test_each_car_drives_one_episode_one_way_and_the_next_the_other_as_it_would_there_alone():
    """By twin: what a car saw and earned in a direction is what it sees and earns in that direction's world alone."""
    world, rng = AlternatingWorld(*pair(2)), np.random.default_rng(0)
    buffers = allocate(world.spec)
    world.reset(buffers, 3)
    steps, ways, numbers = [], [[False], [True]], [[], []]
    for _ in range(160):
        seen = {name: part.copy() for name, part in buffers.observations.items()}
        way, actions = [ways[0][-1], ways[1][-1]], rng.integers(0, 3, (2, 1))
        world.step(actions, buffers)
        steps.append((way, seen, actions, buffers.reward.copy()))
        for car in np.flatnonzero((buffers.terminated | buffers.truncated)[:, 0]):
            numbers[car].append(int(world.reports["episode"][car, 0]))
            ways[car].append(not ways[car][-1])
    assert min(map(len, ways)) >= 3
    assert numbers == [list(range(len(one) - 1)) for one in ways], "episodes are numbered through both directions"
    assert len(world.pop_episodes()) == sum(map(len, numbers))
    for other, alone in enumerate(pair(2)):
        own = allocate(alone.spec)
        for car in range(2):
            alone.reset(own, 3 + other * SEED_APART)
            for way, seen, actions, reward in steps:
                if way[car] == other:
                    assert all(np.array_equal(own.observations[name][car], part[car]) for name, part in seen.items())
                    alone.step(actions, own)
                    assert own.reward[car] == reward[car]


def test_a_car_that_drives_on_over_the_finish_does_not_turn():
    def driving_on(reverse):
        return RaceWorld(
            load_track("Oval_track"), ACTIONS, race_config=RaceConfig(reverse=reverse), drive_seconds=1000.0,
            camera_config=CameraConfig(16, 12),
        )  # fmt: skip

    world = AlternatingWorld(driving_on(False), driving_on(True))
    buffers = allocate(world.spec)
    world.reset(buffers, 0)
    first = world.ways[0]
    for _ in range(2):
        world.step(np.ones((1, 1), np.int64), buffers)
    first._cars["laps"], first._cars["progress"] = 0, 99.99
    for _ in range(40):
        world.step(np.ones((1, 1), np.int64), buffers)
        if buffers.truncated.any():
            break
    assert world.pop_episodes()[0].status == "lap_complete"
    assert first.reports["terminated"].sum() == 0
    world.step(np.ones((1, 1), np.int64), buffers)
    assert first.reports["steps"][0, 0] == 1.0, "the next episode goes on in the same direction"


def test_what_episodes_drew_is_that_of_the_direction_that_was_driven():
    def varied(reverse):
        return RaceWorld(
            load_track("Oval_track"), ACTIONS, num_cars=2, camera_config=CameraConfig(16, 12),
            race_config=RaceConfig(reverse=reverse), variation=VariationConfig(level="strong"),
        )  # fmt: skip

    world = AlternatingWorld(varied(False), varied(True))
    buffers = allocate(world.spec)
    world.reset(buffers, 1)
    world.step(np.ones((2, 1), np.int64), buffers)
    for car in (0, 1):
        assert world.variation[car].tobytes() == world.ways[car].variation[car].tobytes()
    assert world.ways[0].variation[1].tobytes() != world.ways[1].variation[1].tobytes()


@pytest.mark.parametrize("first_car", [0, 1])
def test_which_way_a_car_begins_goes_by_its_number_whoever_drives_those_before(first_car):
    world = AlternatingWorld(*pair(1), first_car=first_car)
    buffers = allocate(world.spec)
    world.reset(buffers, 0)
    world.step(np.ones((1, 1), np.int64), buffers)
    heading = load_track("reinvent_base").reversed() if first_car else load_track("reinvent_base")
    assert world.reports["yaw"][0, 0] == pytest.approx(heading.pose_at_share(0.0).yaw, abs=1e-6)


def test_directions_of_other_cars_are_refused():
    with pytest.raises(ContractError, match="not the same cars"):
        AlternatingWorld(course("reinvent_base", 1), course("reinvent_base", 1, True, camera=(20, 15)))
