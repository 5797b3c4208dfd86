"""Who sees what in a race of several cars: everybody is shown what its own car would show it among its like."""

import numpy as np
import pytest

from racecraft.contract.world import allocate
from racecraft.worlds.deepracer.env.actions import ActionTable, OwnActions
from racecraft.worlds.deepracer.env.camera import MOUNT_V3
from racecraft.worlds.deepracer.env.sensors import FRONT_CAMERA, car_sensors
from racecraft.worlds.deepracer.env.settings import CameraConfig, RaceConfig
from racecraft.worlds.deepracer.env.world import RaceWorld
from racecraft.worlds.deepracer.players.driver import Driver
from racecraft.worlds.deepracer.players.seats import Seats
from racecraft.worlds.deepracer.tracks.catalogue import load_track

TABLE = ActionTable.of([(-0.3, 1.0), (0.0, 1.0), (0.3, 1.5)])
FRAME = CameraConfig(16, 12)
RACES, CARS = 3, 2
WHOSE = np.array([[0, 1], [1, 0], [0, 1]])


class Watcher:
    """Drives in bends, and keeps all that it is shown."""

    def __init__(self):
        self.seen = []

    def act(self, observations, action_mask=None):
        self.seen.append({name: array.copy() for name, array in observations.items()})
        return np.full(len(next(iter(observations.values()))), len(self.seen) // 7 % 3)

    def reset_state(self, rows):
        pass


def driver(sensors):
    return Driver("watcher", Watcher(), TABLE, "v6", FRAME, MOUNT_V3, sensors)


def drive(own, other, fidelity, ticks=50):
    """Let the first driver's kind of car be the world's, and the second one's meet it; return what that one saw."""
    config = RaceConfig(type="HEAD_TO_MODEL", fidelity=fidelity, max_episode_seconds=2)
    world = RaceWorld(
        load_track("reinvent_base"), OwnActions((TABLE, TABLE), WHOSE), race_config=config, camera_config=FRAME,
        num_cars=RACES, cars_per_world=CARS, sensors=own.sensors,
    )  # fmt: skip
    seats = Seats(world, own, (own, other), WHOSE)
    buffers, actions = allocate(world.spec), np.zeros((RACES, CARS, 2))
    world.reset(buffers, 3)
    for _ in range(ticks):
        seats.choose(buffers.observations, actions)
        world.step(actions, buffers)
        seats.reset_state(buffers.ended)
    assert world.episodes_started > 0, "a new episode should begin on the way"
    return other.policy.seen


@pytest.mark.parametrize("fidelity", ["sane", "aws"])
@pytest.mark.parametrize("names", [("FRONT_FACING_CAMERA", "LIDAR"), ("STEREO_CAMERAS", "SECTOR_LIDAR")])
def test_a_lidar_reads_the_same_among_cars_without_one_as_among_its_like(names, fidelity):
    """Turn by turn, noise and standing readings included; the cars drive alike in both worlds."""
    scanner = car_sensors(names)
    among_others = drive(driver(FRONT_CAMERA), driver(scanner), fidelity)
    among_its_like = drive(driver(scanner), driver(scanner), fidelity)
    lidars = np.array([seen[names[1]] for seen in among_its_like])
    assert (lidars != lidars.max()).mean() > 0.01, "the other car should be within reach"
    for alone, here in zip(among_its_like, among_others, strict=True):
        for name in names:
            np.testing.assert_array_equal(here[name], alone[name], name)


def test_readings_that_stand_are_kept_with_a_saved_race():
    world = RaceWorld(
        load_track("reinvent_base"), OwnActions((TABLE, TABLE), WHOSE),
        race_config=RaceConfig(type="HEAD_TO_MODEL", fidelity="aws"), camera_config=FRAME,
        num_cars=RACES, cars_per_world=CARS,
    )  # fmt: skip
    own, other = driver(FRONT_CAMERA), driver(car_sensors(("FRONT_FACING_CAMERA", "LIDAR")))
    seats = Seats(world, own, (own, other), WHOSE)
    buffers, actions = allocate(world.spec), np.zeros((RACES, CARS, 2))
    world.reset(buffers, 3)
    for _ in range(11):  # after ten ticks the LiDAR stands still for a tick
        seats.choose(buffers.observations, actions)
        state = {**world.save_state(), **seats.save_state()}
        world.step(actions, buffers)
    shown = other.policy.seen[-1]["LIDAR"]
    assert (shown < 1.0).any()
    again = Seats(world, own, (own, other), WHOSE)
    world.load_state(state, buffers)
    again.load_state(state)
    again.choose(buffers.observations, actions)
    np.testing.assert_array_equal(other.policy.seen[-1]["LIDAR"], shown)
