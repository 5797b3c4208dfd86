"""The camera, by hand, by twin and by law."""

import math

import numpy as np
import pytest

from racecraft.kernels import set_threads, threads
from racecraft.worlds.deepracer.env.camera import (
    MOUNT_V2,
    MOUNT_V3,
    Camera,
    CameraError,
    CameraMount,
    mount_for_version,
    mounted_optics,
)
from racecraft.worlds.deepracer.env.scene import (
    DASH,
    FIELD,
    LINE,
    MATERIALS,
    ROAD,
    START,
    build_scene,
    dash_rings,
    set_in,
)
from racecraft.worlds.deepracer.tracks.style import TrackStyle
from racecraft.worlds.deepracer.tracks.track import Track

LOOK = TrackStyle(wall_height=1.0)


def oval(turn=1.0, look=LOOK, rows=120, stretch=1.0):
    """A stadium of straights 4 m long, road 0.8 m wide, start in the middle of the lower straight."""
    angle = np.linspace(-np.pi / 2, 1.5 * np.pi, rows)
    shift = 2.0 * np.clip(4 * np.cos(angle), -1, 1)[:, None] * [1.0, 0.0]
    rings = [
        np.stack([np.cos(angle), np.sin(angle) * turn], 1) * radius * stretch + shift * stretch
        for radius in (1.6, 1.2, 2.0)
    ]
    rows_ = np.hstack(rings)
    rows_[-1] = rows_[0]
    return Track.from_rows("oval", rows_, look=look)


@pytest.fixture(scope="module")
def track():
    return oval()


@pytest.fixture(scope="module")
def scene(track):
    return build_scene(track)


def some_poses(track, count=24):
    rng = np.random.default_rng(7)
    poses = np.array([track.pose_at_share(share) for share in np.linspace(0, 1, count, endpoint=False)])
    return poses + rng.uniform(-1, 1, poses.shape) * [0.3, 0.3, 0.6]


def pinhole(optics, pose, points):
    """Project ground points (P, 2) with rotation matrices: the twin of the kernel's arithmetic."""
    x, y, yaw = pose
    pitch = math.atan2(optics.sin_pitch, optics.cos_pitch)
    car_to_world = np.array([[math.cos(yaw), -math.sin(yaw), 0], [math.sin(yaw), math.cos(yaw), 0], [0, 0, 1]])
    nose_down = np.array([[math.cos(pitch), 0, math.sin(pitch)], [0, 1, 0], [-math.sin(pitch), 0, math.cos(pitch)]])
    eye = np.array([x, y, 0]) + car_to_world @ [optics.mount_x, 0, optics.mount_z]
    seen = (np.column_stack([points, np.zeros(len(points))]) - eye) @ (car_to_world @ nose_down)
    depth, left, up = seen.T
    return depth, optics.middle_x - optics.focal * left / depth, optics.middle_y - optics.focal * up / depth


def material_at(track, points):
    """Name the material of ground points (P, 2) by distances to borders and centre line, dashes aside."""

    def distance(ring):
        step = np.diff(ring, axis=0)
        offset = points[:, None] - ring[:-1]
        share = np.clip((offset * step).sum(-1) / (step * step).sum(-1), 0, 1)
        return np.sqrt(((offset - share[..., None] * step) ** 2).sum(-1)).min(1)

    to_border = np.minimum(distance(track.inner), distance(track.outer))
    on_road = track.contains(points)
    return np.where(on_road, np.where(to_border < track.look.line_width, LINE, ROAD), FIELD)


def test_a_pixel_is_what_its_rays_hit():
    """Twin: 64 rays a pixel through a pinhole, each asked on which side of which line it lands."""
    track = oval(look=TrackStyle(dash_length=0.0, field_bounds=(-30, -30, 30, 30)))
    camera = Camera(build_scene(track), 40, 30)
    pose = np.array([0.3, -1.5, 0.35])
    optics = camera.optics
    fine = (np.arange(40 * 8) + 0.5) / 8
    u, v = np.meshgrid(fine, fine[: 30 * 8])
    ahead_slope = (v - optics.middle_y) / optics.focal
    drop = optics.sin_pitch + ahead_slope * optics.cos_pitch
    depth = np.where(drop > 0.02, optics.mount_z / np.where(drop > 0.02, drop, 1), np.nan)
    ahead = depth * (optics.cos_pitch - ahead_slope * optics.sin_pitch)
    left = -(u - optics.middle_x) / optics.focal * depth
    x = pose[0] + math.cos(pose[2]) * (ahead + optics.mount_x) - math.sin(pose[2]) * left
    y = pose[1] + math.sin(pose[2]) * (ahead + optics.mount_x) + math.cos(pose[2]) * left
    rows = ~np.isnan(x).any(1)
    levels = camera.scene.grey_palette[material_at(track, np.column_stack([x[rows].ravel(), y[rows].ravel()]))]
    first = int(np.ceil(np.flatnonzero(rows)[0] / 8)) + 1
    twin = levels.reshape(-1, 40 * 8)[-(30 - first) * 8 :].reshape(30 - first, 8, 40, 8).mean((1, 3))
    frame = camera.render_grey(pose[None])[0, first:]
    difference = np.abs(frame - twin)
    assert difference.mean() < 0.8
    assert np.percentile(difference, 99) < 9


def test_white_lines_stand_where_the_border_projects(track, scene):
    camera = Camera(scene, 160, 120)
    only_line = np.zeros(len(MATERIALS))
    only_line[LINE] = 255
    along = 0.5 * track.look.line_width
    middle_of_line = set_in(track.outer[:-1], along)
    found = 0
    for pose in some_poses(track):
        frame = camera.render_grey(pose[None], palettes=only_line)[0]
        depth, u, v = pinhole(camera.optics, pose, middle_of_line)
        near = (depth > 0.2) & (depth < 0.6) & (u > 1) & (u < 159) & (v > 1) & (v < 119)
        assert (frame[v[near].astype(int), u[near].astype(int)] == 255).mean() >= 0.9 if near.any() else True
        found += near.sum()
    assert found > 10


def test_a_mirrored_track_gives_mirrored_frames(track, scene):
    mirrored = build_scene(oval(turn=-1.0))
    palettes = scene.grey_palette.copy()
    palettes[5:9] = 80.0  # the sun has no mirror
    poses = some_poses(track)
    frames = Camera(scene, 80, 60).render_grey(poses, palettes=palettes)
    other = Camera(mirrored, 80, 60).render_grey(poses * [1, -1, -1], palettes=palettes)
    difference = np.abs(frames[:, :, ::-1].astype(int) - other)
    assert difference.mean() < 0.02
    assert difference.max() <= 2


def test_one_dash_period_ahead_looks_the_same_on_a_straight():
    x = np.linspace(0, 40, 401)
    rows = np.column_stack([x, 0 * x, x, 0 * x + 0.4, x, 0 * x - 0.4])
    look = TrackStyle(field_bounds=(-500, -500, 500, 500))
    camera = Camera(build_scene(Track.from_rows("straight", rows, look=look)), 160, 120)
    period = look.dash_length + look.dash_gap
    poses = np.array([[5.0, 0.1, 0.05], [5.0 + period, 0.1, 0.05], [5.0 + period / 2, 0.1, 0.05]])
    here, next_period, half = camera.render_grey(poses).astype(int)
    assert np.abs(here - next_period).max() <= 1
    assert np.abs(here - half).max() > 50


@pytest.mark.parametrize("mount", [MOUNT_V2, MOUNT_V3])
def test_a_frame_averaged_is_the_smaller_frame(scene, track, mount):
    poses = some_poses(track)
    large = Camera(scene, 160, 120, mount).render_grey(poses)
    for factor in (2, 4):
        small = Camera(scene, 160 // factor, 120 // factor, mount).render_grey(poses)
        blocks = large.reshape(len(poses), 120 // factor, factor, 160 // factor, factor).mean((2, 4))
        assert np.abs(blocks - small).max() < 2.0


def test_frames_do_not_depend_on_company_or_threads(scene, track):
    camera = Camera(scene, 80, 60)
    poses = some_poses(track, 40)
    before = threads()
    try:
        set_threads(1)
        alone = np.concatenate([camera.render_grey(pose[None]) for pose in poses])
        set_threads(2)
        together = camera.render_grey(poses)
    finally:
        set_threads(before)
    assert (alone == together).all()


def test_grey_is_the_luma_of_the_colour_frame(scene, track):
    poses = some_poses(track)
    camera = Camera(scene, 80, 60)
    luma = camera.render_rgb(poses) @ np.array([0.2989, 0.587, 0.114])
    assert np.abs(luma - camera.render_grey(poses)).max() <= 1.5


def test_a_palette_for_each_frame_colours_that_frame(scene, track):
    poses = some_poses(track, 3)
    camera = Camera(scene, 40, 30)
    palettes = np.tile(scene.grey_palette, (3, 1))
    palettes[1] = 255 - palettes[1]
    plain, own = camera.render_grey(poses), camera.render_grey(poses, palettes=palettes)
    assert (plain[[0, 2]] == own[[0, 2]]).all()
    assert np.abs(255 - plain[1].astype(int) - own[1]).max() <= 1


def test_every_level_lies_between_the_darkest_and_the_brightest_material(scene, track):
    """No ring runs the wrong way: shares never leave 0 to 1, wherever the car stands."""
    poses = np.random.default_rng(3).uniform([-4.5, -2.9, -np.pi], [4.5, 2.9, np.pi], (400, 3))
    palette = np.full(len(MATERIALS), 100.0)
    palette[[LINE, DASH, START]] = 130.0
    palette[[ROAD]] = 120.0
    frames = Camera(scene, 80, 60).render_grey(poses, palettes=palette)
    assert frames.min() >= 99
    assert frames.max() <= 130


def test_the_start_strip_lies_where_it_is_told():
    track = oval(look=TrackStyle(start_strip=0.2, start_strip_at=0.1))
    only_start = np.zeros(len(MATERIALS))
    only_start[START] = 255
    camera = Camera(build_scene(track), 160, 120)
    start = track.pose_at(0.0)
    pose = np.array([start.x - 0.8, start.y, start.yaw])
    rows = np.flatnonzero(camera.render_grey(pose[None], palettes=only_start)[0, :, 80] > 127)
    _, _, v = pinhole(camera.optics, pose, np.array([[start.x, start.y], [start.x + 0.2, start.y]]))
    assert abs(rows.max() + 1 - v[0]) <= 1
    assert abs(rows.min() - v[1]) <= 1


def test_dashes_are_rectangles_that_lie_along_the_road_in_its_curves_too():
    rings = dash_rings(oval(look=TrackStyle(dash_length=0.2, dash_gap=0.2, dash_width=0.05)))
    assert len(rings) > 20
    for corners, _, _ in rings:
        sides = np.roll(corners, -1, axis=0) - corners
        lengths = np.hypot(*sides.T)
        assert np.sort(lengths)[:2] == pytest.approx([0.05, 0.05], abs=1e-6)
        assert np.sort(lengths)[2:] == pytest.approx([0.2, 0.2], abs=5e-3)
        assert abs((sides * np.roll(sides, -1, axis=0)).sum(axis=1)).max() < 1e-9, "right angles"


def test_an_odd_size_or_array_is_refused_with_a_letter(scene):
    with pytest.raises(CameraError, match="sees nothing"):
        Camera(scene, 0, 120)
    with pytest.raises(CameraError, match=r"uint8 \(1, 30, 40\)"):
        Camera(scene, 40, 30).render_grey(np.zeros((1, 3)), np.zeros((1, 40, 30), np.uint8))
    with pytest.raises(CameraError, match="palette"):
        Camera(scene, 40, 30).render_grey(np.zeros((1, 3)), palettes=np.zeros(3))


# ---- the numbers of a mounted camera, by hand ------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("version", "mount"),
    [
        ("1", (0.2, 0.1235, 15.1, 1.135)),
        ("2", (0.2, 0.164, 15.0, 1.13)),
        ("3", (0.14529379, 0.13032555, 13.6, 1.13)),
        ("1.5", (0.2, 0.1235, 15.1, 1.135)),
        (None, (0.14529379, 0.13032555, 13.6, 1.13)),
    ],
)
def test_a_camera_sits_where_simapp_puts_it_or_the_frames_of_2019_have_it(version, mount):
    """m ahead, m up, degrees down, rad of view."""
    found = mount_for_version(version)
    assert (found.x, found.z, found.horizontal_view, found.roll) == (mount[0], mount[1], mount[3], 0.0)
    assert math.degrees(found.pitch) == pytest.approx(mount[2])


def test_optics_are_those_of_a_pinhole():
    """A view of 90 degrees over 160 x 120 pixels: focal length 80, edges 1 aside and 0.75 down; 30 degrees of pitch."""
    optics = mounted_optics(160, 120, CameraMount(0.2, 0.4, math.radians(30), math.radians(90)))
    sine, cosine = 0.5, math.sqrt(0.75)
    assert optics == pytest.approx(
        (80, 80, 60, cosine, sine, 0.2, 0.4, 1, math.hypot(1, cosine), 0.5 * 0.4 / (sine + 0.75 * cosine), 1, 0, 0)
    )
