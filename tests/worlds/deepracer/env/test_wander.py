"""How far the original's wheels wander from what they are told, computed from real logs; it is what we emulate."""

import numpy as np
import pytest
from tests.reference import HAS_ALL, LARGE, TRACES

from racecraft.worlds.deepracer.env.fidelity import TICK_JITTER, WHEEL_KICK
from racecraft.worlds.deepracer.env.kernels.vehicle import drive
from racecraft.worlds.deepracer.env.vehicle import FRONT_POINT_M, PROFILES, TICK_SECONDS
from racecraft.worlds.deepracer.evaluation.open_loop import commands_of, drive_open_loop
from racecraft.worlds.deepracer.evaluation.recompute import places_of, recompute
from racecraft.worlds.deepracer.files.sim_trace import SimTrace
from racecraft.worlds.deepracer.logs.one_trace import read_sim_trace
from racecraft.worlds.deepracer.tracks.catalogue import load_track

FROM_ITERATION = 12
"""Before that, episodes are too short for many windows."""
CAR = PROFILES["v4"]


def strays(trace, track):
    """Return by how many degrees of heading our v4, blind, strays from a trace in a second, window by window."""
    yaw = drive_open_loop(trace, recompute(trace, track), "v4").yaw_rad["1s"]
    return np.degrees(yaw[np.isfinite(yaw)])


def driven_again(trace, track, rng, kick):
    """Return the trace as a v4 with wandering wheels would have written it: same starts, same commands."""
    told, commands = recompute(trace, track), commands_of(trace)
    places = places_of(trace)
    wheels = speed = 0.0
    old = (0.0, 0.0)
    for row in range(len(trace) - 1):
        if told.restarts[row]:
            x, y, yaw = places[row]
            speed, old = 0.0, (0.0, 0.0)
        places[row] = x, y, yaw
        to = (0.0, 0.0) if told.held[row] else tuple(commands[row])
        wheels += kick * rng.standard_normal()
        seconds = TICK_SECONDS * (1.0 + TICK_JITTER * rng.uniform(-1.0, 1.0))
        moved = drive(CAR, x, y, yaw, speed, wheels, *old, *to, seconds)
        wheels, old = moved[4], to
        if not told.held[row]:
            x, y, yaw, speed = moved[:4]
        if told.restarts[row + 1]:  # until it stands again
            wheels = drive(CAR, x, y, yaw, speed, wheels, *old, *to)[4]
    places[-1] = x, y, yaw
    x, y, yaw = places.T
    columns = dict(trace.columns, X=x + FRONT_POINT_M * np.cos(yaw), Y=y + FRONT_POINT_M * np.sin(yaw))
    return SimTrace(dict(columns, yaw=np.degrees(yaw)))


@pytest.mark.parametrize("log", ["console-2022/sim-trace/training", "drfc-1-worker"])
def test_a_car_whose_wheels_wander_so_strays_from_ours_as_the_logged_cars_do(log):
    """One push for both trainings of 2022: hardly too much for one, hardly too little for the other."""
    if log.startswith("console-2022") and not HAS_ALL:
        pytest.skip(LARGE)
    track = load_track("reinvent_base")
    paths = (TRACES / log / "training-simtrace").glob("*.csv")
    traces = [read_sim_trace(path) for path in sorted(paths) if int(path.stem.split("-")[0]) >= FROM_ITERATION]

    def median_stray(kick):
        rng = np.random.default_rng(1)
        return np.median(np.concatenate([strays(driven_again(trace, track, rng, kick), track) for trace in traces]))

    logged = np.median(np.concatenate([strays(trace, track) for trace in traces]))
    assert median_stray(WHEEL_KICK) == pytest.approx(logged, rel=0.1)
    assert median_stray(0.0) < 0.25 * logged, "the length of ticks alone does not make a car stray so"
