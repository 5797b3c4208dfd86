"""Recorded races among boxes and bots, held against ours: where things stand and drive, and where a car hits them.

The boxes' rows are those within 0.9 m of one, of a training of June 2022 with three listed boxes: 40 episodes, of which
25 ended at one. None of its 5,100 other rows touches a box of ours either. The bots are those of two trainings on
re:Invent 2022, each place of which a reward function was told; the logs do not say where they began.
"""

import json
from pathlib import Path

import numpy as np
import pytest

from racecraft.contract.world import allocate
from racecraft.worlds.deepracer.env.actions import ActionTable
from racecraft.worlds.deepracer.env.lanes import lane_splines
from racecraft.worlds.deepracer.env.settings import BoxesConfig, CameraConfig, RaceConfig
from racecraft.worlds.deepracer.env.vehicle import FRONT_POINT_M
from racecraft.worlds.deepracer.env.world import RaceWorld
from racecraft.worlds.deepracer.tracks.catalogue import load_track

FILE = json.loads((Path(__file__).parent / "recorded_objects_2022.json").read_text(encoding="utf-8"))
RECORDED, BOTS = FILE["boxes"], FILE["bots"]
FRONT_X, FRONT_Y, YAW, CRASHED = np.array(RECORDED["rows"]).T


def race(fidelity="aws", positions=RECORDED["object_positions"]):
    """Return a race among listed boxes, with a car for each recorded row."""
    return RaceWorld(
        load_track(RECORDED["track"]), ActionTable.of([(0.0, 0.5), (0.1, 0.5)]), camera_config=CameraConfig(8, 8),
        race_config=RaceConfig(type="OBJECT_AVOIDANCE", fidelity=fidelity), num_cars=len(YAW),
        objects=BoxesConfig(positions=positions),
    )  # fmt: skip


def crashes(world):
    """Return which rows our marshal calls a crash, bool (R,)."""
    buffers = allocate(world.spec)
    world.reset(buffers, 0)
    state = world.save_state()
    yaw = np.radians(YAW)[:, None]
    state["car.x"][:] = FRONT_X[:, None] - FRONT_POINT_M * np.cos(yaw)
    state["car.y"][:] = FRONT_Y[:, None] - FRONT_POINT_M * np.sin(yaw)
    state["car.yaw"][:], state["car.preparing"][:] = yaw, False
    world.load_state(state, buffers)
    world.step(np.zeros((len(YAW), 1), int), buffers)
    return world.reports["is_crashed"][:, 0]


def test_listed_boxes_stand_where_the_recorded_reward_was_told_they_are():
    world = race()
    world.reset(allocate(world.spec), 0)
    assert np.abs(world.boxes[0, :, :2] - RECORDED["objects_location"]).max() < 0.001


def test_every_recorded_crash_is_one_of_ours_and_no_other_row_is():
    assert CRASHED.sum() == 25
    assert len(CRASHED) > 100
    assert np.array_equal(crashes(race()), CRASHED == 1)


def test_bodies_that_overlap_are_fewer_than_the_original_s_corners_with_five_centimetres_to_spare():
    ours = crashes(race("sane"))
    assert not ours[CRASHED == 0].any()
    assert ours.sum() == 11


@pytest.mark.parametrize("positions", ["0.97,-1;0.62,-1;0.10,1", "0.968,1;0.618,1;0.098,-1"])
def test_boxes_in_the_other_lane_or_twelve_centimetres_away_are_not_those_that_were_hit(positions):
    assert (crashes(race(positions=positions)) != (CRASHED == 1)).sum() > 5


def test_recorded_bots_drive_on_our_splines():
    """Within millimetres of the middle of a lane, but for the few that are changing lanes."""
    track = load_track(BOTS["track"])
    knots, cubics = lane_splines(track)
    arc = np.linspace(0.0, track.length, 20001)[:-1]
    piece = np.clip(np.searchsorted(knots, arc, side="right") - 1, 0, cubics.shape[1] - 1)
    powers = (arc - knots[piece])[:, None] ** np.arange(4)
    lanes = np.einsum("ap,sadp->sad", powers, cubics[:, piece])
    bots = np.array(BOTS["objects_location"])
    aside = np.array([np.hypot(*(lanes - bot).transpose(2, 0, 1)).min() for bot in bots])
    assert len(aside) == 423
    assert np.median(aside) < 0.002
    assert (aside < 0.02).mean() > 0.98
    half = np.hypot(*(lanes[0] - lanes[1]).T).min() / 2
    assert aside.max() < half, "who changes lanes is between them"
