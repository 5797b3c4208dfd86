"""What a car sees, and what only its critic may see. Begin at `look`."""

from __future__ import annotations

import math

import numpy as np

from racecraft.kernels import kernel, parallel_kernel, prange
from racecraft.worlds.deepracer.env.camera import Optics
from racecraft.worlds.deepracer.env.kernels.boxes import draw_boxes
from racecraft.worlds.deepracer.env.kernels.camera import render_frame
from racecraft.worlds.deepracer.env.kernels.eyes import render_pair
from racecraft.worlds.deepracer.env.race import (
    CRITIC_LOOKS_AHEAD_M,
    CRITIC_NUMBERS,
    CRITIC_OBJECT_BEHIND_M,
    CRITIC_OBJECT_REACH_M,
    CRITIC_OBJECTS,
)
from racecraft.worlds.deepracer.tracks.kernels.geometry import pose_on_line


@parallel_kernel
def look_with(scene, optics, eyes, palette, around, cars, rows, frames):
    """Draw into frames (R, E, H, W) what cars (world, number), rows (R, 2), see with another camera."""
    for place in prange(rows.shape[0]):
        row = np.int64(place)
        draw_view(scene, optics, eyes, palette, around, around.kinds, cars, rows[row, 0], rows[row, 1], frames[row])


@kernel
def draw_view(scene, camera, eyes, palette, around, painted, cars, n, m, frame):
    """Draw what each eye of car m of world n sees, (E, H, W); `painted` says with which row of the palette."""
    car, count = cars[n, m], around.counts[n, m]
    if eyes.shape[0] == 1:
        render_frame(scene, camera, car.x, car.y, car.yaw, palette, frame[0])
    else:
        render_pair(scene, camera, car.x, car.y, car.yaw, eyes[0], palette, frame)
    if count > 0:
        boxes, paints = around.boxes[n, m, :count], painted[n, m, :count]
        draw_boxes(camera, boxes, paints, car.x, car.y, car.yaw, eyes, palette, frame)


@kernel
def render_observations(track, around, scene, optics, eyes, palettes, cars, n, m, frame, critic_view):
    """Draw what each eye of car m of world n sees, and write what only a critic may see.

    The critic's numbers: offset from the centre line over half the road's width (left positive), sine and cosine of the
    heading error, speed in m/s, steering in rad, then for each distance of CRITIC_LOOKS_AHEAD_M sine and cosine of the
    road's direction there against the car's.
    """
    draw_view(scene, as_optics(optics[n, m]), eyes, palettes[n, m], around, around.paints, cars, n, m, frame)
    car, count = cars[n, m], around.counts[n, m]
    left = (car.border_inner < car.border_outer) == track.is_ccw
    _, _, road_yaw = pose_on_line(track.centre, track.arc, track.closed, car.arc)
    offset = car.centre_distance / (0.5 * car.track_width) if car.track_width > 0.0 else 0.0
    critic_view[0] = offset if left else -offset
    critic_view[1], critic_view[2] = math.sin(road_yaw - car.yaw), math.cos(road_yaw - car.yaw)
    critic_view[3], critic_view[4] = car.speed, car.steering
    for k in range(len(CRITIC_LOOKS_AHEAD_M)):
        _, _, ahead_yaw = pose_on_line(track.centre, track.arc, track.closed, car.arc + CRITIC_LOOKS_AHEAD_M[k])
        critic_view[5 + 2 * k] = math.sin(ahead_yaw - car.yaw)
        critic_view[6 + 2 * k] = math.cos(ahead_yaw - car.yaw)
    if critic_view.shape[0] > CRITIC_NUMBERS:
        tell_objects(track, around.states[n, m, :count], car, critic_view[CRITIC_NUMBERS:])


@kernel
def tell_objects(track, states, car, numbers):
    """Write of each of the CRITIC_OBJECTS objects next ahead how near it is, 0 to 1, and how far beside the line.

    The latter is a share of half the road's width where the car is, left positive; both are 0 where nothing is near.
    """
    last_gap, last = -1.0, -1
    for place in range(CRITIC_OBJECTS):
        nearest, found = CRITIC_OBJECT_REACH_M, -1
        for k in range(states.shape[0]):
            gap = (states[k].arc - car.arc + CRITIC_OBJECT_BEHIND_M) % track.length
            is_later = gap > last_gap or (gap == last_gap and k > last)
            if is_later and gap < nearest:
                nearest, found = gap, k
        numbers[2 * place] = numbers[2 * place + 1] = 0.0
        if found >= 0:
            beside = states[found].centre_distance / (0.5 * car.track_width)
            numbers[2 * place] = 1.0 - nearest / CRITIC_OBJECT_REACH_M
            numbers[2 * place + 1] = beside if states[found].is_left else -beside
        last_gap, last = nearest, found


@kernel
def as_optics(record):
    """Return a camera's record as the plain numbers that stay in registers while a frame is drawn."""
    return Optics(
        record.focal, record.middle_x, record.middle_y, record.cos_pitch, record.sin_pitch, record.mount_x,
        record.mount_z, record.side, record.side_norm, record.ground_near, record.cos_roll, record.sin_roll,
        record.grain,
    )  # fmt: skip
