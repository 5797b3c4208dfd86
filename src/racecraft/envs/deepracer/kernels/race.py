"""The bodies of one tick; the order of acts and their reasons are told in `envs/deepracer/race.py`.

`car` is one CAR_STATE record, `report` one TICK_REPORT record, `profile` one PROFILE record; cars and reports are
written in place. The acts of a world stand as loops over its cars in `tick` itself: to hand track and scene to a
function of its own for each act of each world would cost a twentieth of the tick.
"""

from __future__ import annotations

import math

import numpy as np

from racecraft.envs.deepracer.camera import Optics
from racecraft.envs.deepracer.kernels.around import look_about
from racecraft.envs.deepracer.kernels.bots import drive_bots
from racecraft.envs.deepracer.kernels.boxes import draw_boxes, is_in_frame
from racecraft.envs.deepracer.kernels.camera import render_frame
from racecraft.envs.deepracer.kernels.eyes import render_pair
from racecraft.envs.deepracer.kernels.lidar import look_around, tell
from racecraft.envs.deepracer.kernels.objects import car_touches, hits, is_to_blame, object_near, objects_around
from racecraft.envs.deepracer.kernels.placing import place_objects
from racecraft.envs.deepracer.kernels.vehicle import drive
from racecraft.envs.deepracer.race import (
    CRASHED,
    CRITIC_LOOKS_AHEAD_M,
    CRITIC_NUMBERS,
    CRITIC_OBJECT_BEHIND_M,
    CRITIC_OBJECT_REACH_M,
    CRITIC_OBJECTS,
    IMMOBILISED,
    IMMOBILISED_M,
    IMMOBILISED_TICKS,
    IN_PROGRESS,
    LAP_COMPLETE,
    OFF_TRACK,
    PARK,
    PAUSE,
    PREPARE,
    REVERSED,
    REVERSED_TICKS,
    START_CLEAR_M,
    START_GAP_M,
    START_LANE,
    START_MARGIN_M,
    START_OBJECT_M,
    TIME_UP,
)
from racecraft.envs.deepracer.vehicle import FRONT_POINT_M, FRONT_WHEELS_M, REAR_WHEELS_M, TICK_SECONDS
from racecraft.kernels import kernel, parallel_kernel, prange
from racecraft.kernels.chance import normal_at, uniform_at
from racecraft.tracks.kernels.geometry import (
    is_on_road,
    locate_point,
    nearer_waypoint,
    pose_on_line,
    waypoints_around,
)

DRAWS_A_TICK = 3
"""What a car takes of its stream of chance in a tick: one draw for the length, two for the push on its wheels."""

REAR_X, REAR_Y = REAR_WHEELS_M
FRONT_X, FRONT_Y = FRONT_WHEELS_M


@parallel_kernel
def line_up(
    track, plan, objects, around, scene, optics, eyes, lidar, palettes, keys,
    cars, ranges, frames, critic_views, lidar_views,
):  # fmt: skip
    """Put objects in their places and the cars at the start of their episode, clear of one another, and look."""
    for n in prange(cars.shape[0]):
        for m in range(cars.shape[1]):
            take_start(track, cars[n, m])
        place_objects(track, plan, objects, cars[:, :1], n)
        for m in range(cars.shape[1]):
            make_room(track, objects, cars, n, m, m)
        look_about(track, objects, cars, around, n)
        for m in range(cars.shape[1]):
            look(track, around, scene, optics, eyes, palettes, cars, n, m, frames[n, m], critic_views[n, m])
            look_around(lidar, scene, objects, cars, n, m, keys[n, m], ranges[n, m], lidar_views[n, m])


@parallel_kernel
def look_again(
    track, objects, around, scene, optics, eyes, lidar, palettes, rows, cars, ranges, frames, critic_views, lidar_views
):  # fmt: skip
    """Look once more from where cars are, bool (N, M): after loading a saved race, or with other eyes.

    A LiDAR's newest reading stands.
    """
    for n in prange(cars.shape[0]):
        look_about(track, objects, cars, around, n)
        for m in range(cars.shape[1]):
            if rows[n, m]:
                look(track, around, scene, optics, eyes, palettes, cars, n, m, frames[n, m], critic_views[n, m])
                tell(lidar, ranges[n, m], lidar_views[n, m])


@parallel_kernel
def tick(
    track, plan, objects, around, profiles, rules, scene, optics, eyes, lidar, palettes, numbers, chosen, sent, parked,
    keys, cars, reports, ranges, frames, critic_views, lidar_views, last_frames, last_critic_views, last_lidar_views,
):  # fmt: skip
    """Advance N worlds of M cars by one tick.

    Args:
        track: TrackArrays.
        plan: ObjectPlan.
        objects: Objects of the N worlds, driven on and placed anew in place.
        around: Around, what each car finds at this moment; written anew whenever cars have moved.
        profiles: PROFILE (N, M).
        rules: Rules.
        scene: Scene, for `render_frame`.
        optics: OPTICS (N, M), every car's camera.
        eyes: float64 (E,), how far left of the car's middle each eye sits, m.
        lidar: MountedLidar; without one the views of it are empty.
        palettes: float64 (N, M, P), the level of each material to every car.
        numbers: (N, M) int64, each action's number in its table, for the reports.
        chosen: (N, M, 2) commanded steering in rad and speed in m/s, as the policy chose them.
        sent: (N, M, 2) the same as sent to the cars.
        parked: (N, M) bool, cars that take no part: they stand, and their reports say so.
        keys: (N, M) uint64, each car's own stream of chance.
        cars: CAR_STATE (N, M), advanced in place.
        reports: TICK_REPORT (N, M), written.
        ranges: float64 (N, M, 64), each LiDAR's newest reading, m; stands until the next.
        frames: uint8 (N, M, E, H, W), what is seen after the tick.
        critic_views: float32 (N, M, CRITIC_NUMBERS), likewise.
        lidar_views: float32 (N, M, L), likewise; L is 0 without a LiDAR.
        last_frames: As `frames`, written for cars whose episode ended: its last observation.
        last_critic_views: As `critic_views`, likewise.
        last_lidar_views: As `lidar_views`, likewise.
    """
    for n in prange(cars.shape[0]):
        for m in range(cars.shape[1]):
            if parked[n, m]:
                report_parked(reports[n, m])
            else:
                report_moment(track, cars[n, m], reports[n, m], numbers[n, m], chosen[n, m, 0], chosen[n, m, 1])
                report_objects(track, plan, around, optics[n, m], cars[n, m], reports[n, m], n, m)
                call_endings(rules, cars[n, m], reports[n, m])
        for m in range(cars.shape[1]):
            if cars[n, m].held > 0:
                cars[n, m].held -= 1
            elif not parked[n, m]:
                seconds = tick_length(rules, cars[n, m], keys[n, m])
                push_wheels(rules, cars[n, m], keys[n, m])
                obey(profiles[n, m], cars[n, m], sent[n, m, 0], sent[n, m, 1], seconds)
                locate(track, cars[n, m])
        drive_bots(track, plan, objects, reports, n)
        look_about(track, objects, cars, around, n)
        is_anew = False
        for m in range(cars.shape[1]):
            if reports[n, m].terminated or reports[n, m].truncated:
                look(
                    track, around, scene, optics, eyes, palettes, cars, n, m,
                    last_frames[n, m], last_critic_views[n, m],
                )  # fmt: skip
                look_around(lidar, scene, objects, cars, n, m, keys[n, m], ranges[n, m], last_lidar_views[n, m])
        for m in range(cars.shape[1]):
            if reports[n, m].terminated or reports[n, m].truncated:
                is_anew = True
                restart(track, profiles[n, m], rules, cars, n, m)
                if m == 0:
                    place_objects(track, plan, objects, cars, n)
                make_room(track, objects, cars, n, m, cars.shape[1])
        if is_anew:
            look_about(track, objects, cars, around, n)
        for m in range(cars.shape[1]):
            look(track, around, scene, optics, eyes, palettes, cars, n, m, frames[n, m], critic_views[n, m])
            look_around(lidar, scene, objects, cars, n, m, keys[n, m], ranges[n, m], lidar_views[n, m])


@parallel_kernel
def settle(track, objects, cars, around):
    """Write down anew what every car finds around it, as after cars were parked."""
    for n in prange(cars.shape[0]):
        look_about(track, objects, cars, around, n)


@kernel
def report_parked(report):
    """Write down a car that takes no part."""
    report.status, report.terminated, report.truncated = PARK, False, False
    report.object_hit, report.is_crashed = -1, False


@kernel
def report_moment(track, car, report, action, steering, speed):
    """Write down the moment the action was chosen at: the reward's parameters."""
    car.ticks += 1
    car.lap_ticks += 1
    car.total_ticks += 1
    report.episode, report.steps = car.episode, float(car.ticks)
    report.x, report.y, report.yaw = car.x, car.y, car.yaw
    report.front_x, report.front_y = car.front_x, car.front_y
    report.action, report.speed, report.steering = action, speed, steering
    report.driven_speed, report.driven_steering = car.speed, car.steering
    report.progress, report.arc = car.progress, car.arc
    report.centre_distance, report.track_width = car.centre_distance, car.track_width
    report.waypoint_before, report.waypoint_after = car.waypoint_before, car.waypoint_after
    report.waypoint_nearest = nearer_waypoint(track, car.waypoint_before, car.waypoint_after, car.front_x, car.front_y)
    report.is_left = (car.border_inner < car.border_outer) == track.is_ccw
    report.all_wheels_on, report.is_off = car.wheels_on == 4, car.wheels_on == 0
    report.time = car.total_ticks * TICK_SECONDS
    report.lap_seconds = car.lap_ticks * TICK_SECONDS
    report.start_share, report.laps = car.start_share, car.laps


@kernel
def report_objects(track, plan, around, optics, car, report, n, m):
    """Write down which objects and other cars are near, touched and seen at this moment."""
    count = around.counts[n, m]
    boxes, states = around.boxes[n, m, :count], around.states[n, m, :count]
    report.object_before, report.object_after, report.object_hit = 0, 0, -1
    report.is_crashed = report.object_in_camera = False
    if count == 0:
        return
    report.object_before, report.object_after = objects_around(states, car.arc, track.length)
    report.object_in_camera = is_in_frame(optics, boxes[report.object_after], car.x, car.y, car.yaw)
    if car.preparing or car.held > 0:
        return
    for k in range(count):
        if not report.is_crashed and hits(plan, boxes, states, k, car.x, car.y, car.yaw):
            report.is_crashed = is_to_blame(plan, states, k, car.arc, track.length)
            if report.is_crashed or report.object_hit < 0:
                report.object_hit = k


@kernel
def call_endings(rules, car, report):
    """Name how the row stands, in the marshal's order, and whether the episode ends with it."""
    report.terminated = False
    report.truncated = False
    report.status = IN_PROGRESS
    if car.held > 0:
        report.status = PAUSE
    elif car.progress >= 100.0:
        report.status = LAP_COMPLETE
        car.laps += 1
        report.laps = car.laps
        report.terminated = car.laps >= rules.laps
    elif report.is_crashed:
        report.status, report.terminated = CRASHED, True
    elif car.wheels_on == 0:
        report.status, report.terminated = OFF_TRACK, True
    elif car.preparing:
        report.status = PREPARE
    elif car.still_ticks >= IMMOBILISED_TICKS:
        report.status, report.terminated = IMMOBILISED, True
    elif car.backward_ticks >= REVERSED_TICKS:
        report.status, report.terminated = REVERSED, True
    if car.ticks >= rules.max_ticks and not report.terminated:
        if rules.cut_ends:
            report.status, report.terminated = TIME_UP, True
        else:
            report.truncated = True
    if report.status == LAP_COMPLETE:  # the next flying lap begins here, and its progress at zero
        car.lap_ticks = 0
        car.progress = 0.0


@kernel
def tick_length(rules, car, key):
    """Return how long this tick lasts, s."""
    if rules.jitter <= 0.0:
        return TICK_SECONDS
    draw = uniform_at(key, np.uint64(DRAWS_A_TICK * car.total_ticks))
    return TICK_SECONDS * (1.0 + rules.jitter * (2.0 * draw - 1.0))


@kernel
def push_wheels(rules, car, key):
    """Push the wheels out of the angle they have, as the ground does to weak hinges."""
    if rules.wheel_kick > 0.0:
        car.steering += rules.wheel_kick * normal_at(key, np.uint64(DRAWS_A_TICK * car.total_ticks + 1))


@kernel
def obey(profile, car, steering, speed, seconds):
    """Let the command act for so many seconds; a car that is being prepared is held, its wheels steered straight."""
    if car.preparing:
        car.preparing = False
        car.steering = wheels_after(profile, car, 0.0, seconds)
        return
    x, y = car.x, car.y
    car.x, car.y, car.yaw, car.speed, car.steering = drive(
        profile, x, y, car.yaw, car.speed, car.steering, car.old_steering, car.old_speed, steering, speed, seconds
    )
    car.old_steering, car.old_speed = steering, speed
    moved = math.hypot(car.x - x, car.y - y)
    car.still_ticks = car.still_ticks + 1 if moved <= IMMOBILISED_M else 0


@kernel
def wheels_after(profile, car, steering, seconds):
    """Return the angle of the wheels, rad, after they were told so for so many seconds."""
    _, _, _, _, angle = drive(profile, 0.0, 0.0, 0.0, 0.0, car.steering, car.old_steering, 0.0, steering, 0.0, seconds)
    return angle


@kernel
def locate(track, car):
    """Write down where the car now lies, and count falling progress."""
    cos, sin = math.cos(car.yaw), math.sin(car.yaw)
    x, y = car.x + cos * FRONT_POINT_M, car.y + sin * FRONT_POINT_M
    arc, distance, _, _, ix, iy, ox, oy = locate_point(track, x, y)
    before, after = waypoints_around(track.arc, arc)
    car.front_x, car.front_y, car.arc, car.centre_distance = x, y, arc, distance
    car.waypoint_before, car.waypoint_after = before, after
    car.border_inner, car.border_outer = math.hypot(x - ix, y - iy), math.hypot(x - ox, y - oy)
    car.track_width = math.hypot(ix - ox, iy - oy)
    car.wheels_on = wheels_on_road(track, car.x, car.y, cos, sin)
    car.last_progress = car.progress
    car.progress = progress_percent(arc / track.length, car.start_share, car.last_progress)
    falling = car.progress < car.last_progress and not car.preparing
    car.backward_ticks = car.backward_ticks + 1 if falling else 0


@kernel
def progress_percent(lap_share, start_share, last_progress):
    """Return the share of the lap covered since the start, per cent (facts 3.3; simapp `agent_ctrl/utils.py`).

    The jump at the start line is undone by looking at the tick before; never more than 100.
    """
    progress = 100.0 * (lap_share - start_share)
    if progress <= 0.0:
        progress += 100.0
    if last_progress > progress + 50.0:
        progress += 100.0
    if progress > last_progress + 50.0:
        progress -= 100.0
    return min(progress, 100.0)


@kernel
def wheels_on_road(track, x, y, cos, sin):
    """Return how many of the four wheel centres lie strictly inside the road."""
    count = 0
    for ahead, left in ((REAR_X, REAR_Y), (FRONT_X, FRONT_Y), (REAR_X, -REAR_Y), (FRONT_X, -FRONT_Y)):
        if is_on_road(track, x + cos * ahead - sin * left, y + sin * ahead + cos * left):
            count += 1
    return count


@kernel
def restart(track, profile, rules, cars, n, m):
    """Send an ended car to its next start; the reset takes a tick, in which its wheels still obey the last command."""
    car = cars[n, m]
    wheels = wheels_after(profile, car, car.old_steering, TICK_SECONDS) if rules.keeps_wheels else 0.0
    car.start_share = (car.start_share + rules.start_advance) % 1.0
    if rules.start_ahead > 0.0 and track.closed and cars.shape[1] > 1:
        other = cars[n, (m + 1) % cars.shape[1]]
        car.start_share = (other.arc + rules.start_ahead) / track.length % 1.0
    car.episode += 1
    car.ended_yaw = car.yaw
    take_start(track, car)
    car.steering = wheels


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
        car.start_share = (car.start_share - START_GAP_M / track.length) % 1.0
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
    car.ticks = car.lap_ticks = car.laps = car.still_ticks = car.backward_ticks = 0
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


@parallel_kernel
def look_with(scene, optics, eyes, palette, around, cars, rows, frames):
    """Draw into frames (R, E, H, W) what cars (world, number), rows (R, 2), see with another camera."""
    for row in prange(rows.shape[0]):
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
        cos, sin = math.cos(car.yaw), math.sin(car.yaw)
        for eye in range(eyes.shape[0]):
            x, y = car.x - sin * eyes[eye], car.y + cos * eyes[eye]
            draw_boxes(camera, boxes, paints, x, y, car.yaw, palette, frame[eye])


@kernel
def look(track, around, scene, optics, eyes, palettes, cars, n, m, frame, critic_view):
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
def as_optics(record):
    """Return a camera's record as the plain numbers that stay in registers while a frame is drawn."""
    return Optics(
        record.focal, record.middle_x, record.middle_y, record.cos_pitch, record.sin_pitch, record.mount_x,
        record.mount_z, record.side, record.side_norm, record.ground_near, record.cos_roll, record.sin_roll,
        record.grain,
    )  # fmt: skip


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
