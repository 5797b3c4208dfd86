"""What a race world tells of itself, keeps in a file, and makes of an episode: by hand, on a few ticks."""

import numpy as np
import pytest

from racecraft.contract.errors import ContractError
from racecraft.contract.world import EpisodeRecord, allocate
from racecraft.worlds.deepracer.env import race
from racecraft.worlds.deepracer.env.actions import ActionTable
from racecraft.worlds.deepracer.env.sensors import car_sensors
from racecraft.worlds.deepracer.env.settings import BoxesConfig, CameraConfig, RaceConfig
from racecraft.worlds.deepracer.env.world import RaceWorld
from racecraft.worlds.deepracer.tracks.catalogue import load_track

ACTIONS = ActionTable.of([(0.0, 1.0), (0.5, 1.0)])
SMALL = CameraConfig(16, 12)


def world_of(reward=None, sensors=("FRONT_FACING_CAMERA",), **options):
    return RaceWorld(
        load_track("reinvent_base"), ACTIONS, reward, camera_config=SMALL, sensors=car_sensors(list(sensors)), **options
    )


@pytest.mark.parametrize(
    ("options", "told"),
    [
        ({"start_shares": [0.1]}, r"expected \(3,\)"),
        ({"reward": [len] * 5}, "5 reward functions were given; expected one for all or 6"),
    ],
)
def test_what_is_not_there_for_every_car_is_refused(options, told):
    with pytest.raises(ContractError, match=told):
        world_of(num_cars=3, cars_per_world=2, **options)


def test_what_is_shown_of_a_world_is_a_copy():
    world = world_of(sensors=("LEFT_CAMERA", "LIDAR"), objects=BoxesConfig(number=2))
    world.reset(allocate(world.spec), 0)
    for name in ("cars", "boxes", "kinds", "lidar_ranges", "start_shares"):
        part = getattr(world, name)
        before = part.copy()
        part[...] = np.zeros((), part.dtype) if part.dtype.names else 7
        assert (getattr(world, name) == before).all(), name


def test_rewards_are_summed_over_an_episode_and_begin_anew_with_the_next():
    world = world_of(lambda params: 0.5, race_config=RaceConfig(max_episode_seconds=1.0), num_cars=2)
    buffers = allocate(world.spec)
    world.reset(buffers, 0)
    for _ in range(30):
        world.step(np.zeros((2, 1), np.int64), buffers)
    told = world.pop_episodes()
    assert [(one.world, one.steps, one.reward, one.status) for one in told] == [
        (0, 15, 7.0, "truncated"), (1, 15, 7.0, "truncated")
    ] * 2, "fifteen ticks, of which the first is not paid"  # fmt: skip
    assert isinstance(told[0], EpisodeRecord)
    world.step(np.zeros((2, 1), np.int64), buffers)
    world.begin_episodes(buffers)
    for _ in range(15):
        world.step(np.zeros((2, 1), np.int64), buffers)
    assert [one.reward for one in world.pop_episodes()] == [7.0, 7.0], "what was under way was forgotten"


def test_a_race_that_an_older_version_kept_goes_on_without_what_it_did_not_know():
    world, other = (world_of(lambda params: 1.0, num_cars=2, objects=BoxesConfig(number=1)) for _ in range(2))
    buffers, theirs = allocate(world.spec), allocate(other.spec)
    world.reset(buffers, 3)
    other.reset(theirs, 3)
    for _ in range(4):
        world.step(np.zeros((2, 1), np.int64), buffers)
    state = world.save_state()
    assert state["reward_sums"].tolist() == [[3.0], [3.0]]
    for name in ("car.start_left", "keys", "object.speed"):
        del state[name]
    other.freeze(np.array([[True], [False]]))
    other.load_state(state, theirs)
    assert not other.cars["away"].any()
    assert (theirs.observations["FRONT_FACING_CAMERA"] == buffers.observations["FRONT_FACING_CAMERA"]).all()
    for one, own in ((world, buffers), (other, theirs)):
        one.step(np.zeros((2, 1), np.int64), own)
    assert (world.cars == other.cars).all()
    assert (other.reports["status"] == race.IN_PROGRESS).all(), "who was parked drives again"
    assert other.save_state()["reward_sums"].tolist() == [[4.0], [4.0]]
