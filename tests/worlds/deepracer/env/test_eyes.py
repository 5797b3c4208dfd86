"""What cars of each metadata version really look through, held to measures on the original's frames."""

import json
import math
from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import least_squares

from racecraft.worlds.deepracer.env.actions import ActionTable
from racecraft.worlds.deepracer.env.camera import CameraMount, mount_for_version, mounted_optics
from racecraft.worlds.deepracer.env.scene import road_rings
from racecraft.worlds.deepracer.env.world import RaceWorld
from racecraft.worlds.deepracer.tracks.catalogue import load_track

EDGES_2019 = json.loads((Path(__file__).parent / "line_edges_2019.json").read_text())["frames"]
ACTIONS = ActionTable.of([(0.1, 1.0), (-0.1, 1.0)])

EYES_APART_M = 0.06
APART_PX = {70.0: 15.53, 90.0: 22.63, 110.0: 29.72}
"""How many columns further right the left eye sees what the right eye sees at that row, on the ground: straight lines
through 216 edges in three pairs of frames of a version 2 car, 160 x 120 (simapp's sample data, Apache-2.0); the pairs
differ by 0.06 px."""
CONFIRMED_LATER = {"2021": (0.1309, 13.59, 1.132), "2026": (0.1310, 13.60, 1.133)}
"""Height (m), pitch (degrees) and view (rad) fitted to 338 frames of those years (facts: generations)."""


@pytest.fixture(scope="module")
def white_line_edges():
    """Points 2 mm from each other on both edges of both white lines of re:Invent 2018, (P, 2) m."""
    points = []
    for ring, _, _ in road_rings(load_track("reinvent_base")):
        closed = np.concatenate([ring, ring[:1]])
        arc = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(closed, axis=0).T))])
        at = np.arange(0.0, arc[-1], 0.002)
        points.append(np.column_stack([np.interp(at, arc, closed[:, axis]) for axis in range(2)]))
    return np.concatenate(points)


def into_picture(mount, pose, points):
    """Project ground points (P, 2) into a frame of 160 x 120: columns and rows of those ahead, (Q, 2) px."""
    optics = mounted_optics(160, 120, mount)
    x, y, yaw = pose
    cosine, sine = math.cos(yaw), math.sin(yaw)
    offset = points - [x + cosine * mount.x, y + sine * mount.x]
    ahead, left = offset @ [cosine, sine], offset @ [-sine, cosine]
    depth = ahead * optics.cos_pitch + mount.z * optics.sin_pitch
    down = mount.z * optics.cos_pitch - ahead * optics.sin_pitch
    near = depth > 0.1
    scale = optics.focal / depth[near]
    return np.column_stack([optics.middle_x - left[near] * scale, optics.middle_y + down[near] * scale])


def misses(mount, frame, white_line_edges):
    """Return how far each measured edge lies from one of ours, px, from the pose that suits the mount best."""
    measured = np.array(frame["edges"])
    middle = np.array(frame["pose"][:2]) + 2.0 * np.array([math.cos(frame["pose"][2]), math.sin(frame["pose"][2])])
    near = white_line_edges[np.hypot(*(white_line_edges - middle).T) < 2.2]

    def strays(pose):
        seen = into_picture(mount, pose, near)
        seen = seen[(np.abs(seen - [80.0, 60.0]) < [110.0, 90.0]).all(axis=1)]
        gaps = np.hypot(*(measured[:, None] - seen).transpose(2, 0, 1))
        return np.minimum(gaps.min(axis=1, initial=30.0), 30.0)

    x, y, yaw = frame["pose"]
    ahead = mount_for_version("1").x - mount.x  # a mount further ahead wants the car further back
    start = [x + ahead * math.cos(yaw), y + ahead * math.sin(yaw), yaw]
    return strays(least_squares(strays, start, loss="soft_l1", f_scale=0.5, diff_step=1e-4, max_nfev=25).x)


def typical_miss(mount, white_line_edges):
    return np.mean([np.sqrt(np.mean(misses(mount, frame, white_line_edges) ** 2)) for frame in EDGES_2019])


def test_a_car_of_version_1_sees_the_lines_where_the_frames_of_2019_have_them(white_line_edges):
    assert typical_miss(mount_for_version("1"), white_line_edges) < 0.5


def test_a_later_car_does_not(white_line_edges):
    assert typical_miss(mount_for_version("3"), white_line_edges) > 0.8


def test_two_eyes_of_version_2_would_see_as_far_apart_as_those_of_the_original():
    optics = mounted_optics(160, 120, mount_for_version("2"))
    for row, apart in APART_PX.items():
        slope = (row - optics.middle_y) / optics.focal
        depth = mount_for_version("2").z / (optics.sin_pitch + slope * optics.cos_pitch)
        assert optics.focal * EYES_APART_M / depth == pytest.approx(apart, abs=0.15)


@pytest.mark.parametrize("version", ["3", "6", None])
@pytest.mark.parametrize("year", CONFIRMED_LATER)
def test_later_cars_see_the_ground_where_the_frames_of_2021_and_2026_have_it(version, year):
    """Half a metre to two ahead of the lens, to the side as well: within a quarter of a pixel at 0.5 m, 0.3 px else."""
    mount = mount_for_version(version)
    height, pitch, view = CONFIRMED_LATER[year]
    confirmed = CameraMount(mount.x, height, math.radians(pitch), view)
    points = np.array([[mount.x + ahead, left] for ahead in (0.3, 0.5, 1.0, 2.0) for left in (-0.15, 0.0, 0.15)])
    gaps = into_picture(mount, (0.0, 0.0, 0.0), points) - into_picture(confirmed, (0.0, 0.0, 0.0), points)
    assert np.abs(gaps).max() < 0.5


@pytest.mark.parametrize("version", ["1", "2", "3"])
def test_a_race_is_seen_through_the_mount_of_its_car(version):
    world = RaceWorld(load_track("reinvent_base"), ACTIONS, mount=mount_for_version(version))
    assert world.camera.optics.mount_z == mount_for_version(version).z
