"""The bodies of one tick; the order of acts and their reasons are told in `env/race.py`.

`car` is one CAR_STATE record, `report` one TICK_REPORT record, `profile` one PROFILE record; cars and reports are
written in place. The acts of a world stand as loops over its cars in `tick_world` itself: to hand track and scene to
a function of its own for each act of each world would cost a twentieth of the tick.

Only `tick` is shared among threads: one that is takes twice as long to compile, and the others run once an episode.
"""

from __future__ import annotations

import math

import numpy as np

from racecraft.kernels import kernel, parallel_kernel, prange
from racecraft.kernels.rng import normal_at, uniform_at
from racecraft.worlds.deepracer.env.kernels.bots import drive_bots
from racecraft.worlds.deepracer.env.kernels.boxes import is_in_frame
from racecraft.worlds.deepracer.env.kernels.lidar import look_around, write_ranges
from racecraft.worlds.deepracer.env.kernels.localise import locate
from racecraft.worlds.deepracer.env.kernels.nearby import collect_nearby
from racecraft.worlds.deepracer.env.kernels.objects import hits, is_to_blame, objects_around
from racecraft.worlds.deepracer.env.kernels.observations import render_observations
from racecraft.worlds.deepracer.env.kernels.placing import place_objects
from racecraft.worlds.deepracer.env.kernels.starts import (
    drive_is_over,
    drive_on,
    is_driving_on,
    make_room,
    restart,
    take_start,
)
from racecraft.worlds.deepracer.env.kernels.vehicle import drive, wheels_after
from racecraft.worlds.deepracer.env.race import (
    CRASHED,
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
    TIME_UP,
)
from racecraft.worlds.deepracer.env.vehicle import TICK_SECONDS
from racecraft.worlds.deepracer.tracks.kernels.geometry import nearer_waypoint

DRAWS_A_TICK = 3
"""What a car takes of its stream of chance in a tick: one draw for the length, two for the push on its wheels."""


@kernel
def place_on_grid(
    track, plan, objects, around, scene, optics, eyes, lidar, palettes, keys,
    cars, ranges, frames, critic_views, lidar_views,
):  # fmt: skip
    """Put objects in their places and the cars at the start of their episode, clear of one another, and look."""
    for n in range(cars.shape[0]):
        for m in range(cars.shape[1]):
            take_start(track, cars[n, m])
        place_objects(track, plan, objects, cars, n, np.int64(1))
        for m in range(cars.shape[1]):
            make_room(track, objects, cars, n, m, m)
        collect_nearby(track, objects, cars, around, n)
        for m in range(cars.shape[1]):
            render_observations(
                track, around, scene, optics, eyes, palettes, cars, n, m, frames[n, m], critic_views[n, m]
            )
            look_around(lidar, scene, objects, cars, n, m, keys[n, m], ranges[n, m], lidar_views[n, m])


@kernel
def look_again(
    track, objects, around, scene, optics, eyes, lidar, palettes, rows, cars, ranges, frames, critic_views, lidar_views
):  # fmt: skip
    """Look once more from where cars are, bool (N, M): after loading a saved race, or with other eyes.

    A LiDAR's newest reading stands.
    """
    for n in range(cars.shape[0]):
        collect_nearby(track, objects, cars, around, n)
        for m in range(cars.shape[1]):
            if rows[n, m]:
                render_observations(
                    track, around, scene, optics, eyes, palettes, cars, n, m, frames[n, m], critic_views[n, m]
                )
                write_ranges(lidar, ranges[n, m], lidar_views[n, m])


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
        around: Nearby, what each car finds at this moment; written anew whenever cars have moved.
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
    for world in prange(cars.shape[0]):
        tick_world(
            track, plan, objects, around, profiles, rules, scene, optics, eyes, lidar, palettes, numbers, chosen, sent,
            parked, keys, cars, reports, ranges, frames, critic_views, lidar_views, last_frames, last_critic_views,
            last_lidar_views, np.int64(world),
        )  # fmt: skip


@kernel
def tick_world(
    track, plan, objects, around, profiles, rules, scene, optics, eyes, lidar, palettes, numbers, chosen, sent, parked,
    keys, cars, reports, ranges, frames, critic_views, lidar_views, last_frames, last_critic_views, last_lidar_views,
    n,
):  # fmt: skip
    """Advance world n of them by one tick; the arguments are those of `tick`."""
    for m in range(cars.shape[1]):
        if parked[n, m]:
            report_parked(reports[n, m])
        else:
            report_moment(track, cars[n, m], reports[n, m], numbers[n, m], chosen[n, m, 0], chosen[n, m, 1])
            report_objects(track, plan, around, optics[n, m], cars[n, m], reports[n, m], n, m)
            set_status(rules, cars[n, m], reports[n, m])
    for m in range(cars.shape[1]):
        if cars[n, m].held > 0:
            cars[n, m].held -= 1
        elif not parked[n, m]:
            seconds = tick_length(rules, cars[n, m], keys[n, m])
            push_wheels(rules, cars[n, m], keys[n, m])
            apply_command(profiles[n, m], cars[n, m], sent[n, m, 0], sent[n, m, 1], seconds)
            locate(track, cars[n, m], rules.jumps)
    drive_bots(track, plan, objects, reports, n)
    collect_nearby(track, objects, cars, around, n)
    is_anew = False
    for m in range(cars.shape[1]):
        if reports[n, m].terminated or reports[n, m].truncated:
            render_observations(
                track, around, scene, optics, eyes, palettes, cars, n, m,
                last_frames[n, m], last_critic_views[n, m],
            )  # fmt: skip
            look_around(lidar, scene, objects, cars, n, m, keys[n, m], ranges[n, m], last_lidar_views[n, m])
    for m in range(cars.shape[1]):
        if is_driving_on(rules, cars[n, m], reports[n, m]):
            drive_on(cars[n, m])
        elif reports[n, m].terminated or reports[n, m].truncated:
            is_anew = True
            restart(track, profiles, rules, cars, n, m)
            if m == 0:
                place_objects(track, plan, objects, cars, n, cars.shape[1])
            make_room(track, objects, cars, n, m, cars.shape[1])
    if is_anew:
        collect_nearby(track, objects, cars, around, n)
    for m in range(cars.shape[1]):
        render_observations(track, around, scene, optics, eyes, palettes, cars, n, m, frames[n, m], critic_views[n, m])
        look_around(lidar, scene, objects, cars, n, m, keys[n, m], ranges[n, m], lidar_views[n, m])


@kernel
def refresh_nearby(track, objects, cars, around):
    """Write down anew what every car finds around it, as after cars were parked."""
    for n in range(cars.shape[0]):
        collect_nearby(track, objects, cars, around, n)


@kernel
def report_parked(report):
    """Write down a car that takes no part."""
    report.status, report.terminated, report.truncated = PARK, False, False
    report.object_hit, report.is_crashed = -1, False


@kernel
def report_moment(track, car, report, action, steering, speed):
    """Write down the moment the action was chosen at: the reward's parameters."""
    car.ticks += 1
    car.drive_ticks += 1
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
def set_status(rules, car, report):
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
        report.terminated = car.laps >= rules.laps and not rules.drives_on
        report.truncated = rules.drives_on
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
    if drive_is_over(rules, car) and not report.terminated:
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
def apply_command(profile, car, steering, speed, seconds):
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
