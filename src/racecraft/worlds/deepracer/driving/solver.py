"""The minimum-time line of a car: direct collocation in arc length, solved by CasADi and IPOPT (extra `line`).

The result is an estimate. Delays and the 15 Hz hold of commands are left out, which costs the planner up to 1 %. Arc
length folds at the middle of a bend, so offsets stop short of it (FARTHEST_INSIDE): a car may cut a hairpin deeper. On
2022_reinvent_champ a planned lap is 1.2 % shorter than the solved line, and 2 % faster. Begin with `solve_line`.

Per station: offset n from the centre line (m), heading error α (rad), speed v (m/s) and wheel angle δ (rad). Per step:
commanded angle and acceleration. The equations of motion are those of `env/vehicle.py`.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from racecraft.contract.errors import MissingExtraError
from racecraft.worlds.deepracer.driving.racing_line import RacingLine
from racecraft.worlds.deepracer.driving.road_frame import RoadFrame, road_frame
from racecraft.worlds.deepracer.env.vehicle import (
    MAX_STEERING_RAD,
    MIN_SPEED_MPS,
    NO_LIMIT,
    REAR_WHEELS_M,
    WHEELBASE_M,
    CarProfile,
)
from racecraft.worlds.deepracer.tracks.track import Track

SPACING_M = 0.15
MAX_ACCELERATION = 80.0
"""Bound for cars without a limit of acceleration, m/s²."""
MAX_OFFSET_M = 3.0
FARTHEST_INSIDE = 0.9
"""Largest offset towards the inside of a bend, as a share of its radius: beyond 1 the coordinates fold."""
START_SPEED = 1.5
"""Speed of the first guess, m/s."""
STEERING_COST, ACCELERATION_COST = 1e-4, 1e-7
"""Seconds a squared change between two steps costs: they keep commands from ringing."""
HALF_TRACK_M, HALF_BASE_M = 0.0800, -REAR_WHEELS_M[0]


def solve_line(
    track: Track, car: CarProfile, top_speed: float, slowest: float = MIN_SPEED_MPS, margin: float = 0.0
) -> RacingLine:
    """Return the line of least time and the speed along it.

    Args:
        track: The track, in driving direction; a loop is solved periodically, an open track from rest.
        car: How the car answers steering and throttle.
        top_speed: Largest speed command, m/s.
        slowest: Smallest speed command, m/s.
        margin: m that the innermost wheel stays inside the border.

    Raises:
        MissingExtraError: CasADi is not installed.
        ArithmeticError: IPOPT found no solution.
    """
    frame = road_frame(track, SPACING_M)
    return RacingLine.on_road(frame, *_solve(_import_casadi(), frame, car, (slowest, top_speed), margin))


def _solve(
    ca: Any, frame: RoadFrame, car: CarProfile, commands: tuple[float, float], margin: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return offsets (N,), speeds (N,) and the seconds of each step."""
    count = len(frame.xy)
    steps = count if frame.closed else count - 1
    n, alpha, v, delta = states = [ca.SX.sym(name, count) for name in ("n", "alpha", "v", "delta")]
    command, acceleration = ca.SX.sym("command", steps), ca.SX.sym("acceleration", steps)
    after = [*range(1, count), 0][:steps]
    middle = [0.5 * (state[:steps] + state[after]) for state in states]
    curvature = 0.5 * (frame.curvature[:steps] + frame.curvature[after])

    slowest, quickest = (min(command * car.speed_gain, car.max_speed) for command in commands)

    n_mid, alpha_mid, v_mid, delta_mid = middle
    yaw_rate = v_mid * _driven_curvature(ca, car, v_mid, delta_mid)
    aside = car.rotation_centre * yaw_rate
    pace = (v_mid * ca.cos(alpha_mid) - aside * ca.sin(alpha_mid)) / (1.0 - n_mid * curvature)
    rates = (
        v_mid * ca.sin(alpha_mid) + aside * ca.cos(alpha_mid),
        yaw_rate - curvature * pace,
        acceleration,
        (command - delta_mid) / max(car.steering_lag, 1e-3),
    )
    seconds = frame.spacing / pace
    motion = [state[after] - state[:steps] - seconds * rate for state, rate in zip(states, rates, strict=True)]

    target = v_mid + max(car.speed_lag, 1e-3) * acceleration
    reach = HALF_TRACK_M * ca.cos(alpha) + HALF_BASE_M * ca.sqrt(ca.sin(alpha) ** 2 + 1e-4)
    constraints = [
        *((one, 0.0, 0.0) for one in motion),
        (target, slowest, quickest),
        (n - reach - frame.left, -ca.inf, -margin),
        (-n - reach - frame.right, -ca.inf, -margin),
    ]

    change = command[[*range(1, steps), 0]] - command if frame.closed else command[1:] - command[:-1]
    surge = acceleration[1:] - acceleration[:-1]
    cost = ca.sum1(seconds) + STEERING_COST * ca.sumsqr(change) + ACCELERATION_COST * ca.sumsqr(surge)

    bound = np.full(count, MAX_STEERING_RAD)
    inside = FARTHEST_INSIDE / np.maximum(np.abs(frame.curvature), 1e-6)
    lower = [
        np.where(frame.curvature < 0.0, -inside, -MAX_OFFSET_M),
        np.full(count, -1.2),
        np.full(count, 0.05),
        -bound,
    ]
    upper = [
        np.where(frame.curvature > 0.0, inside, MAX_OFFSET_M),
        np.full(count, 1.2),
        np.full(count, quickest),
        bound,
    ]
    if not frame.closed:
        for low, high in zip(lower, upper, strict=True):
            low[0] = high[0] = 0.0
    lower += [-bound[:steps], np.full(steps, -min(car.max_braking, MAX_ACCELERATION))]
    upper += [bound[:steps], np.full(steps, min(car.max_acceleration, MAX_ACCELERATION))]
    guess = np.concatenate(
        [np.zeros(2 * count), np.full(count, min(START_SPEED, quickest)), np.zeros(count + 2 * steps)]
    )

    unknowns = ca.vertcat(*states, command, acceleration)
    problem = {"x": unknowns, "f": cost, "g": ca.vertcat(*(one for one, _, _ in constraints))}
    options = {"ipopt.print_level": 0, "ipopt.sb": "yes", "print_time": False, "ipopt.tol": 1e-5,
               "ipopt.mu_strategy": "adaptive", "ipopt.max_iter": 500}  # fmt: skip
    solver = ca.nlpsol("line", "ipopt", problem, options)
    bounds = [np.concatenate([np.full(one.numel(), limits[k]) for one, *limits in constraints]) for k in (0, 1)]
    result = solver(x0=guess, lbx=np.concatenate(lower), ubx=np.concatenate(upper), lbg=bounds[0], ubg=bounds[1])
    if not solver.stats()["success"]:
        raise ArithmeticError(f"IPOPT: {solver.stats()['return_status']}")
    found = np.asarray(result["x"]).ravel()
    times = np.asarray(ca.Function("steps", [unknowns], [seconds])(result["x"])).ravel()
    return found[:count], found[2 * count : 3 * count], times


def _driven_curvature(ca: Any, car: CarProfile, speed: Any, steering: Any) -> Any:
    """Return `kernels/vehicle.py`'s driven curvature as an expression, smooth where steering changes its sign."""
    tangent = ca.tan(steering)
    curvature = car.curvature_gain * tangent * (1.0 - car.curvature_droop * _smooth_abs(ca, tangent)) / WHEELBASE_M
    curvature = curvature / (1.0 + car.curvature_fade * speed) + car.pull
    if car.grip >= NO_LIMIT:
        return curvature
    return curvature / (1.0 + (curvature * speed**2 / car.grip) ** 4) ** 0.25


def _smooth_abs(ca: Any, value: Any) -> Any:
    return ca.sqrt(value**2 + 1e-5)


def _import_casadi() -> Any:
    try:
        import casadi
    except ImportError as error:
        raise MissingExtraError("The minimum-time solver needs CasADi: pip install 'racecraft[line]'.") from error
    return casadi
