"""The fidelity report: is this the same car on the same track? Begin with `replay`.

Recorded traces of the original are told again by our geometry (`recompute.py`) and driven again by our car
(`open_loop.py`); the report counts what differs. docs/fidelity.md shows it for the recordings we have.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from racecraft.contract.errors import InputFileError, UserInputError, nearest
from racecraft.contract.world import Array
from racecraft.envs.deepracer.vehicle import PROFILES
from racecraft.evaluation.deepracer.open_loop import HORIZONS, Windows, drive_open_loop
from racecraft.evaluation.deepracer.recompute import Retold, recompute
from racecraft.formats.aws.sim_trace import MAX_NAMED_ROWS, SimTrace, SimTraceError, read_sim_trace
from racecraft.tracks.catalogue import load_track, names, summary
from racecraft.tracks.importer import read_rows
from racecraft.tracks.track import Track

RECORDED_CARS = ("v4", "v6")
"""Cars that races were recorded with; where none is asked for, the one of them that strays less is reported."""
WORST_WINDOWS = 5
OTHER_LENGTH = 0.005
"""Tracks whose lengths differ by more than this share are not the same."""
SAME_CAR_M = {"0.5s": 0.06, "1s": 0.11}
"""Our car is the recorded one when its median distance from it is at most this; the rows' own jitter is 2 to 3 cm."""
SAME_WHEELS = 0.998
"""Wheels on the track must agree in so many rows; the original reads pose and wheels at different instants."""
NUMBERS = ("X", "Y", "yaw", "steer", "throttle", "progress", "tstamp")
"""Columns that must be finite for a row to be told again."""


@dataclass(frozen=True)
class FileReplay:
    """One trace, told and driven again."""

    path: Path
    trace: SimTrace
    retold: Retold
    windows: Windows

    def as_dictionary(self) -> dict[str, Any]:
        """Return the figures of this file, ready for JSON."""
        return {"file": str(self.path), **_figures([self]), "worst_windows": self.worst_windows()}

    def worst_windows(self) -> list[dict[str, Any]]:
        """Return the five windows in which our car strayed furthest, the worst first."""
        columns, windows = self.trace.columns, self.windows
        position = np.column_stack([windows.position_m[name] for name in HORIZONS])
        furthest = np.nan_to_num(position, nan=-1.0).max(axis=1, initial=-1.0)
        worst = []
        for window in np.argsort(-furthest, kind="stable")[:WORST_WINDOWS]:
            row = windows.first[window]
            worst.append(
                {
                    "episode": int(columns["episode"][row]),
                    "steps": int(columns["steps"][row]),
                    "position_m": {name: _rounded(windows.position_m[name][window]) for name in HORIZONS},
                    "yaw_deg": {name: _rounded(math.degrees(windows.yaw_rad[name][window])) for name in HORIZONS},
                }
            )
        return worst


@dataclass(frozen=True)
class ReplayReport:
    """What the replay of one or more traces came to."""

    track: Track
    is_exact: bool
    """The track was read from a route file; otherwise it is the catalogue's smooth curve."""
    car: str
    files: tuple[FileReplay, ...]

    def as_dictionary(self) -> dict[str, Any]:
        """Return the report as plain values, fit for JSON; what could not be measured is None."""
        return {
            "track": self.track.name,
            "car": self.car,
            "same_track": self.is_same_track,
            "same_car": self.is_same_car,
            **_figures(self.files),
            "notes": self.notes(),
            "damaged_rows": [clause for file in self.files for clause in file.trace.damaged],
            "files": [file.as_dictionary() for file in self.files],
        }

    @property
    def is_same_track(self) -> bool:
        """Our geometry tells the same: on the original's own rows exactly, on the catalogue's curve within a point."""
        told = [file.retold for file in self.files]
        rows = sum(len(file.trace) for file in self.files)
        wheels = sum(int(part.wheels_wrong.sum()) for part in told)
        if self.is_exact:
            differ = any(part.progress_wrong.any() or part.waypoint_wrong.any() for part in told)
        else:
            differ = any(part.progress_far.any() for part in told)
        return not differ and wheels <= (1.0 - SAME_WHEELS) * rows

    @property
    def is_same_car(self) -> bool | None:
        """Our car strays no further than `SAME_CAR_M`; None where no recorded stretch was long enough to tell."""
        medians = {name: part["median"] for name, part in _figures(self.files)["open_loop_position_m"].items()}
        measured = {name: median for name, median in medians.items() if median is not None}
        return all(median <= SAME_CAR_M[name] for name, median in measured.items()) if measured else None

    def errors_m(self) -> dict[str, Array]:
        """Return how far our car strayed in every window, m, by horizon."""
        found = {name: np.concatenate([file.windows.position_m[name] for file in self.files]) for name in HORIZONS}
        return {name: errors[np.isfinite(errors)] for name, errors in found.items()}

    def notes(self) -> list[str]:
        """Return what a reader of the figures should know."""
        rows = sum(len(file.trace) for file in self.files)
        wrong = sum(int(file.retold.waypoint_wrong.sum()) for file in self.files)
        notes = []
        if wrong > 0.5 * rows:
            notes.append(
                f"{wrong} of {rows} closest waypoints differ although the progress is right: the rows of this track "
                "are numbered otherwise. Name the original's own route file (.npy)."
            )
        if not self.is_exact:
            notes.append(
                f"The catalogue's {self.track.name} is a smooth curve a few millimetres beside the original's; "
                "with the original's own route file (.npy) the figures agree exactly."
            )
        return notes


def replay(paths: Sequence[str | Path], track: str | Path, car: str | None = None) -> ReplayReport:
    """Tell and drive recorded races again.

    Args:
        paths: Traces (`.csv`), or folders: of these every `*-iteration.csv` at any depth.
        track: A catalogue name or a route file (`.npy`). The catalogue's tracks are smooth curves a few millimetres
            beside the original's; only the original's own file brings the differences down to none.
        car: "v4", "v6" or "kinematic"; when None, that one of v4 and v6 that strays less.

    Raises:
        SimTraceError: A file is no trace, is damaged throughout, or holds no row in which a car was driven.
        InputFileError: A trace was driven on another track.
        TrackError: No such track.
        UserInputError: No such car; no file.
    """
    if car is not None and car not in PROFILES:
        raise UserInputError(f"There is no car {car!r}. {nearest(car, PROFILES)}")
    circuit = load_track(track)
    as_filed = _with_every_row(circuit, track)
    told = []
    for path in _files(paths):
        trace = _read(path)
        retold = recompute(trace, circuit, as_filed)
        _refuse_other_track(path, trace, retold, circuit)
        _refuse_parked(path, trace, retold)
        told.append((path, trace, retold))
    candidates = [car] if car else list(RECORDED_CARS)
    driven = {name: [drive_open_loop(trace, retold, name) for _, trace, retold in told] for name in candidates}
    best = min(candidates, key=lambda name: _strayed(driven[name]))
    files = tuple(FileReplay(*parts, windows) for parts, windows in zip(told, driven[best], strict=True))
    return ReplayReport(circuit, _is_route_file(track), best, files)


def _figures(files: Sequence[FileReplay]) -> dict[str, Any]:
    """Return the counts and errors of some files together."""
    told = [file.retold for file in files]
    judged = sum(int(part.off_track_judged.sum()) for part in told)
    position = {name: np.concatenate([file.windows.position_m[name] for file in files]) for name in HORIZONS}
    yaw = {name: np.concatenate([file.windows.yaw_rad[name] for file in files]) for name in HORIZONS}
    return {
        "rows": sum(len(file.trace) for file in files),
        "episodes": sum(int(part.begins.sum()) for part in told),
        "reversed_episodes": sum(int((part.begins & part.reversed).sum()) for part in told),
        "progress_mismatches": sum(int(part.progress_wrong.sum()) for part in told),
        "closest_waypoint_mismatches": sum(int(part.waypoint_wrong.sum()) for part in told),
        "all_wheels_mismatches": sum(int(part.wheels_wrong.sum()) for part in told),
        "off_track_mismatches": sum(int(part.off_track_wrong.sum()) for part in told) if judged else None,
        "windows": {name: int(np.isfinite(errors).sum()) for name, errors in position.items()},
        "open_loop_position_m": {name: _spread(errors) for name, errors in position.items()},
        "open_loop_yaw_deg": {name: _spread(np.degrees(errors)) for name, errors in yaw.items()},
    }


def _spread(errors: Array) -> dict[str, float | None]:
    errors = errors[np.isfinite(errors)]
    if len(errors) == 0:
        return {"median": None, "p90": None}
    return {"median": _rounded(np.median(errors)), "p90": _rounded(np.percentile(errors, 90))}


def _rounded(value: Any) -> float | None:
    return round(float(value), 5) if math.isfinite(value) else None


def _strayed(windows: Sequence[Windows]) -> float:
    """Return the median error at the longest horizon that any window reaches, m; none at all counts as endless."""
    for name in reversed(HORIZONS):
        errors = np.concatenate([part.position_m[name] for part in windows])
        if np.isfinite(errors).any():
            return float(np.nanmedian(errors))
    return math.inf


def _files(paths: Sequence[str | Path]) -> list[Path]:
    """Return the traces that were named, folders opened, iterations in their order."""
    found: list[Path] = []
    for path in map(Path, paths):
        if not path.is_dir():
            found.append(path)
            continue
        inside = sorted(path.rglob("*-iteration.csv"), key=lambda file: (file.parent, _iteration(file), file.name))
        if not inside:
            raise SimTraceError(path, "a folder without any *-iteration.csv", "a trace, or a folder of traces")
        found += inside
    if not found:
        raise UserInputError("No trace was named; expected at least one SIM_TRACE .csv file.")
    return found


def _iteration(path: Path) -> int:
    number = path.name.split("-")[0]
    return int(number) if number.isdigit() else 0


def _read(path: Path) -> SimTrace:
    """Read a trace, and pass over rows with numbers that are none."""
    trace = read_sim_trace(path)
    sound = np.all([np.isfinite(trace.columns[name]) for name in NUMBERS], axis=0)
    if sound.all():
        return trace
    if not sound.any():
        raise SimTraceError(path, "every row holds a number that is not finite", "finite poses and commands")
    wrong = np.flatnonzero(~sound)
    clauses = [
        f"{path}: sound row {row + 1}: {_endless(trace, row)}; the row was passed over"
        for row in wrong[:MAX_NAMED_ROWS]
    ]
    return SimTrace({name: values[sound] for name, values in trace.columns.items()}, (*trace.damaged, *clauses))


def _endless(trace: SimTrace, row: int) -> str:
    return " and ".join(
        f"{name} is {trace.columns[name][row]}" for name in NUMBERS if not np.isfinite(trace.columns[name][row])
    )


def _with_every_row(circuit: Track, track: str | Path) -> Track | None:
    """Return the circuit with the repeated rows of its file, as some builds count them; None where it has none."""
    if not _is_route_file(track):
        return None
    rows = read_rows(track)
    if len(rows) == len(circuit.centre):
        return None
    centre, inner, outer = (np.ascontiguousarray(rows[:, k : k + 2]) for k in (0, 2, 4))
    return Track(circuit.name, centre, inner, outer, closed=circuit.closed)


def _is_route_file(track: str | Path) -> bool:
    return Path(track).suffix.lower() == ".npy"


def _refuse_other_track(path: Path, trace: SimTrace, retold: Retold, circuit: Track) -> None:
    """Refuse a trace that was driven elsewhere: its progress is far from ours, or its length and waypoints are."""
    length = float(np.median(trace.columns["track_len"]))
    other_length = not math.isclose(length, circuit.length, rel_tol=OTHER_LENGTH)
    elsewhere = retold.progress_far if retold.progress_far.mean() > 0.5 or not other_length else retold.waypoint_wrong
    if elsewhere.mean() <= (0.5 if elsewhere is retold.progress_far else 0.9):
        return
    alike = [name for name in names() if math.isclose(summary(name).length, length, rel_tol=OTHER_LENGTH)]
    known = f"Of that length there are: {', '.join(alike)}." if alike else "The catalogue has none of that length."
    raise InputFileError(
        path,
        f"{int(elsewhere.sum())} of {len(trace)} rows lie elsewhere on {circuit.name} ({circuit.length:.2f} m)",
        "a trace that was driven on this track",
        f"The trace speaks of a track of {length:.2f} m. {known}",
    )


def _refuse_parked(path: Path, trace: SimTrace, retold: Retold) -> None:
    status = trace.columns.get("episode_status")
    driven = ~retold.held if status is None else status == "in_progress"
    if not driven.any():
        found = "no row in which a car was driven"
        if status is not None:
            found += f" (only {', '.join(sorted(set(map(str, status))))})"
        raise SimTraceError(path, found, "rows whose episode_status is in_progress")
