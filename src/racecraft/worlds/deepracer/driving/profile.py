"""The speed a car can hold along a line, by its limits. Begin with `with_speeds`.

At every point the car must be able to turn as sharply as the line bends; between points it accelerates and brakes
within its limits. Lags of steering are left out, so that the time is one that the car does not quite reach.
"""

from __future__ import annotations

import numpy as np

from racecraft.worlds.deepracer.driving.racing_line import RacingLine, curvatures
from racecraft.worlds.deepracer.driving.road_frame import RoadFrame, running_length
from racecraft.worlds.deepracer.env.vehicle import (
    MAX_STEERING_RAD,
    MIN_SPEED_MPS,
    NO_LIMIT,
    WHEELBASE_M,
    CarProfile,
)

SPEEDS = np.linspace(0.05, 4.5, 446)
"""Speeds at which cornering is tabulated, m/s."""


def with_speeds(frame: RoadFrame, offset: np.ndarray, car: CarProfile, top_speed: float) -> RacingLine:
    """Return the line at offsets (N,) m with the highest speeds that the car can hold.

    Args:
        frame: The road.
        offset: m left of the centre line.
        car: How the car answers.
        top_speed: Largest speed command, m/s.
    """
    xy = frame.points(offset)
    step = np.diff(running_length(np.concatenate([xy, xy[:1]]) if frame.closed else xy))
    speed = corner_speeds(car, top_speed, curvatures(xy, frame.closed))
    if not frame.closed:
        speed[0] = 0.0
    speed = within_limits(car, top_speed, speed, step, frame.closed)
    after = np.roll(speed, -1) if frame.closed else speed[1:]
    seconds = 2.0 * step / np.maximum(speed[: len(step)] + after, 1e-3)
    return RacingLine.on_road(frame, offset, speed, seconds)


def steady_curvature(car: CarProfile, speed: np.ndarray, steering: np.ndarray) -> np.ndarray:
    """Return the curvature a car drives at steady speed (m/s) and wheel angle (rad), 1/m; the pull is left out."""
    tangent = np.tan(steering)
    curvature = car.curvature_gain * tangent * (1.0 - car.curvature_droop * np.abs(tangent)) / WHEELBASE_M
    curvature = curvature / (1.0 + car.curvature_fade * speed)
    if car.grip >= NO_LIMIT:
        return curvature
    return curvature / (1.0 + (curvature * speed**2 / car.grip) ** 4) ** 0.25


def sharpest_curvature(car: CarProfile, top_speed: float, speed: np.ndarray) -> np.ndarray:
    """Return the largest curvature at each speed (m/s), 1/m; NaN for speeds that the car does not reach."""
    reached = speed <= min(car.speed_gain * top_speed, car.max_speed)
    return np.where(reached, steady_curvature(car, speed, np.full_like(speed, MAX_STEERING_RAD)), np.nan)


def corner_speeds(car: CarProfile, top_speed: float, curvature: np.ndarray) -> np.ndarray:
    """Return (N,) m/s, the highest speed at which the car turns as sharply as curvature (N,), 1/m."""
    sharpest = sharpest_curvature(car, top_speed, SPEEDS)
    reached = SPEEDS[~np.isnan(sharpest)]
    sharpest = np.minimum.accumulate(sharpest[~np.isnan(sharpest)])
    return np.interp(-np.abs(curvature), -sharpest, reached)


def within_limits(car: CarProfile, top_speed: float, speed: np.ndarray, step: np.ndarray, closed: bool) -> np.ndarray:
    """Return speeds (N,) lowered to where the car accelerates and brakes within its limits between points."""
    speed = speed.copy()
    count, lag = len(speed), max(car.speed_lag, 1e-6)
    slowest = car.speed_gain * MIN_SPEED_MPS
    quickest = min(car.speed_gain * top_speed, car.max_speed)
    for i in range(2 * count if closed else count - 1):
        here, after = i % count, (i + 1) % count
        gain = min(car.max_acceleration, (quickest - speed[here]) / lag)
        speed[after] = min(speed[after], np.sqrt(speed[here] ** 2 + 2.0 * max(gain, 0.0) * step[here]))
    for i in range(2 * count if closed else count - 1, 0, -1):
        here, before = i % count, (i - 1) % count
        loss = min(car.max_braking, (speed[here] - slowest) / lag)
        speed[before] = min(speed[before], np.sqrt(speed[here] ** 2 + 2.0 * max(loss, 0.1) * step[before]))
    return speed
