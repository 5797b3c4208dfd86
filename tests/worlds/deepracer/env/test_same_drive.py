"""One car a world drives as it did before worlds had several: whole stories, held to digests of that time.

The digests were taken from the code in which a race was N cars and the kernels took numbers of an action table (what is
seen, and two drives, once more when each generation of cars got its light, its grip and its waypoints). Floats
are rounded to seven digits, so that another processor's last bit does not matter. Who means to change how a car drives,
what it is told or what it sees takes new digests, and says so in the change.
"""

import hashlib
import math

import numpy as np
import pytest

from racecraft.contract.world import allocate
from racecraft.worlds.deepracer.env.actions import ActionTable
from racecraft.worlds.deepracer.env.race_spec import CAMERA_NAME, CRITIC_NAME
from racecraft.worlds.deepracer.env.settings import CameraConfig, RaceConfig
from racecraft.worlds.deepracer.env.world import RaceWorld
from racecraft.worlds.deepracer.tracks.catalogue import load_track

ACTIONS = ActionTable.of([(math.radians(angle), speed) for angle in (-30, 0, 30) for speed in (0.5, 1.0, 5.0)])
TOLD = (
    "episode", "steps", "status", "x", "y", "yaw", "front_x", "front_y", "speed", "steering", "driven_speed",
    "driven_steering", "progress", "arc", "centre_distance", "track_width", "waypoint_before", "waypoint_after",
    "waypoint_nearest", "is_left", "all_wheels_on", "is_off", "terminated", "truncated", "time", "lap_seconds",
    "start_share", "laps",
)  # fmt: skip

CASES = {
    "a sane race": ("reinvent_base", 5, {"car": "v6-unlimited", "max_episode_seconds": 4.0}, 1),
    "as at AWS, the other way round": (
        "Spain_track", 3,
        {"car": "v6-unlimited", "fidelity": "aws", "reverse": True, "max_episode_seconds": 5.0}, 1,
    ),
    "an open track, the ideal car": ("Straight_track", 2, {"car": "kinematic", "start_advance": 0.31}, 1),
    "two laps by a steersman": ("Oval_track", 2, {"car": "v6-unlimited"}, 2),
}  # fmt: skip
DIGESTS = {
    "a sane race": ("89b881a3bc22f0d9", "f0a575c51731bb22"),
    "as at AWS, the other way round": ("5733588a1b2bc717", "e3756a0439770d69"),
    "an open track, the ideal car": ("28b73db36e36cf73", "f77a4156a42f403d"),
    "two laps by a steersman": ("86ca5bca71ec5ac0", "2bed7c707dfbd283"),
}
"""What was told and paid, and what was seen."""


def paid(params):
    """Return a reward that most parameters have a part in."""
    side = 1 if params["is_left_of_center"] else -1
    return (
        params["speed"] + params["steering_angle"] + 0.01 * params["heading"] + side * params["progress"]
        + params["closest_waypoints"][1] + params["distance_from_center"]
    )  # fmt: skip


def digests(case):
    """Drive a case; return the digest of everything told and paid, and of every frame."""
    track, cars, config, laps = CASES[case]
    world = RaceWorld(
        load_track(track), ACTIONS, paid, race_config=RaceConfig(**config), camera_config=CameraConfig(40, 30),
        num_cars=cars, laps=laps,
    )  # fmt: skip
    buffers, rng = allocate(world.spec), np.random.default_rng(7)
    world.reset(buffers, 3)
    told, seen = hashlib.sha256(), hashlib.sha256()

    def write(array):
        told.update((np.round(np.asarray(array, np.float64), 7) + 0.0).tobytes())

    for tick in range(420 if laps > 1 else 120):
        if tick == 90:
            world.load_state(world.save_state(), buffers)
        views = buffers.observations[CRITIC_NAME][:, 0]
        aim = np.arctan2(views[:, 7], views[:, 8]) - 0.6 * views[:, 0]
        steered = np.where(np.abs(aim) < 0.12, 4, np.where(aim > 0, 7, 1))[:, None]
        world.step(steered if laps > 1 else rng.integers(0, 9, (cars, 1)), buffers)
        for name in TOLD:
            write(world.reports[name].reshape(-1))
        for array in (buffers.reward, buffers.terminated, buffers.truncated, buffers.active):
            write(array)
        write(buffers.observations[CRITIC_NAME])
        write(buffers.final_observations[CRITIC_NAME][buffers.ended])
        seen.update(np.ascontiguousarray(buffers.observations[CAMERA_NAME]).tobytes())
        seen.update(np.ascontiguousarray(buffers.final_observations[CAMERA_NAME][buffers.ended]).tobytes())
    for episode in world.pop_episodes():
        write([episode.world, episode.agent, episode.steps, episode.reward, episode.facts["progress_percent"]])
        told.update(episode.status.encode())
    return told.hexdigest()[:16], seen.hexdigest()[:16]


@pytest.mark.parametrize("case", CASES)
def test_a_car_alone_in_its_world_drives_as_it_always_did(case):
    told, seen = digests(case)
    assert told == DIGESTS[case][0], "what cars did, were told or were paid"
    assert seen == DIGESTS[case][1], "what cars saw"
