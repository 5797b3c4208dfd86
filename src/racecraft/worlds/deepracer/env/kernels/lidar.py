"""A LiDAR's beams, as kernels: how far along each of 64 beams something solid stands. Begin at `scan`.

Beams lie in one plane at the LiDAR's height, so the world is flat to them: boxes and other cars are rectangles, the
field is a rectangle with four walls around it. Only the beams that a rectangle can lie in are tried on it: as seen from
the LiDAR it fills an angle, and beams are evenly spread.
"""

from __future__ import annotations

import math

import numpy as np

from racecraft.kernels import kernel, parallel_kernel, prange
from racecraft.kernels.rng import normal_at, random_bits
from racecraft.worlds.deepracer.env.sensors import BEAM_STEP_RAD, FIRST_BEAM_RAD, NEAREST_M
from racecraft.worlds.deepracer.env.vehicle import TICKS_PER_SECOND
from racecraft.worlds.deepracer.files.lidar_config import BEAMS

SHELL_AHEAD_M, SHELL_HALF_LENGTH_M, SHELL_HALF_WIDTH_M, SHELL_HEIGHT_M = 0.004, 0.162, 0.094, 0.195
"""The body of another car: where its middle lies ahead of base_link, half its sides, its height (facts 1.1)."""
LIDAR_STREAM = np.uint64(0x9E6C63D0876A3F6B)
"""Which draw of a car's own stream of chance begins that of its LiDAR."""
_BEAM_ANGLES = FIRST_BEAM_RAD + BEAM_STEP_RAD * np.arange(BEAMS)
BEAM_COS, BEAM_SIN = np.cos(_BEAM_ANGLES), np.sin(_BEAM_ANGLES)
TURN = 2.0 * math.pi
TICKS = round(TICKS_PER_SECOND)


@parallel_kernel
def scan_poses(lidar, scene, poses, boxes, ranges):
    """Cast the beams of R lone cars at poses (R, 3), each among boxes (R, K, 6), into ranges (R, 64), m."""
    for place in prange(poses.shape[0]):
        row = np.int64(place)
        begin_scan(lidar, scene, poses[row, 0], poses[row, 1], poses[row, 2], ranges[row])
        add_boxes(lidar, poses[row, 0], poses[row, 1], poses[row, 2], boxes[row], ranges[row])


@parallel_kernel
def look_around_with(lidar, scene, objects, cars, rows, keys, ranges, views):
    """Let cars (world, number), rows (R, 2), look round with a LiDAR that is not their world's; see `look_around`."""
    for place in prange(rows.shape[0]):
        row = np.int64(place)
        n, m = rows[row, 0], rows[row, 1]
        look_around(lidar, scene, objects, cars, n, m, keys[n, m], ranges[row], views[row])


@kernel
def look_around(lidar, scene, objects, cars, n, m, key, ranges, view):
    """Take a reading for car m of world n where one is due, and tell the policy of the newest; nothing without LiDAR.

    Args:
        lidar: MountedLidar.
        scene: Scene; its field's corners and the height of its walls.
        objects: Objects of the N worlds.
        cars: CAR_STATE (N, M); the others of the world are in the way.
        n: World of the car that looks.
        m: Its number in the world.
        key: Its own stream of chance.
        ranges: float64 (64,), its newest reading, m; stands between readings.
        view: float32 (L,), what the policy is told; L is 0 where there is no LiDAR.
    """
    if view.shape[0] == 0:
        return
    if is_due(lidar, cars[n, m]):
        car = cars[n, m]
        begin_scan(lidar, scene, car.x, car.y, car.yaw, ranges)
        add_boxes(lidar, car.x, car.y, car.yaw, objects.boxes[n], ranges)
        for other in range(cars.shape[1]):
            if other != m and not cars[n, other].away:
                add_car(lidar, car, cars[n, other], ranges)
        add_noise(lidar, car, key, ranges)
    write_ranges(lidar, ranges, view)


@kernel
def is_due(lidar, car):
    """Tell whether the LiDAR has turned since the tick before; at the start of an episode it always has."""
    if car.preparing:
        return True
    return car.total_ticks * lidar.hertz // TICKS > (car.total_ticks - 1) * lidar.hertz // TICKS


@kernel
def begin_scan(lidar, scene, x, y, yaw, ranges):
    """Let every beam run until it meets the inner face of a wall, or for the LiDAR's reach.

    From outside the field one looks through its walls, as a camera does.
    """
    ranges[:] = lidar.reach
    if scene.wall_height <= lidar.z:
        return
    eye_x, eye_y = x + math.cos(yaw) * lidar.x, y + math.sin(yaw) * lidar.x
    to_west, to_south = scene.field_corners[0, 0] - eye_x, scene.field_corners[0, 1] - eye_y
    to_east, to_north = scene.field_corners[2, 0] - eye_x, scene.field_corners[2, 1] - eye_y
    if to_west > 0.0 or to_south > 0.0 or to_east < 0.0 or to_north < 0.0:
        return
    if min(min(-to_west, -to_south), min(to_east, to_north)) > lidar.reach:
        return
    cos, sin = math.cos(yaw + lidar.yaw), math.sin(yaw + lidar.yaw)
    for beam in range(BEAMS):
        along_x = cos * BEAM_COS[beam] - sin * BEAM_SIN[beam]
        along_y = sin * BEAM_COS[beam] + cos * BEAM_SIN[beam]
        far = ranges[beam]
        if along_x != 0.0:
            far = min(far, (to_east if along_x > 0.0 else to_west) / along_x)
        if along_y != 0.0:
            far = min(far, (to_north if along_y > 0.0 else to_south) / along_y)
        ranges[beam] = far


@kernel
def add_boxes(lidar, x, y, yaw, boxes, ranges):
    """Cut beams short at boxes (K, 6) that stand as high as the LiDAR."""
    for k in range(boxes.shape[0]):
        if boxes[k, 5] > lidar.z:
            add_rectangle(
                lidar, x, y, yaw, boxes[k, 0], boxes[k, 1], boxes[k, 2], boxes[k, 3], boxes[k, 4], ranges
            )  # fmt: skip


@kernel
def add_car(lidar, car, other, ranges):
    """Cut beams short at another car's body."""
    if lidar.z < SHELL_HEIGHT_M:
        middle_x = other.x + math.cos(other.yaw) * SHELL_AHEAD_M
        middle_y = other.y + math.sin(other.yaw) * SHELL_AHEAD_M
        add_rectangle(
            lidar, car.x, car.y, car.yaw, middle_x, middle_y, other.yaw, SHELL_HALF_LENGTH_M, SHELL_HALF_WIDTH_M, ranges
        )


@kernel
def add_rectangle(lidar, x, y, yaw, box_x, box_y, box_yaw, half_length, half_width, ranges):
    """Cut the beams of a LiDAR on a car at (x, y, yaw) short at a rectangle; from inside it, they end at once."""
    dx = box_x - x - math.cos(yaw) * lidar.x
    dy = box_y - y - math.sin(yaw) * lidar.x
    distance, radius = math.hypot(dx, dy), math.hypot(half_length, half_width)
    if distance - radius > lidar.reach:
        return
    nose = yaw + lidar.yaw
    half_angle = math.asin(radius / distance) if distance > radius else TURN
    middle = math.atan2(dy, dx) - nose
    middle -= TURN * math.floor(middle / TURN + 0.5)
    box_cos, box_sin = math.cos(box_yaw), math.sin(box_yaw)
    eye_ahead, eye_left = -(dx * box_cos + dy * box_sin), -(dy * box_cos - dx * box_sin)
    cos, sin = math.cos(nose - box_yaw), math.sin(nose - box_yaw)
    for turn in range(-1, 2):  # what lies across the tail is met once from either side
        centre = (middle + turn * TURN - FIRST_BEAM_RAD) / BEAM_STEP_RAD
        first = max(0, math.ceil(centre - half_angle / BEAM_STEP_RAD))
        last = min(BEAMS - 1, math.floor(centre + half_angle / BEAM_STEP_RAD))
        for beam in range(first, last + 1):
            ahead = cos * BEAM_COS[beam] - sin * BEAM_SIN[beam]
            left = sin * BEAM_COS[beam] + cos * BEAM_SIN[beam]
            met = enters_at(eye_ahead, eye_left, ahead, left, half_length, half_width)
            if met < ranges[beam]:
                ranges[beam] = met


@kernel
def enters_at(eye_ahead, eye_left, ahead, left, half_length, half_width):
    """Return how far along a beam, in a rectangle's own frame, it enters the rectangle; inf where it never does."""
    enters, leaves = 0.0, math.inf
    if abs(ahead) > 1e-12:
        near, far = (-half_length - eye_ahead) / ahead, (half_length - eye_ahead) / ahead
        enters, leaves = max(enters, min(near, far)), min(leaves, max(near, far))
    elif abs(eye_ahead) > half_length:
        return math.inf
    if abs(left) > 1e-12:
        near, far = (-half_width - eye_left) / left, (half_width - eye_left) / left
        enters, leaves = max(enters, min(near, far)), min(leaves, max(near, far))
    elif abs(eye_left) > half_width:
        return math.inf
    return enters if enters <= leaves else math.inf


@kernel
def add_noise(lidar, car, key, ranges):
    """Let every reading that met something stray."""
    if lidar.noise <= 0.0:
        return
    stream = random_bits(key, LIDAR_STREAM)
    for beam in range(BEAMS):
        if ranges[beam] < lidar.reach:
            draw = np.uint64(2 * (BEAMS * car.total_ticks + beam))
            ranges[beam] += lidar.noise * normal_at(stream, draw)


@kernel
def write_ranges(lidar, ranges, view):
    """Write what the policy is told of a reading (facts 2.2): beams cut to a range, or the nearest in each sector."""
    if view.shape[0] == 0:
        return
    if lidar.sectors == 0:
        for beam in range(BEAMS):
            view[beam] = min(max(ranges[beam], NEAREST_M), lidar.clip)
        return
    view[:] = 0.0
    beams = BEAMS // lidar.sectors
    for sector in range(lidar.sectors):
        nearest = lidar.clip
        for beam in range(sector * beams, (sector + 1) * beams):
            nearest = min(nearest, ranges[beam])
        if nearest < lidar.clip:
            step = math.floor(max(nearest, 0.0) / (lidar.clip / lidar.values))
            view[sector * lidar.values + min(step, lidar.values - 1)] = 1.0
