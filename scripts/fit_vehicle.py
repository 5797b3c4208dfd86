"""Fit the car to recorded races, and judge it on others: a builder's tool, never needed to run racecraft.

    python scripts/fit_vehicle.py ../shared/data

For each car one recording is fitted to and the others judge: another training, another track, another kind of actions.
Prints the table of docs/fidelity.md and the profiles that `envs/deepracer/vehicle.py` holds, rounded. What is made
small is the mean distance to the recorded car after 0.53 s plus half of that after 1 s, far strays cut off.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from scipy.optimize import minimize

from racecraft.envs.deepracer.vehicle import PROFILES, CarProfile
from racecraft.evaluation.deepracer.open_loop import CLOCKED_CARS, Windows, drive_open_loop
from racecraft.evaluation.deepracer.replay_report import FileReplay, replay

Recording = Sequence[FileReplay]

RECORDINGS = {
    "console-2022": ("traces/console-2022/sim-trace/training/training-simtrace", "reinvent_base"),
    "drfc-1-worker": ("traces/drfc-1-worker/training-simtrace", "reinvent_base"),
    "drfc evaluation": ("traces/drfc-1-worker/evaluation-20220709200242", "reinvent_base"),
    "droa-2026-continuous": ("traces/droa-2026-continuous", "reInvent2019_wide_cw"),
    "droa-2026-discrete": ("traces/droa-2026-discrete", "Spain_track"),
}
SPLIT = {
    "v4": ("console-2022", ("drfc-1-worker", "drfc evaluation")),
    "v6": ("droa-2026-continuous", ("droa-2026-discrete",)),
}
"""Fitted to, and judged on."""

EARLIER = {
    "v4": CarProfile(0.5, 0.0, 0.2, 0.0, 3.0, 1.035, 0.78, 0.25, 0.078),
    "v6": CarProfile(0.167, 0.04, 0.05, 0.02, 1000.0, 1.03, 0.67, 0.25, 0.091),
}
"""The six-parameter fits that all of this began from (project facts, 1.4)."""

SHAPE = ("steering_lag", "curvature_gain", "curvature_droop", "rotation_centre", "speed_lag", "speed_gain")
FREE = {"v4": (*SHAPE, "max_acceleration"), "v6": SHAPE}
FIRST_STEP = {
    "steering_lag": 0.1, "curvature_gain": 0.1, "curvature_droop": 0.2, "rotation_centre": 0.03,
    "speed_lag": 0.05, "speed_gain": 0.05, "max_acceleration": 1.0, "pull": 0.05,
}  # fmt: skip
DELAYS_IN_SUBSTEPS = {"v4": (0, 0), "v6": (5, 4)}
"""Steering and speed; a delay acts in whole substeps of 6.7 ms, these are the best ones."""
SUBSTEP = 1.0 / 150.0
FARTHEST_M = {"0.5s": 0.4, "1s": 0.8}
MAX_ROUNDS = 300


def main(data: str) -> None:
    """Fit and judge every car."""
    recordings = {
        name: replay([Path(data) / folder], Path(data) / "tracks" / f"{track}.npy", "v4").files
        for name, (folder, track) in RECORDINGS.items()
    }
    for car, (seen, unseen) in SPLIT.items():
        steering, speed = (count * SUBSTEP + 1e-4 if count else 0.0 for count in DELAYS_IN_SUBSTEPS[car])
        begin = EARLIER[car]._replace(steering_delay=steering, speed_delay=speed)
        clocked = car in CLOCKED_CARS
        anew = fitted(begin, FREE[car], recordings[seen], clocked)
        pulling = fitted(anew._replace(pull=0.02), (*FREE[car], "pull"), recordings[seen], clocked)
        candidates = {
            "textbook bicycle": PROFILES["kinematic"],
            "six-parameter fit, as it was": EARLIER[car],
            "the same form, fitted anew": anew,
            "and a pull to one side": pulling,
            f"shipped as {car}": PROFILES[car],
        }
        print(f"\n{car}: fitted to {seen}\n")
        print_table(candidates, {name: recordings[name] for name in (seen, *unseen)}, clocked)
        for name in ("the same form, fitted anew", "and a pull to one side"):
            print(f"\n{name}: {rounded(candidates[name])}")


def fitted(begin: CarProfile, free: Sequence[str], recording: Recording, clocked: bool) -> CarProfile:
    """Return the profile that strays least on a recording, with the named parameters free."""
    start = np.array([getattr(begin, name) for name in free])
    steps = np.array([FIRST_STEP[name] for name in free])

    def profile_at(point: np.ndarray) -> CarProfile:
        return begin._replace(**dict(zip(free, np.maximum(start + point * steps, 0.0).tolist(), strict=True)))

    def strays(point: np.ndarray) -> float:
        windows = driven(profile_at(point), recording, clocked)
        near, far = (np.minimum(errors(windows, name), cut).mean() for name, cut in FARTHEST_M.items())
        return float(near + 0.5 * far)

    corners = np.vstack([np.zeros(len(free)), np.eye(len(free))])
    options = {"maxiter": MAX_ROUNDS, "xatol": 5e-3, "fatol": 2e-6, "initial_simplex": corners}
    return profile_at(minimize(strays, np.zeros(len(free)), method="Nelder-Mead", options=options).x)


def driven(profile: CarProfile, recording: Recording, clocked: bool) -> list[Windows]:
    """Drive all windows of a recording."""
    return [drive_open_loop(file.trace, file.retold, profile, clocked) for file in recording]


def errors(windows: Sequence[Windows], horizon: str) -> np.ndarray:
    """Return the distances to the recorded car, m, of all windows that reach so far."""
    every = np.concatenate([part.position_m[horizon] for part in windows])
    return every[np.isfinite(every)]


def print_table(candidates: dict[str, CarProfile], recordings: dict[str, Recording], clocked: bool) -> None:
    """Print median (and nine-of-ten) distances in metres, a row for each candidate."""
    print("| car | " + " | ".join(f"{name}: 0.5 s | 1 s" for name in recordings) + " |")
    print("|---" * (1 + 2 * len(recordings)) + "|")
    for label, profile in candidates.items():
        cells = []
        for recording in recordings.values():
            windows = driven(profile, recording, clocked)
            for horizon in FARTHEST_M:
                strayed = errors(windows, horizon)
                cells.append(f"{np.median(strayed):.3f} ({np.percentile(strayed, 90):.3f})")
        print(f"| {label} | " + " | ".join(cells) + " |")


def rounded(profile: CarProfile) -> CarProfile:
    """Return a profile with three or four digits."""
    return CarProfile(*(float(f"{value:.4g}") for value in profile))


if __name__ == "__main__":
    main(*sys.argv[1:])
