"""The fidelity report: is this the same car on the same track? Begin with `replay`.

Recorded traces of the original are told again by our geometry (`recompute.py`) and driven again by our car
(`open_loop.py`); the report counts what differs. docs/fidelity.md shows it for the recordings we have.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from racecraft.contract.errors import InputFileError, UserInputError, nearest
from racecraft.contract.message import Message
from racecraft.contract.world import Array
from racecraft.worlds.deepracer.env.vehicle import PROFILES
from racecraft.worlds.deepracer.evaluation.car_verdict import CARS_OF_BUILDS, RECORDED_CARS, CarVerdict, judge_car
from racecraft.worlds.deepracer.evaluation.open_loop import HORIZONS, Windows, drive_open_loop, real_speeds
from racecraft.worlds.deepracer.evaluation.recompute import RecomputedTrace, recompute
from racecraft.worlds.deepracer.files.model_metadata import car_for_version
from racecraft.worlds.deepracer.files.sim_trace import SimTrace
from racecraft.worlds.deepracer.logs.errors import LogError
from racecraft.worlds.deepracer.logs.one_trace import Recordings, read_recordings
from racecraft.worlds.deepracer.tracks.catalogue import load_track, names, summary
from racecraft.worlds.deepracer.tracks.track import Track

WORST_WINDOWS = 5
OTHER_LENGTH = 0.005
"""Tracks whose lengths differ by more than this share are not the same."""
SAME_CAR_M = {"v4": (0.12, 0.25), "v5-classic": (0.20, 0.40)}
OTHER_SAME_CAR_M = (0.11, 0.25)
"""Our car is the recorded one when its median distance from it after a second is at most this: below FAST_MPS, and from
there on. Classic cars stray more from each other, the later one most; the rows' own jitter is 2 to 3 cm."""
FAST_MPS = 2.0
FEWEST_WINDOWS = 20
"""A band of speed with fewer windows is not asked, unless the other has fewer still."""
SAME_WHEELS = 0.998
"""Wheels on the track must agree in so many rows; the original reads pose and wheels at different instants."""


@dataclass(frozen=True)
class FileReplay:
    """One trace, told and driven again."""

    name: str
    trace: SimTrace
    retold: RecomputedTrace
    windows: Windows

    def as_dictionary(self) -> dict[str, Any]:
        """Return the figures of this file, ready for JSON."""
        return {"file": self.name, **_figures([self]), "worst_windows": self.worst_windows()}

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
    strayed_m: dict[str, float | None]
    """By car that was tried: median distance from the recorded one after a second, m; None where none was measured."""
    verdict: CarVerdict | None = None
    """Which car the recording shows; None where one was asked for."""

    def as_dictionary(self) -> dict[str, Any]:
        """Return the report as plain values, fit for JSON; what could not be measured is None."""
        return {
            "track": self.track.name,
            "direction": self.direction,
            "waypoints": self.waypoints,
            "car": self.car,
            "cars_tried_m": self.strayed_m,
            "same_track": self.is_same_track,
            "same_car": self.is_same_car,
            "recorded_car": None if self.verdict is None else self.verdict.as_dictionary(),
            "verdict": None if self.verdict is None else self.verdict.text(),
            **_figures(self.files),
            "notes": self.notes(),
            "damaged_rows": [clause for file in self.files for clause in file.trace.damaged],
            "files": [file.as_dictionary() for file in self.files],
        }

    @property
    def is_same_track(self) -> bool:
        """Our geometry tells the same: on the original's own rows exactly, on the catalogue's curve within a point."""
        replays = [file.retold for file in self.files]
        rows = sum(len(file.trace) for file in self.files)
        wheels = sum(int(part.wheels_wrong.sum()) for part in replays)
        if self.is_exact:
            differ = any(part.progress_wrong.any() or part.waypoint_wrong.any() for part in replays)
        else:
            differ = any(part.progress_far.any() for part in replays)
        return not differ and wheels <= (1.0 - SAME_WHEELS) * rows

    @property
    def is_same_car(self) -> bool | None:
        """Our car strays no further than `SAME_CAR_M`; None where no recorded stretch was long enough to tell."""
        limits = SAME_CAR_M.get(self.car, OTHER_SAME_CAR_M)
        strayed, speeds = self._by_speed("1s")
        if not len(strayed):
            strayed, speeds = self._by_speed("0.5s")
            limits = (0.55 * limits[0], 0.55 * limits[1])
        bands = [(strayed[speeds < FAST_MPS], limits[0]), (strayed[speeds >= FAST_MPS], limits[1])]
        fewest = min(FEWEST_WINDOWS, max(len(band) for band, _ in bands))
        asked = [(band, limit) for band, limit in bands if len(band) >= max(fewest, 1)]
        return all(float(np.median(band)) <= limit for band, limit in asked) if asked else None

    @property
    def direction(self) -> str:
        """Which way round the recorded car drove: "forward", "reversed" or "both"."""
        begins = np.concatenate([file.retold.begins for file in self.files])
        reverse = np.concatenate([file.retold.reversed for file in self.files])[begins]
        return "both" if reverse.any() and not reverse.all() else "reversed" if reverse.any() else "forward"

    @property
    def waypoints(self) -> str | None:
        """How rows that the route file repeats were counted: "as_filed", "distinct"; None where nothing tells."""
        waypoints = {file.retold.waypoints for file in self.files} - {None}
        return waypoints.pop() if len(waypoints) == 1 else None

    def _by_speed(self, horizon: str) -> tuple[Array, Array]:
        """Return how far our car strayed, m, and how fast the recorded one drove, m/s, in windows that reach so far."""
        strayed = np.concatenate([file.windows.position_m[horizon] for file in self.files])
        speeds = np.concatenate([real_speeds(file.trace, file.windows) for file in self.files])
        return strayed[np.isfinite(strayed)], speeds[np.isfinite(strayed)]

    def errors_m(self) -> dict[str, Array]:
        """Return how far our car strayed in every window, m, by horizon."""
        found = {name: np.concatenate([file.windows.position_m[name] for file in self.files]) for name in HORIZONS}
        return {name: errors[np.isfinite(errors)] for name, errors in found.items()}

    def notes(self) -> list[str]:
        """Return what a reader of the figures should know."""
        rows = sum(len(file.trace) for file in self.files)
        wrong = sum(int(file.retold.waypoint_wrong.sum()) for file in self.files)
        notes = []
        if self.waypoints is not None:
            counted = "counts" if self.waypoints == "as_filed" else "does not count"
            notes.append(
                f"The route file of {self.track.name} repeats a row, and this recording {counted} it as a waypoint: "
                f"race.waypoints={self.waypoints} gives its rewards the same numbers."
            )
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
        paths: Traces (`.csv`), simulation logs, archives or folders of them, as `logs.read` takes them.
        track: A catalogue name or a route file (`.npy`). The catalogue's tracks are smooth curves a few millimetres
            beside the original's; only the original's own file brings the differences down to none.
        car: A name of PROFILES; when None, the car that the recording shows, or where it cannot tell, the one that goes
            with the metadata's version, or else the one that strays least.

    Raises:
        LogError: A file is no trace, is damaged throughout, or holds no row in which a car was driven.
        InputFileError: A trace was driven on another track.
        TrackError: No such track.
        UserInputError: No such car; no file.
    """
    if car is not None and car not in PROFILES:
        raise UserInputError("There is no car {car!r}. {hint}", car=car, hint=nearest(car, PROFILES))
    if not paths:
        raise UserInputError("No recording was named; expected a trace, a log, an archive or a folder of them.")
    circuit = load_track(track)
    recordings = read_recordings(paths)
    told = []
    for name, trace in recordings.traces:
        retold = recompute(trace, circuit)
        _refuse_other_track(name, trace, retold, circuit)
        _refuse_parked(name, trace, retold)
        told.append((name, trace, retold))
    candidates = [car] if car else list(RECORDED_CARS)
    driven = {name: [drive_open_loop(trace, retold, name) for _, trace, retold in told] for name in candidates}
    if car:
        verdict, chosen = None, car
    else:
        verdict = _verdict(driven, recordings)
        chosen = verdict.car or _likely(verdict, recordings)
    files = tuple(FileReplay(*parts, windows) for parts, windows in zip(told, driven[chosen], strict=True))
    strayed = {name: _rounded(_strayed(windows)) for name, windows in driven.items()}
    return ReplayReport(circuit, _is_route_file(track), chosen, files, strayed, verdict)


def _verdict(driven: Mapping[str, Sequence[Windows]], recordings: Recordings) -> CarVerdict:
    errors = {name: np.concatenate([part.position_m["1s"] for part in windows]) for name, windows in driven.items()}
    return judge_car(errors, recordings.build)


def _likely(verdict: CarVerdict, recordings: Recordings) -> str:
    """Return the car to show where the recording cannot tell: by the metadata's version, if the build has it."""
    version = recordings.about.get("version")
    try:
        car = car_for_version(version) if version else verdict.nearest
    except ValueError:
        return verdict.nearest
    return car if car in CARS_OF_BUILDS.get(verdict.build or "", RECORDED_CARS) else verdict.nearest


def _figures(files: Sequence[FileReplay]) -> dict[str, Any]:
    """Return the counts and errors of some files together."""
    replays = [file.retold for file in files]
    judged = sum(int(part.off_track_judged.sum()) for part in replays)
    position = {name: np.concatenate([file.windows.position_m[name] for file in files]) for name in HORIZONS}
    yaw = {name: np.concatenate([file.windows.yaw_rad[name] for file in files]) for name in HORIZONS}
    return {
        "rows": sum(len(file.trace) for file in files),
        "episodes": sum(int(part.begins.sum()) for part in replays),
        "reversed_episodes": sum(int((part.begins & part.reversed).sum()) for part in replays),
        "progress_mismatches": sum(int(part.progress_wrong.sum()) for part in replays),
        "closest_waypoint_mismatches": sum(int(part.waypoint_wrong.sum()) for part in replays),
        "all_wheels_mismatches": sum(int(part.wheels_wrong.sum()) for part in replays),
        "off_track_mismatches": sum(int(part.off_track_wrong.sum()) for part in replays) if judged else None,
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


def _is_route_file(track: str | Path) -> bool:
    return Path(track).suffix.lower() == ".npy"


def _refuse_other_track(name: str, trace: SimTrace, retold: RecomputedTrace, circuit: Track) -> None:
    """Refuse a trace that was driven elsewhere: its progress is far from ours, or its length and waypoints are."""
    length = float(np.median(trace.columns["track_len"]))
    other_length = not math.isclose(length, circuit.length, rel_tol=OTHER_LENGTH)
    elsewhere = retold.progress_far if retold.progress_far.mean() > 0.5 or not other_length else retold.waypoint_wrong
    if elsewhere.mean() <= (0.5 if elsewhere is retold.progress_far else 0.9):
        return
    alike = [name for name in names() if math.isclose(summary(name).length, length, rel_tol=OTHER_LENGTH)]
    known = f"Of that length there are: {', '.join(alike)}." if alike else "The catalogue has none of that length."
    raise InputFileError(
        name,
        Message(
            "{sum} of {count} rows lie elsewhere on {name} ({length:.2f} m)",
            sum=int(elsewhere.sum()),
            count=len(trace),
            name=circuit.name,
            length=circuit.length,
        ),
        "a trace that was driven on this track",
        Message("The trace speaks of a track of {length:.2f} m. {known}", length=length, known=known),
    )


def _refuse_parked(name: str, trace: SimTrace, retold: RecomputedTrace) -> None:
    status = trace.columns.get("episode_status")
    driven = ~retold.held if status is None else status == "in_progress"
    if not driven.any():
        found = "no row in which a car was driven"
        if status is not None:
            found += f" (only {', '.join(sorted(set(map(str, status))))})"
        raise LogError(name, found, "rows whose episode_status is in_progress")
