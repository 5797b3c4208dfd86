"""How the car answers steering and throttle: three profiles of one model of few numbers.

The textbook bicycle is badly wrong for this car: its steering lags by 0.15 to 0.5 s and it turns only about two thirds
as sharply as its geometry says. `scripts/fit_vehicle.py` fits the figures to one recorded training and judges them on
others that they had not seen; docs/fidelity.md has the table. `v4` is its fit; for `v6` it found nothing better than
the six parameters that were known before (project facts, section 1.4), with delays of whole substeps::

    steering  d(delta)/dt = (delta_cmd - delta) / steering_lag
    speed     dv/dt       = clip((gain * v_cmd - v) / speed_lag, -max_acceleration, +max_acceleration)
    curvature c           = curvature_gain * tan(delta) * (1 - curvature_droop * |tan(delta)|) / wheelbase + pull
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

MAX_STEERING_RAD = 0.5235987755982988
"""30 degrees: commands are clipped to it (`rollout_agent_ctrl.py`)."""
MIN_SPEED_MPS, MAX_SPEED_MPS = 0.1, 4.0
"""Speed commands are clipped to this range; a car cannot be told to stand still."""


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
    """Limit of acceleration and braking, m/s²."""
    speed_gain: float
    """Steady speed over commanded speed."""
    curvature_gain: float
    """Share of the geometric curvature that the car drives."""
    curvature_droop: float
    """How that share falls with the tangent of the steering angle."""
    rotation_centre: float
    """Distance of the centre of rotation behind base_link, m."""
    pull: float = 0.0
    """Curvature that the car drives on top of what it steers, 1/m, left positive: the classic car pulls to the left."""


PROFILES: dict[str, CarProfile] = {
    "v4": CarProfile(0.496, 0.0, 0.169, 0.0, 3.35, 1.009, 0.867, 0.826, 0.05, 0.078),
    "v6": CarProfile(0.167, 0.0334, 0.05, 0.0267, 1000.0, 1.03, 0.67, 0.25, 0.091, 0.0),
    "kinematic": CarProfile(0.0, 0.0, 0.0, 0.0, 1e9, 1.0, 1.0, 0.0, -REAR_WHEELS_M[0], 0.0),
}
"""`v4`: the classic simulator's effort-controlled car (metadata version 1-4). `v6`: the ROS 2 build (5, 6 or none).
`kinematic`: the ideal bicycle, for teaching."""
