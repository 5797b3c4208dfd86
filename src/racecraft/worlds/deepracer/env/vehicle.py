"""How the car answers steering and throttle: five profiles of one model of few numbers.

The textbook bicycle is badly wrong for this car: its steering lags by 0.1 to 0.5 s, it turns less sharply than its
geometry says, and the faster it goes the less. There have been three real cars, which `scripts/fit_vehicle.py` fits to
some recorded trainings and judges on others that they had not seen; docs/fidelity.md has the table::

    steering  d(delta)/dt = (delta_cmd - delta) / steering_lag
    speed     dv/dt       = clip((min(gain * v_cmd, max_speed) - v) / speed_lag, -max_braking, +max_acceleration)
    asked     a           = curvature_gain * tan(delta) * (1 - curvature_droop * |tan(delta)|) / wheelbase
                            / (1 + curvature_fade * v) + pull
    curvature c           = a / (1 + (|a| v² / grip)^4)^(1/4)
    yaw rate  w           = v * c
    sideways  base_link moves left at `rotation_centre * w`: the centre of rotation lies behind it

Metres, seconds, radians; positive turns left.
"""

from __future__ import annotations

from typing import NamedTuple

TICKS_PER_SECOND = 15.0
"""The camera paces the control loop (simapp `racecar.gazebo`, update_rate 15)."""
TICK_SECONDS = 1.0 / TICKS_PER_SECOND
SUBSTEPS = 10
"""Integration steps in one tick, 6.7 ms each: the profiles' delays are whole numbers of them."""

WHEELBASE_M = 0.163974
FRONT_POINT_M = 0.14
"""The point of the car that x, y and progress speak of lies this far ahead of base_link (`agent_ctrl/constants.py`)."""
REAR_WHEELS_M = (-0.081663, 0.08105)
"""Centres of the rear wheels in base_link: (x, ±y)."""
FRONT_WHEELS_M = (0.082311, 0.079601)
"""Centres of the front wheels in base_link: (x, ±y)."""

BODY_HALF_LENGTH_M, BODY_HALF_WIDTH_M = 0.5 * 0.32352, 0.5 * 0.1961
"""Half of the rectangle round base_link that touches other things (`track_geom/constants.py`)."""

MAX_STEERING_RAD = 0.5235987755982988
"""30 degrees: commands are clipped to it (`rollout_agent_ctrl.py`)."""
MIN_SPEED_MPS, MAX_SPEED_MPS = 0.1, 4.0
"""Speed commands are clipped to this range; a car cannot be told to stand still."""


NO_LIMIT = 1e9
"""A limit that no car reaches."""


class CarProfile(NamedTuple):
    """The parameters of one kind of car; a plain tuple of numbers, so that kernels take it whole."""

    steering_lag: float
    """Time constant of the steering, s; 0 answers at once."""
    steering_delay: float
    """Time before a new steering command acts, s."""
    speed_lag: float
    """Time constant of the speed, s; 0 answers at once."""
    speed_delay: float
    """Time before a new speed command acts, s."""
    max_acceleration: float
    """Limit of acceleration, m/s²."""
    max_braking: float
    """Limit of braking, m/s²."""
    speed_gain: float
    """Steady speed over commanded speed."""
    curvature_gain: float
    """Share of the geometric curvature that the car drives."""
    curvature_droop: float
    """How that share falls with the tangent of the steering angle."""
    rotation_centre: float
    """Distance of the centre of rotation behind base_link, m."""
    pull: float = 0.0
    """Curvature that the car drives on top of what it steers, 1/m, left positive."""
    curvature_fade: float = 0.0
    """How that share falls with the speed, s/m."""
    grip: float = NO_LIMIT
    """Lateral acceleration that the tyres hold, m/s²; long before it they begin to slide."""
    max_speed: float = NO_LIMIT
    """Fastest the car ever drives, whatever is commanded, m/s."""


PROFILES: dict[str, CarProfile] = {
    "v4": CarProfile(
        steering_lag=0.502, steering_delay=0.0, speed_lag=0.158, speed_delay=0.0,
        max_acceleration=3.15, max_braking=3.86, speed_gain=1.019,
        curvature_gain=1.226, curvature_droop=0.581, curvature_fade=0.360, pull=0.0427, grip=3.03,
        rotation_centre=0.0401,
    ),
    "v5-classic": CarProfile(
        steering_lag=0.142, steering_delay=0.0067, speed_lag=0.163, speed_delay=0.0,
        max_acceleration=3.14, max_braking=4.27, speed_gain=0.965,
        curvature_gain=1.15, curvature_droop=0.069, curvature_fade=1.647, pull=0.0101, grip=8.97,
        rotation_centre=0.0556,
    ),
    "v6": CarProfile(
        steering_lag=0.167, steering_delay=0.0334, speed_lag=0.03, speed_delay=0.0067,
        max_acceleration=10.0, max_braking=10.0, speed_gain=1.03,
        curvature_gain=0.67, curvature_droop=0.25, rotation_centre=0.091, grip=9.0, max_speed=3.6,
    ),
    "v6-unlimited": CarProfile(
        steering_lag=0.167, steering_delay=0.0334, speed_lag=0.05, speed_delay=0.0267,
        max_acceleration=1000.0, max_braking=1000.0, speed_gain=1.03,
        curvature_gain=0.67, curvature_droop=0.25, rotation_centre=0.091,
    ),
    "kinematic": CarProfile(
        steering_lag=0.0, steering_delay=0.0, speed_lag=0.0, speed_delay=0.0,
        max_acceleration=NO_LIMIT, max_braking=NO_LIMIT, speed_gain=1.0,
        curvature_gain=1.0, curvature_droop=0.0, rotation_centre=-REAR_WHEELS_M[0],
    ),
}  # fmt: skip
"""`v4`: the classic simulator until mid-2022, later only under metadata versions 1 to 4. `v5-classic`: the same
simulator from July 2022 to the console's end under version 5. `v6`: the ROS 2 build. `v6-unlimited`: `v6` as racecraft
drove it at first, with no limit of grip, acceleration or speed. `kinematic`: the ideal bicycle."""

MAX_LOGGED_SPEED_MPS: dict[str, float] = {"v4": 4.0, "v5-classic": 4.0, "v6": 2.5, "v6-unlimited": 2.5}
"""By car: the fastest speed commanded in any log behind its profile, m/s. Nothing was recorded of `kinematic`."""


def beyond_logs(car: str, speed_mps: float) -> str | None:
    """Return a sentence for pages that show a car at a commanded speed no log reaches; None within the logs.

    Args:
        car: A name of PROFILES.
        speed_mps: The fastest speed command shown, m/s.
    """
    logged = MAX_LOGGED_SPEED_MPS.get(car)
    if logged is None or speed_mps <= logged + 1e-9:
        return None
    return (
        f"Up to {speed_mps:g} m/s, beyond the logs: limits inferred "
        f"(no log of {car} is commanded above {logged:g} m/s)."
    )
