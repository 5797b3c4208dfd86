"""What two eyes see side by side. Begin at `render_pair`, which draws, and `join_eyes`, which lays the frames together.

Two eyes look the same way from places a few centimetres apart, so everything on the ground is as deep, and as far down
the picture, in one as in the other: what stands where is worked out once, and drawn twice, shifted by half the baseline
either way. The rest is as in `kernels/camera.py`.
"""

from __future__ import annotations

import math

import numpy as np

from racecraft.kernels import kernel, parallel_kernel, prange
from racecraft.worlds.deepracer.env.kernels.camera import (
    FIELD,
    LEVEL,
    SKY,
    add_backdrop,
    add_ground,
    grow_grass,
    render_frame,
    sum_columns,
)


@kernel
def render_pair(scene, optics, x, y, yaw, half, palette, frames):
    """Write what a car at (x, y, yaw) sees with two eyes into frames (2, H, W), left before right, uint8.

    Args:
        scene: Scene.
        optics: Optics of either eye.
        x: Of base_link, m.
        y: Of base_link, m.
        yaw: rad, left positive.
        half: How far beside the car's middle plane an eye sits, m.
        palette: (M,) level of each material, 0 to 255.
        frames: (2, H, W) uint8, written.
    """
    if optics.sin_roll != 0.0:  # each leans about its own axis, and what is on the ground has no common height
        for eye in range(2):
            left = half if eye == 0 else -half
            render_frame(scene, optics, x - math.sin(yaw) * left, y + math.cos(yaw) * left, yaw, palette, frames[eye])
        return
    height, width = frames.shape[1], frames.shape[2]
    differences = np.zeros((2, height + 1, width), np.int16)
    levels = np.empty(palette.shape[0], np.int32)
    for material in range(levels.shape[0]):
        levels[material] = int(palette[material] * LEVEL + 0.5)
    cosine, sine = math.cos(yaw), math.sin(yaw)
    middle_x, middle_y = x + cosine * optics.mount_x, y + sine * optics.mount_x
    add_ground(differences, scene, optics, middle_x, middle_y, cosine, sine, np.array([half, -half]), levels)
    for eye in range(2):
        left = half if eye == 0 else -half
        eye_x, eye_y = middle_x - sine * left, middle_y + cosine * left
        add_backdrop(differences[eye], scene, optics, eye_x, eye_y, cosine, sine, levels)
        sum_columns(differences[eye], levels[SKY], frames[eye])
        if optics.grain > 0.0:
            grow_grass(frames[eye], scene, optics, eye_x, eye_y, cosine, sine, palette[FIELD])


@parallel_kernel
def join_eyes(frames, rows, pairs):
    """Lay left and right frames together, pixel by pixel, as one frame of two channels.

    A row of pixels without gaps is drawn many at a time, so each eye is drawn by itself; and the two bytes of a pixel
    are written as one number of two bytes.

    Args:
        frames: uint8 (N, M, 2, H, W), left before right.
        rows: bool (N, M), which cars' frames are asked for.
        pairs: uint16 (N, M, H, W), written: the left pixel in the byte that comes first in memory.
    """
    for n in prange(frames.shape[0]):
        for m in range(frames.shape[1]):
            if rows[n, m]:
                left, right, pair = frames[n, m, 0], frames[n, m, 1], pairs[n, m]
                for row in range(left.shape[0]):
                    for column in range(left.shape[1]):
                        pair[row, column] = np.uint16(left[row, column]) | (np.uint16(right[row, column]) << 8)
