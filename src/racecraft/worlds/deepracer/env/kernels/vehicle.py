"""One tick of driving, as a kernel; the model and its figures are told in `env/vehicle.py`."""

from __future__ import annotations

import math
from typing import NamedTuple

from racecraft.kernels import kernel
from racecraft.worlds.deepracer.env.vehicle import NO_LIMIT, SUBSTEPS, TICK_SECONDS, WHEELBASE_M

SUBSTEP_SECONDS = TICK_SECONDS / SUBSTEPS


@kernel
def drive(  # noqa: D417, PLR0913
    car, x, y, yaw, speed, steering, old_steering, old_speed, new_steering, new_speed, seconds=TICK_SECONDS,
    substep_seconds=SUBSTEP_SECONDS,
):  # fmt: skip
    """Advance one car by one tick.

    Args:
        car: CarProfile.
        x, y: base_link, m.
        yaw: rad, counter-clockwise.
        speed: Along the car's nose, m/s.
        steering: Angle the wheels have now, rad, positive left.
        old_steering, old_speed: Last tick's command (rad, m/s); it acts until the delays have passed.
        new_steering, new_speed: This tick's command (rad, m/s).
        seconds: How long the tick lasts.
        substep_seconds: How long each step of the integration lasts, about; the world's own by default.

    Returns:
        x, y, yaw, speed, steering after the tick.
    """
    substeps = _substeps(car, seconds, substep_seconds)
    step = substeps.seconds
    for substep in range(substeps.number):
        speed, steering = _controls_after_one(
            car, speed, steering, old_steering, old_speed, new_steering, new_speed, substeps, substep
        )
        turn = speed * driven_curvature(car, speed, steering) * step
        # Along the chord: the heading halfway through the substep, which keeps circles round at any substep.
        heading = yaw + 0.5 * turn
        forward, left = speed * step, car.rotation_centre * turn
        x += forward * math.cos(heading) - left * math.sin(heading)
        y += forward * math.sin(heading) + left * math.cos(heading)
        yaw += turn
    return x, y, wrap_angle(yaw), speed, steering


@kernel
def controls_after(
    car, speed, steering, old_steering, old_speed, new_steering, new_speed, seconds=TICK_SECONDS,
    substep_seconds=SUBSTEP_SECONDS,
):  # fmt: skip
    """Return the speed (m/s) and the angle of the wheels (rad) that `drive` comes to; no place has a part in them."""
    substeps = _substeps(car, seconds, substep_seconds)
    for substep in range(substeps.number):
        speed, steering = _controls_after_one(
            car, speed, steering, old_steering, old_speed, new_steering, new_speed, substeps, substep
        )
    return speed, steering


class _Substeps(NamedTuple):
    """How a tick is integrated."""

    number: int
    seconds: float
    """s of each."""
    steering_share: float
    """Share of their way to the commanded angle that the wheels turn in one."""
    steering_from: int
    """The first one in which the new angle acts."""
    speed_from: int
    """The first one in which the new speed acts."""


@kernel
def _substeps(car, seconds, substep_seconds):
    number = max(1, int(seconds / substep_seconds + 0.5))
    step = seconds / number
    steering_share = 1.0
    if car.steering_lag > 0.0:
        steering_share = 1.0 - math.exp(-step / car.steering_lag)
    return _Substeps(
        number, step, steering_share, int(car.steering_delay / step + 0.5), int(car.speed_delay / step + 0.5)
    )


@kernel
def _controls_after_one(
    car, speed, steering, old_steering, old_speed, new_steering, new_speed, substeps, substep
):  # fmt: skip
    """Return speed (m/s) and angle of the wheels (rad) after one substep."""
    steering_command = new_steering if substep >= substeps.steering_from else old_steering
    speed_command = new_speed if substep >= substeps.speed_from else old_speed
    steering += (steering_command - steering) * substeps.steering_share
    return approach_speed(car, speed, speed_command, substeps.seconds), steering


@kernel
def driven_curvature(car, speed, steering):
    """Return how sharply the car turns, 1/m, left positive: what its wheels ask for, as far as its tyres hold."""
    tangent = math.tan(steering)
    curvature = car.curvature_gain * tangent * (1.0 - car.curvature_droop * abs(tangent)) / WHEELBASE_M
    if car.curvature_fade > 0.0:
        curvature = curvature / (1.0 + car.curvature_fade * speed)
    curvature += car.pull
    if car.grip >= NO_LIMIT:
        return curvature
    slide = curvature * speed * speed / car.grip
    slide *= slide
    return curvature / math.sqrt(math.sqrt(1.0 + slide * slide))


@kernel
def approach_speed(car, speed, command, seconds):
    """Return the speed so many seconds later, m/s."""
    target = min(car.speed_gain * command, car.max_speed)
    if car.speed_lag <= 0.0:
        return target
    acceleration = (target - speed) / car.speed_lag
    acceleration = min(max(acceleration, -car.max_braking), car.max_acceleration)
    return speed + acceleration * seconds


@kernel
def wrap_angle(angle):
    """Return the angle in [-pi, pi], rad."""
    return math.atan2(math.sin(angle), math.cos(angle))


@kernel
def wheels_after(profile, car, steering, seconds):
    """Return the angle of the wheels, rad, after they were told so for so many seconds."""
    _, angle = controls_after(profile, 0.0, car.steering, car.old_steering, 0.0, steering, 0.0, seconds)
    return angle
