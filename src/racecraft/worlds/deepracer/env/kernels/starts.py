"""Where an episode begins, and how the cars of a world leave room for each other there. Begin at `restart`."""

from __future__ import annotations

import math

from racecraft.kernels import kernel
from racecraft.worlds.deepracer.env.kernels.localise import locate
from racecraft.worlds.deepracer.env.kernels.objects import car_touches, object_near
from racecraft.worlds.deepracer.env.kernels.vehicle import wheels_after
from racecraft.worlds.deepracer.env.race import (
    LAP_COMPLETE,
    PRACTICE,
    START_CLEAR_M,
    START_GAP_M,
    START_LANE,
    START_MARGIN_M,
    START_OBJECT_M,
)
from racecraft.worlds.deepracer.env.vehicle import TICK_SECONDS
from racecraft.worlds.deepracer.tracks.kernels.geometry import locate_point, pose_on_line


@kernel
def restart(track, profiles, rules, cars, n, m):
    """Send an ended car to its next start; the reset takes a tick, in which its wheels still obey the last command."""
    car, profile = cars[n, m], profiles[n, m]
    wheels = wheels_after(profile, car, car.old_steering, TICK_SECONDS) if rules.keeps_wheels else 0.0
    car.start_share = (car.start_share + rules.start_advance) % 1.0
    if rules.start_ahead > 0.0 and track.closed and cars.shape[1] > 1:
        other = (m + 1) % cars.shape[1]
        is_faster = profile.speed_gain > profiles[n, other].speed_gain
        away = -rules.start_ahead if is_faster else rules.start_ahead
        car.start_share = (cars[n, other].arc + away) / track.length % 1.0
    car.episode += 1
    car.drives += 1
    car.ended_yaw = car.yaw
    take_start(track, car)
    car.steering = wheels


@kernel
def drive_is_over(rules, car):
    """Tell whether a car has driven as long from its standing start as it may."""
    return car.drive_ticks >= (rules.practice_ticks if car.drives % PRACTICE else rules.max_ticks)


@kernel
def is_driving_on(rules, car, report):
    """Tell whether a car that just completed a lap goes on from where it is."""
    return rules.drives_on and report.status == LAP_COMPLETE and not drive_is_over(rules, car)


@kernel
def drive_on(car):
    """Begin the next episode at the finish, at speed."""
    car.episode += 1
    car.ended_yaw = car.yaw
    car.ticks = car.lap_ticks = car.laps = 0


@kernel
def make_room(track, objects, cars, n, m, count):
    """See that the start of car m of world n is clear of the world's first `count` cars and of its objects.

    Near an object the car starts in the lane beside it; where neither lane is clear, further back, a gap at a time.
    """
    car = cars[n, m]
    boxes = objects.boxes[n]
    own_lane = car.start_left
    # One car may stand near two or three such places, where the road bends back.
    for _ in range(4 * cars.shape[1] + boxes.shape[0]):
        near = object_near(objects.states[n], car.start_share * track.length, track.length, START_OBJECT_M)
        if near < 0:
            if is_start_clear(cars, boxes, n, m, count):
                return
        else:
            for side in (-1.0, 1.0):
                lane = START_LANE if side * objects.states[n, near].lane > 0.0 else -START_LANE
                restart_in_lane(track, car, lane)
                if is_start_clear(cars, boxes, n, m, count):
                    car.start_left = own_lane
                    return
        car.start_share -= START_GAP_M / track.length
        car.start_share = car.start_share % 1.0 if track.closed else max(0.0, car.start_share)
        restart_in_lane(track, car, own_lane)


@kernel
def restart_in_lane(track, car, lane):
    """Take the start in a lane; the wheels keep the angle they have."""
    wheels = car.steering
    car.start_left = lane
    take_start(track, car)
    car.steering = wheels


@kernel
def is_start_clear(cars, boxes, n, m, count):
    """Tell whether car m of world n stands clear of the world's first `count` cars and of its boxes."""
    car = cars[n, m]
    for other in range(count):
        if other != m and math.hypot(cars[n, other].x - car.x, cars[n, other].y - car.y) < START_CLEAR_M:
            return False
    is_clear = True
    for k in range(boxes.shape[0]):
        is_clear = is_clear and not car_touches(car.x, car.y, car.yaw, START_MARGIN_M, boxes[k])
    return is_clear


@kernel
def take_start(track, car):
    """Put a car at rest at its start, nose along the centre line (forward difference)."""
    car.x, car.y, car.yaw = start_pose(track, car.start_share, car.start_left)
    car.speed = car.steering = car.old_steering = car.old_speed = 0.0
    car.ticks = car.drive_ticks = car.lap_ticks = car.laps = car.still_ticks = car.backward_ticks = 0
    car.progress = 0.0
    car.preparing, car.held, car.away = True, 0, False
    locate(track, car)


@kernel
def start_pose(track, share, left):
    """Return x, y, yaw at a share of the lap, on the centre line or beside it by a share of the half road."""
    x, y, yaw = pose_on_line(track.centre, track.arc, track.closed, share * track.length)
    if left != 0.0:
        _, _, _, _, ix, iy, ox, oy = locate_point(track, x, y)
        aside = 0.5 * left * math.hypot(ix - ox, iy - oy)
        x, y = x - math.sin(yaw) * aside, y + math.cos(yaw) * aside
    return x, y, yaw
