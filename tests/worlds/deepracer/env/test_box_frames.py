"""Boxes in the frame against a plain ray caster: place, size, order and light of every face."""

import math

import numpy as np
import pytest

from racecraft.worlds.deepracer.env.camera import MOUNT_V3, CameraMount, mounted_optics
from racecraft.worlds.deepracer.env.kernels.boxes import draw_boxes, is_in_frame
from ray_caster import GROUND, HEIGHT, LEVELS, WIDTH, cast


def draw(boxes, kinds, mount, pose):
    frame = np.full((HEIGHT, WIDTH), GROUND, np.uint8)
    draw_boxes(mounted_optics(WIDTH, HEIGHT, mount), boxes, kinds, *pose, np.zeros(1), LEVELS, frame[None])
    return frame.astype(float)


def apart(chance, count):
    """Return boxes that do not overlap: a few cells of a grid, turned and moved a little."""
    cells = chance.choice(20, count, replace=False)
    x, y = 0.6 + 0.6 * (cells // 5), 0.6 * (cells % 5 - 2)
    boxes = np.zeros((count, 6))
    boxes[:, 0], boxes[:, 1] = x + chance.uniform(-0.04, 0.04, count), y + chance.uniform(-0.04, 0.04, count)
    boxes[:, 2] = chance.uniform(-math.pi, math.pi, count)
    boxes[:, 3], boxes[:, 4] = chance.uniform(0.05, 0.2, count), chance.uniform(0.05, 0.15, count)
    boxes[:, 5] = chance.uniform(0.05, 0.4, count)
    return boxes


@pytest.mark.parametrize("mount", [MOUNT_V3, CameraMount(0.0, 0.6, 0.5)], ids=["car", "from above"])
def test_boxes_are_where_a_ray_caster_sees_them(mount):
    chance = np.random.default_rng(4)
    for _ in range(6):
        boxes = apart(chance, int(chance.integers(1, 9)))
        kinds = chance.integers(0, 4, len(boxes))
        pose = chance.uniform(-0.1, 0.1), chance.uniform(-0.3, 0.3), chance.uniform(-0.4, 0.4)
        expected, plain = cast(boxes, kinds, mount, pose)
        found = draw(boxes, kinds, mount, pose)
        off = np.abs(found - expected)
        assert off[plain].max() <= 1.0
        assert off.max() < 0.25 * 240  # exact shares against 36 rays: a sliver of an edge pixel
        assert off.mean() < 0.35


def test_a_box_one_metre_ahead_has_its_size():
    mount = CameraMount(0.0, 0.1, 0.0)
    box = np.array([[1.2, 0.0, 0.0, 0.2, 0.15, 0.25]])
    frame = draw(box, np.zeros(1, np.int64), mount, (0.0, 0.0, 0.0))
    focal = 0.5 * WIDTH / math.tan(0.5 * mount.horizontal_view)
    rows, columns = np.nonzero(np.abs(frame - GROUND) > 20)
    assert np.ptp(columns) + 1 == pytest.approx(0.3 * focal, abs=1.5)
    assert rows.max() + 1 == pytest.approx(HEIGHT / 2 + 0.1 * focal, abs=1.0)
    assert rows.min() == pytest.approx(HEIGHT / 2 - 0.15 * focal, abs=1.0)


def test_a_box_hides_another_whose_middle_is_nearer():
    """A long one reaches far back beside a short one that stands before its far end."""
    boxes = np.array([[1.5, 0.25, 0.0, 1.0, 0.05, 0.3], [1.9, 0.145, 0.0, 0.05, 0.05, 0.2]])
    mount, kinds = CameraMount(0.0, 0.1, 0.0, 0.5), np.array([0, 3])  # so that they cover each other by some pixels
    for order in ([0, 1], [1, 0]):
        expected, plain = cast(boxes[order], kinds[order], mount, (0.0, 0.0, 0.0))
        found = draw(boxes[order], kinds[order], mount, (0.0, 0.0, 0.0))
        assert np.abs(found - expected)[plain].max() <= 1.0


def test_a_long_box_beside_the_eye_is_seen_though_its_middle_lies_behind():
    box, mount = np.array([[-0.3, 0.5, 0.0, 1.2, 0.05, 0.3]]), CameraMount(0.0, 0.1, 0.0)
    expected, plain = cast(box, np.array([1]), mount, (0.0, 0.0, 0.0))
    assert (expected != GROUND).any()
    assert np.abs(draw(box, np.array([1]), mount, (0.0, 0.0, 0.0)) - expected)[plain].max() <= 1.0


@pytest.mark.parametrize(
    ("ahead", "left", "height", "is_seen"),
    [
        (1.0, 0.0, 0.25, True),
        (1.0, 0.75, 0.25, True),  # its middle is out of sight, at 0.63 m a metre, and its far right corner is not
        (1.0, 1.05, 0.25, False),
        (-1.0, 0.0, 0.25, False),
        (1.0, 0.0, 3.0, False),  # asked at half its height: above the frame, though its foot is in it
    ],
)
def test_a_box_is_in_the_frame_where_a_corner_or_its_middle_is(ahead, left, height, is_seen):
    optics = mounted_optics(WIDTH, HEIGHT, CameraMount(0.0, 0.1, 0.0))
    assert is_in_frame(optics, np.array([ahead, left, 0.0, 0.2, 0.2, height]), 0.0, 0.0, 0.0) == is_seen
