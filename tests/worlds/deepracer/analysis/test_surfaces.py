"""Which surface lies under a pixel: held to the camera itself, whose frames are the shares times the greys."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from racecraft.worlds.deepracer.analysis.surfaces import (
    OBSTACLE,
    SURFACES,
    by_surface,
    painted_over,
    surface_of,
    surface_shares,
)
from racecraft.worlds.deepracer.env.camera import Camera
from racecraft.worlds.deepracer.env.scene import MATERIALS, build_scene
from racecraft.worlds.deepracer.tracks.catalogue import load_track


@pytest.fixture(scope="module")
def poses(track):
    arcs = np.linspace(0.0, 0.95 * track.length, 7)
    return np.array([track.pose_at(float(arc)) for arc in arcs]) + [0.0, 0.0, 0.3]


@pytest.mark.parametrize("has_grass", [False, True])
def test_a_frame_is_the_shares_times_the_greys(track, poses, has_grass):
    """All walls but one painted alike, so that one grey stands for each surface."""
    camera = Camera(build_scene(track, has_grass=has_grass), 40, 30)
    levels = np.array(camera.scene.grey_palette)
    walls = [k for k, material in enumerate(MATERIALS) if surface_of(material) == "wall"]
    levels[walls] = levels[walls[0]]
    of_surface = [next(levels[k] for k, m in enumerate(MATERIALS) if surface_of(m) == name) for name in SURFACES]
    shares = surface_shares(camera, poses)
    plain = Camera(camera.scene._replace(grass=0.0), 40, 30)
    assert_allclose(shares.sum(axis=1), 1.0, atol=0.02)
    assert_allclose(np.einsum("tshw,s->thw", shares, of_surface), plain.render_grey(poses, palettes=levels), atol=3.0)


def test_attention_on_the_walls_is_told_as_such(track, poses):
    camera = Camera(build_scene(track), 40, 30)
    shares = surface_shares(camera, poses)
    wall = SURFACES.index("wall")
    only_wall = (shares[:, wall] > 0.99).astype(float)
    first, *rest = by_surface(only_wall, shares)
    assert (first.surface, round(first.attention, 2)) == ("wall", 1.0)
    assert sum(row.attention for row in rest) < 0.01
    even = by_surface(np.ones_like(only_wall), shares)
    assert_allclose([row.times_its_area for row in even], 1.0, rtol=1e-6)
    assert sum(row.area for row in even) == pytest.approx(1.0, abs=1e-3)


@pytest.mark.parametrize("surface", ["wall", "border line", "grass"])
def test_painting_over_changes_that_surface_and_nothing_else(track, poses, surface):
    camera = Camera(build_scene(track), 40, 30)
    share = surface_shares(camera, poses)[:, SURFACES.index(surface)]
    before, after = camera.render_grey(poses).astype(int), painted_over(camera, poses, surface).astype(int)
    there = np.abs(before - after) > 2  # greys are rounded to whole levels
    assert there[share > 0.9].all()
    assert not there[share == 0.0].any()


def test_a_track_whose_file_repeats_a_row_looks_as_it_is():
    """Films are of the track as it was counted; Oval_track's file has a row twice."""
    track = load_track("Oval_track")
    assert track.repeated_rows
    poses = np.array([track.pose_at(0.0), track.pose_at(0.5 * track.length)])
    frames = [Camera(build_scene(one), 40, 30).render_grey(poses) for one in (track, track.as_filed())]
    assert np.abs(frames[0].astype(int) - frames[1]).max() <= 1


def box_ahead(poses, metres):
    """Return a box in the middle of the road so far ahead of every pose, and its kind."""
    boxes = np.zeros((len(poses), 1, 6))
    boxes[:, 0, 0] = poses[:, 0] + metres * np.cos(poses[:, 2])
    boxes[:, 0, 1] = poses[:, 1] + metres * np.sin(poses[:, 2])
    boxes[:, 0, 2:] = np.column_stack([poses[:, 2], *np.tile([[0.2], [0.15], [0.25]], (1, len(poses)))])
    return boxes, np.zeros((len(poses), 1), np.int64)


def test_boxes_are_a_surface_of_their_own(track, poses):
    """Where the camera itself shows a difference with and without them, and nowhere else."""
    camera, objects = Camera(build_scene(track), 40, 30), box_ahead(poses, 1.0)
    bare, shares = surface_shares(camera, poses), surface_shares(camera, poses, objects)
    place = SURFACES.index(OBSTACLE)
    assert not bare[:, place].any()
    assert_allclose(shares.sum(axis=1), 1.0, atol=0.03)
    with_them, without = (camera.render_grey(poses, boxes=boxes).astype(int) for boxes in (objects, None))
    differs = np.abs(with_them - without) > 12
    assert differs.mean() > 0.01
    assert (shares[:, place][differs] > 0.05).all()
    assert not differs[shares[:, place] == 0.0].any()
    assert (shares[:, place] > 0.95).any()
    np.testing.assert_array_equal(painted_over(camera, poses, OBSTACLE, objects=objects), without)
    grass = painted_over(camera, poses, "grass", objects=objects)
    assert (np.abs(grass.astype(int) - with_them)[shares[:, place] > 0.99] <= 2).all(), "the box stands as it stood"
