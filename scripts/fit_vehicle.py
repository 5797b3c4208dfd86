"""Fit the cars to recorded races, and judge them on others: a builder's tool, never needed to run racecraft.

    python scripts/fit_vehicle.py ../shared/data [PUBLIC] [--judge]

PUBLIC holds unpacked copies of the public repositories that RECORDINGS names, each in a folder `owner+name`; without it
only the recordings of ../shared/data count; with `--judge` nothing is fitted. Each car is fitted to some recordings
and judged on others: other trainings, other tracks, other racers. Prints the tables of docs/fidelity.md and
the profiles that `worlds/deepracer/env/vehicle.py` holds. What is made small is the distance to the recorded car after
a second, measured by what is far at that speed, every recording and every band of speed counting the same.
"""

from __future__ import annotations

import re
import sys
import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np
from scipy.optimize import minimize

from racecraft.worlds.deepracer.env.vehicle import NO_LIMIT, PROFILES, CarProfile
from racecraft.worlds.deepracer.evaluation.open_loop import drive_open_loop, real_speeds
from racecraft.worlds.deepracer.evaluation.recompute import RecomputedTrace, recompute
from racecraft.worlds.deepracer.files.sim_trace import TRACE_COLUMNS, SimTrace
from racecraft.worlds.deepracer.logs.errors import LogError
from racecraft.worlds.deepracer.logs.one_trace import read_sim_trace
from racecraft.worlds.deepracer.tracks.catalogue import load_track


class Recording(NamedTuple):
    """Where a recorded race lies: a folder of *-iteration.csv, or a log with SIM_TRACE_LOG lines."""

    car: str
    is_seen: bool
    """The car is fitted to it; otherwise it judges."""
    track: str
    place: str


_GURU = "aws-deepracer-community+deepracer-log-guru/tests/system_tests/resources/file_parsing/input_log_files"
_DEMA = "DemaJunior+logsDeepracer"
_CHAMP = "2022_reinvent_champ_ccw"
RECORDINGS = {
    "console 2022": Recording("v4", True, "reinvent_base", "traces/console-2022"),
    "nnicolee 2021": Recording("v4", True, "reInvent2019_track", "nnicolee+AWSDeepRacer"),
    "aws-samples 2020": Recording(
        "v4", True, "reInvent2019_track", "aws-samples+aws-deepracer-workshops/log-analysis/intermediate_checkpoint/"
        "reInvent2019-TestModel/sim-trace/training",
    ),
    "log-guru 2021, red_star_pro": Recording("v4", True, "red_star_pro", f"{_GURU}/training-20211020114346*.log"),
    "drfc 2022": Recording("v4", False, "reinvent_base", "traces/drfc-1-worker/training-simtrace"),
    "drfc 2022, evaluation": Recording("v4", False, "reinvent_base", "traces/drfc-1-worker/evaluation-20220709200242"),
    "cfghack 2021": Recording("v4", False, "reinvent_base", "cfghack+deepracer-log-analysis/sim-trace"),
    "RafMo20D 2021": Recording("v4", False, "red_star_open", "RafMo20D+ROSHN-models2/sim-trace"),
    "log-guru drfc, red_star_pro": Recording("v4", False, "red_star_pro", f"{_GURU}/*ynytdrw16nuhl8y1pauseuelw.log"),
    "DemaJunior deepModel": Recording("v5-classic", True, "reinvent_base", f"{_DEMA}/deepModel-clone/sim-trace"),
    "DemaJunior first": Recording("v5-classic", True, "reinvent_base", f"{_DEMA}/sim-trace"),
    "DemaJunior reinvencement": Recording(
        "v5-classic", True, "reinvent_base", f"{_DEMA}/reinvencementModel-clone/sim-trace"
    ),
    "log-guru 2022": Recording("v5-classic", True, "reinvent_base", f"{_GURU}/training-20220721141556*.log"),
    "log-guru FS_June2020": Recording("v5-classic", True, "FS_June2020", f"{_GURU}/*qwctpyyzmr74z3u19kc8pskvh.log"),
    "DavidLiu0619": Recording("v5-classic", False, _CHAMP, "DavidLiu0619+DeepRacerLogVisualization/data"),
    "log-guru champ": Recording("v5-classic", False, _CHAMP, f"{_GURU}/*mh77xxe01xgkyky72m378gnwp.log"),
    "log-guru champ 2": Recording("v5-classic", False, _CHAMP, f"{_GURU}/*pleai77ybzcn6yor58nl46ic7.log"),
    "log-guru 2022_june_pro": Recording("v5-classic", False, "2022_june_pro", f"{_GURU}/*ms8k1onrrixaxt7giqyk835nv*"),
    "DemaJunior deepModel 3": Recording("v5-classic", False, "reinvent_base", f"{_DEMA}/deepModel-clone3/sim-trace"),
    "DemaJunior deepModel 3-5": Recording(
        "v5-classic", False, "reinvent_base", f"{_DEMA}/deepModel-clone3-clone5/sim-trace"
    ),
    "DemaJunior vitor": Recording("v5-classic", False, "reinvent_base", f"{_DEMA}/vitor/sim-trace"),
    "DemaJunior reinvencement 1": Recording(
        "v5-classic", False, "reinvent_base", f"{_DEMA}/reinvencementModel-clone1/training"
    ),
    "droa 2026, continuous": Recording("v6", True, "reInvent2019_wide_cw", "traces/droa-2026-continuous"),
    "droa 2026, discrete": Recording("v6", False, "Spain_track", "traces/droa-2026-discrete"),
}  # fmt: skip

EARLIER = {
    "v4": CarProfile(
        0.496, 0.0, 0.169, 0.0, 3.35, 3.35, 1.009, 0.867, curvature_droop=0.826, rotation_centre=0.05, pull=0.078
    ),
    "v5-classic": PROFILES["v6-unlimited"],
    "v6": PROFILES["v6-unlimited"],
}
"""What drove under the car's name before: v4 without grip, fitted to the console training alone; under metadata 5 the
ROS 2 car; v6 without limits."""

SHAPE = ("steering_lag", "speed_lag", "speed_gain", "curvature_gain", "curvature_droop", "rotation_centre")
CLASSIC = (*SHAPE, "max_acceleration", "max_braking", "pull", "curvature_fade", "grip")
FREE = {"v4": CLASSIC, "v5-classic": CLASSIC, "v6": SHAPE}
BEGIN = {
    "v4": EARLIER["v4"]._replace(curvature_gain=1.2, curvature_droop=0.45, curvature_fade=0.37, grip=3.0),
    "v5-classic": EARLIER["v4"]._replace(
        steering_lag=0.13, steering_delay=0.0067, speed_lag=0.2, curvature_gain=1.06, curvature_droop=0.15,
        curvature_fade=1.5, pull=0.02, grip=9.0,
    ),
    "v6": PROFILES["v6"],
}  # fmt: skip
"""Where the search begins; delays act in whole substeps of 6.7 ms and stay as they are."""
FIRST_STEP = {
    "steering_lag": 0.1, "speed_lag": 0.05, "max_acceleration": 0.7, "max_braking": 0.7, "speed_gain": 0.03,
    "curvature_gain": 0.1, "curvature_droop": 0.2, "rotation_centre": 0.02, "pull": 0.03, "curvature_fade": 0.2,
    "grip": 0.6,
}  # fmt: skip
BANDS_MPS = (0.0, 1.0, 2.0, 3.0, 4.5)
FEWEST_WINDOWS = 40
FARTHEST_M = 1.0
ROWS_EACH = 4000
"""A fit looks at about so many rows of each recording, whole files of it drawn by lot."""
MAX_ROUNDS = 420

Races = Sequence[tuple[SimTrace, RecomputedTrace]]


def main(data: str, *more: str) -> None:
    """Fit every car, unless told only to judge, and judge it by recording and by band of speed."""
    public = next((word for word in more if word != "--judge"), None)
    roots = [Path(data), *([Path(public)] if public else [])]
    races = {name: read_races(recording, roots) for name, recording in RECORDINGS.items()}
    for car in BEGIN:
        here = {name: races[name] for name, row in RECORDINGS.items() if row.car == car and races[name]}
        seen = {name: drawn(part) for name, part in here.items() if RECORDINGS[name].is_seen}
        candidates = {
            "textbook bicycle": PROFILES["kinematic"],
            "as it was": EARLIER[car],
            f"shipped as {car}": PROFILES[car],
        }
        if "--judge" not in more:
            candidates["fitted anew"] = fitted(BEGIN[car], FREE[car], seen, car == "v6")
        print(f"\n## {car}\n")
        print_table(candidates, here, car == "v6")
        print_bands(candidates, here, car == "v6")
        if "fitted anew" in candidates:
            print(f"\nfitted anew: {rounded(candidates['fitted anew'])}")


def read_races(recording: Recording, roots: Sequence[Path]) -> Races:
    """Return the traces of a recording wherever they lie under the given folders; none where it is absent."""
    track = load_track(roots[0] / "tracks" / f"{recording.track}.npy")
    races = []
    for path in (found for root in roots for found in sorted(root.glob(recording.place))):
        for trace in [trace_of_log(path)] if path.is_file() else traces_of_folder(path):
            races.append((trace, recompute(trace, track)))
    return races


def traces_of_folder(folder: Path) -> list[SimTrace]:
    """Return the sound traces of a folder."""
    traces = []
    for path in sorted(folder.rglob("*-iteration.csv")):
        try:
            traces.append(read_sim_trace(path))
        except LogError as error:
            print(f"passed over: {error}", file=sys.stderr)
    return traces


def trace_of_log(path: Path) -> SimTrace:
    """Return the trace that a simulator's log holds in its lines."""
    rows = re.findall(r"SIM_TRACE_LOG:([^\r\n]*)", path.read_text(errors="replace"))
    rows = [re.sub(r"\[\s*([-\d.e]+)[,\s]+([-\d.e]+)\s*\]", r"[\1 \2]", row) for row in rows]
    count = rows[0].count(",") + 1
    head = ",".join(column.name for column in TRACE_COLUMNS[:count])
    with tempfile.NamedTemporaryFile("w", suffix=".csv") as file:
        file.write("\n".join([head, *(row for row in rows if row.count(",") + 1 == count)]) + "\n")
        file.flush()
        return read_sim_trace(file.name)


def drawn(races: Races) -> Races:
    """Return files of a recording, drawn by lot, until they hold ROWS_EACH rows."""
    chosen, rows = [], 0
    for place in np.random.default_rng(0).permutation(len(races)):
        if rows <= ROWS_EACH:
            chosen.append(races[place])
            rows += len(races[place][0])
    return chosen


def fitted(begin: CarProfile, free: Sequence[str], seen: Mapping[str, Races], clocked: bool) -> CarProfile:
    """Return the profile that strays least on some recordings, with the named parameters free."""
    start = np.array([getattr(begin, name) for name in free])
    steps = np.array([FIRST_STEP[name] for name in free])

    def profile_at(point: np.ndarray) -> CarProfile:
        return begin._replace(**dict(zip(free, np.maximum(start + point * steps, 1e-6).tolist(), strict=True)))

    def strays(point: np.ndarray) -> float:
        profile = profile_at(point)
        return float(np.mean([strays_on(races, profile, clocked) for races in seen.values()]))

    corners = np.vstack([np.zeros(len(free)), np.eye(len(free))])
    options = {"maxiter": MAX_ROUNDS, "xatol": 5e-3, "fatol": 1e-4, "initial_simplex": corners, "adaptive": True}
    return profile_at(minimize(strays, np.zeros(len(free)), method="Nelder-Mead", options=options).x)


def strays_on(races: Races, profile: CarProfile, clocked: bool) -> float:
    """Return how far a car strays from a recording after a second, as a share of what is far at that speed."""
    _, strayed, speeds = errors(races, profile, clocked)
    shares = []
    for low, high in zip(BANDS_MPS[:-1], BANDS_MPS[1:], strict=True):
        inside = (speeds >= low) & (speeds < high)
        if inside.sum() >= FEWEST_WINDOWS:
            far = 0.06 + 0.08 * speeds[inside].mean()
            shares.append((np.minimum(strayed[inside], FARTHEST_M).mean() + 0.3 * np.median(strayed[inside])) / far)
    return float(np.mean(shares)) if shares else 0.0


def errors(races: Races, profile: CarProfile, clocked: bool) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the distances after half a second and a second, m, and the real speed, of windows that reach so far."""
    near, far, speeds = [], [], []
    for trace, retold in races:
        windows = drive_open_loop(trace, retold, profile, clocked)
        reach = np.isfinite(windows.position_m["1s"])
        near.append(windows.position_m["0.5s"][reach])
        far.append(windows.position_m["1s"][reach])
        speeds.append(real_speeds(trace, windows)[reach])
    return np.concatenate(near), np.concatenate(far), np.concatenate(speeds)


def print_table(candidates: Mapping[str, CarProfile], here: Mapping[str, Races], clocked: bool) -> None:
    """Print the median distance in metres after a second, below and above 2 m/s, a row for each recording."""
    print("| recording | windows | " + " | ".join(candidates) + " |")
    print("|---" * (2 + len(candidates)) + "|")
    groups = {name: [name] for name in here}
    groups["all unseen"] = [name for name in here if not RECORDINGS[name].is_seen]
    for label, names in groups.items():
        cells = []
        for profile in candidates.values():
            parts = [errors(here[name], profile, clocked) for name in names]
            strayed, speeds = (np.concatenate([part[k] for part in parts]) for k in (1, 2))
            slow, fast = (strayed[speeds < 2.0], strayed[speeds >= 2.0])
            cells.append(" / ".join(f"{np.median(part):.3f}" if len(part) >= 20 else "-" for part in (slow, fast)))
        mark = " (seen)" if label in RECORDINGS and RECORDINGS[label].is_seen else ""
        print(f"| {label}{mark} | {len(slow)} / {len(fast)} | " + " | ".join(cells) + " |")


def print_bands(candidates: Mapping[str, CarProfile], here: Mapping[str, Races], clocked: bool) -> None:
    """Print the median distance in metres after half a second and a second by real speed, unseen and seen apart."""
    print("\n| real speed, m/s | windows | " + " | ".join(candidates) + " |")
    print("|---" * (2 + len(candidates)) + "|")
    for seen in (False, True):
        names = [name for name in here if RECORDINGS[name].is_seen == seen]
        judged = [[errors(here[name], profile, clocked) for name in names] for profile in candidates.values()]
        for low, high in zip(BANDS_MPS[:-1], BANDS_MPS[1:], strict=True):
            cells = []
            for parts in judged:
                near, far, speeds = (np.concatenate([part[k] for part in parts]) for k in range(3))
                inside = (speeds >= low) & (speeds < high)
                enough = inside.sum() >= FEWEST_WINDOWS
                cells.append(f"{np.median(near[inside]):.3f} / {np.median(far[inside]):.3f}" if enough else "-")
            mark = " (seen)" if seen else ""
            print(f"| {low:g} to {high:g}{mark} | {inside.sum()} | " + " | ".join(cells) + " |")


def rounded(profile: CarProfile) -> CarProfile:
    """Return a profile with three or four digits."""
    return CarProfile(*(value if value >= NO_LIMIT else float(f"{value:.4g}") for value in profile))


if __name__ == "__main__":
    main(*sys.argv[1:])
