"""A plain ray caster for upright boxes, against which frames are held."""

import math

import numpy as np

from racecraft.worlds.deepracer.env.kernels.boxes import SIDE_LIGHT, SUN_SHARE, SUN_X, SUN_Y
from racecraft.worlds.deepracer.env.scene import MATERIALS

WIDTH, HEIGHT, SAMPLES = 80, 60, 6
GROUND = 40
LEVELS = np.zeros(len(MATERIALS))
LEVELS[10:14] = 120.0, 160.0, 200.0, 240.0


def cast(boxes, kinds, mount, pose):
    """Return the frame (H, W) as the mean of SAMPLES² rays a pixel, and which pixels lie within one face."""
    focal = 0.5 * WIDTH / math.tan(0.5 * mount.horizontal_view)
    grid = (np.arange(SAMPLES) + 0.5) / SAMPLES
    columns = (np.arange(WIDTH)[:, None] + grid).reshape(-1)
    rows = (np.arange(HEIGHT)[:, None] + grid).reshape(-1)
    right, down = np.meshgrid((columns - WIDTH / 2) / focal, (rows - HEIGHT / 2) / focal)
    cos, sin = math.cos(mount.pitch), math.sin(mount.pitch)
    ahead, up = cos - down * sin, -sin - down * cos
    x, y, yaw = pose
    rays = np.stack(
        [ahead * math.cos(yaw) + right * math.sin(yaw), ahead * math.sin(yaw) - right * math.cos(yaw), up], axis=-1
    )
    eye = np.array([x + mount.x * math.cos(yaw), y + mount.x * math.sin(yaw), mount.z])
    nearest, seen = np.full(right.shape, np.inf), np.full(right.shape, float(GROUND))
    for box, kind in zip(boxes, kinds, strict=True):
        turn = np.array([[math.cos(box[2]), math.sin(box[2]), 0], [-math.sin(box[2]), math.cos(box[2]), 0], [0, 0, 1]])
        origin, direction = turn @ (eye - [box[0], box[1], 0]), rays @ turn.T
        low, high = np.array([-box[3], -box[4], 0.0]), np.array([box[3], box[4], box[5]])
        with np.errstate(divide="ignore"):
            to_low, to_high = (low - origin) / direction, (high - origin) / direction
        enter, leave = np.minimum(to_low, to_high), np.maximum(to_low, to_high)
        first, last, face = enter.max(axis=-1), leave.min(axis=-1), enter.argmax(axis=-1)
        hit = (first < last) & (first > 0.02) & (first < nearest)
        sign = -np.sign(np.take_along_axis(direction, face[..., None], -1)[..., 0])
        light = np.ones(face.shape)
        for axis, (nx, ny) in enumerate(((math.cos(box[2]), math.sin(box[2])), (-math.sin(box[2]), math.cos(box[2])))):
            side = SIDE_LIGHT + SUN_SHARE * sign * (SUN_X * nx + SUN_Y * ny)
            light = np.where(face == axis, side, light)
        nearest = np.where(hit, first, nearest)
        seen = np.where(hit, LEVELS[10 + kind] * light, seen)
    pixels = seen.reshape(HEIGHT, SAMPLES, WIDTH, SAMPLES).transpose(0, 2, 1, 3).reshape(HEIGHT, WIDTH, -1)
    around = np.pad(pixels, ((1, 1), (1, 1), (0, 0)), mode="edge")
    around = np.lib.stride_tricks.sliding_window_view(around, (3, 3), axis=(0, 1))
    return pixels.mean(axis=-1), np.ptp(around, axis=(-3, -2, -1)) < 1e-9
