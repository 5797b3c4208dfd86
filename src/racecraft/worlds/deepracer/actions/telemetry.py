"""Where laps lose time, and which corner to work on."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from racecraft.actions.action import action
from racecraft.actions.figures import Figures
from racecraft.contract.progress import Progress, quiet
from racecraft.settings.request import Request, argument, group, option
from racecraft.worlds.deepracer.driving.telemetry.filters import LapOptions

if TYPE_CHECKING:
    import polars as pl

    from racecraft.worlds.deepracer.driving.telemetry.laps import Laps
    from racecraft.worlds.deepracer.driving.telemetry.losses import LapComparison
    from racecraft.worlds.deepracer.driving.telemetry.reference import Reference
    from racecraft.worlds.deepracer.driving.telemetry.timing import LapTiming
    from racecraft.worlds.deepracer.logs import Logs
    from racecraft.worlds.deepracer.tracks.track import Track

BEST = "best"


@dataclass(frozen=True, kw_only=True)
class TelemetryRequest(Request):
    """Which laps are looked at, what they are compared with, and what is written."""

    runs: tuple[Path, ...] = argument(
        "Run folder, DeepRacer model or log folder, .tar.gz, log or trace; several: rounds of one training."
    )
    against: str | None = option(
        None,
        "What the lap is compared with: another run or log (its fastest lap), best (the best known lap, "
        "planned again in some seconds), or a line from `racecraft line --out LINE.csv`. By default the best "
        "corners of all laps together.",
    )
    lap: int = option(1, "Which lap: 1 is the fastest of those that count.", low=1)
    sectors: int = option(3, "Sectors of equal length.", low=1, high=20)
    which: LapOptions = group(LapOptions)
    track: str | None = option(None, "The track it was driven on, or its waypoint file; by default it is found.")
    car: str | None = option(
        None, "For --against best: v4, v5-classic or v6; by default the run's, or the metadata's version."
    )
    page: Path | None = option(None, "Write one page (.html) that works offline.")
    csv: Path | None = option(None, "Write a row a lap, with sector and corner times.")
    line: Path | None = option(None, "Write the lap as a line (.csv, .npy or .py), which --against takes.")
    film: Path | None = option(None, "Film the lap and its ghosts from above into this MP4 file.")


@dataclass(frozen=True)
class TimedLaps:
    """A lap beside its reference, and the files that were written."""

    compared: LapComparison
    figures: Figures

    def as_dictionary(self) -> dict[str, Any]:
        """Return the figures by name."""
        return self.figures.as_dictionary()


@action
def telemetry(request: TelemetryRequest, progress: Progress = quiet) -> TimedLaps:
    """Tell where laps lose time, and which corner to work on.

    Corners are found by curvature and numbered from the start line. Logs of AWS and runs of ours go in alike.

    Examples:

        racecraft telemetry runs/reinvent_base-1

        racecraft telemetry runs/reinvent_base-1 --against best --page laps.html

        racecraft telemetry my-aws-model --against runs/reinvent_base-1 --phase evaluation

        racecraft telemetry round-1 round-2 --begins line --fastest 20 --csv laps.csv
    """
    from racecraft.worlds.deepracer.analysis.logs import circuit_of
    from racecraft.worlds.deepracer.analysis.telemetry_page import frequent_sequences, write_telemetry_page
    from racecraft.worlds.deepracer.driving.telemetry.export import facts_of
    from racecraft.worlds.deepracer.driving.telemetry.losses import compare_lap
    from racecraft.worlds.deepracer.driving.telemetry.timing import time_laps
    from racecraft.worlds.deepracer.logs import read

    found = read(request.runs)
    for damage in found.damaged[:10]:
        progress(str(damage))
    _require_one_track(found.require_ticks())
    laps = _laps_that_count(found, circuit_of(found, request.track), request.which)
    timing = time_laps(laps, request.sectors)
    row = _row_of(timing, request.lap)
    reference = _reference(request.against, timing, found, request.car)
    compared = compare_lap(timing, row, reference)
    files = _written(compared, request, progress)
    if request.page is not None:
        title = ", ".join(path.resolve().name for path in request.runs)
        write_telemetry_page(request.page, compared, title)
        files["page"] = request.page
    figures = facts_of(compared) | {"sequences": frequent_sequences(laps)}
    return TimedLaps(compared, Figures(figures, files))


def _require_one_track(ticks: pl.DataFrame) -> None:
    """Refuse a log whose rounds were driven on several tracks."""
    import polars as pl

    from racecraft.contract.errors import SettingError
    from racecraft.worlds.deepracer.analysis.logs.circuit import SAME_LENGTH_M

    lengths = ticks.group_by("round").agg(length=pl.col("track_length_m").median())
    if lengths.height > 1 and lengths["length"].max() - lengths["length"].min() > SAME_LENGTH_M:  # type: ignore[operator]
        text = ", ".join(f"{length:.2f} m" for length in lengths.sort("round")["length"])
        raise SettingError(
            "the runs were driven on several tracks ({told}); expected one. Name runs of one track.", told=text
        )


def _laps_that_count(found: Logs, circuit: Track, which: LapOptions) -> Laps:
    from racecraft.contract.errors import SettingError
    from racecraft.worlds.deepracer.driving.telemetry.laps import find_laps

    laps = find_laps(found.require_ticks(), circuit)
    rows = which.rows(laps, found)
    if not len(laps):
        raise SettingError(
            "none of the {episodes} episodes is a full lap of {name}; expected one at least. "
            "Let the training go on; `racecraft logs` shows where its laps end.",
            episodes=laps.episodes,
            name=circuit.name,
        )
    if not len(rows):
        raise SettingError(
            "none of the {count} full laps is left by the options; expected one at least.", count=len(laps)
        )
    return laps.take(rows)


def _row_of(timing: LapTiming, lap: int) -> int:
    import numpy as np

    from racecraft.contract.errors import SettingError

    if lap > len(timing.laps):
        raise SettingError(
            "--lap is {lap}; expected 1 to {count}, the laps that count.", lap=lap, count=len(timing.laps)
        )
    return int(np.argsort(timing.laps.lap_seconds, kind="stable")[lap - 1])


def _reference(against: str | None, timing: LapTiming, found: Logs, car: str | None) -> Reference:
    """Return the lap that is compared with."""
    import numpy as np

    from racecraft.contract.errors import SettingError
    from racecraft.worlds.deepracer.driving.telemetry import reference as references
    from racecraft.worlds.deepracer.driving.telemetry.laps import find_laps
    from racecraft.worlds.deepracer.logs import read

    track = timing.laps.track
    if against is None:
        return references.of_best_zones(timing)
    if against == BEST:
        return _best_known(timing, found, car)
    if references.is_line_file(Path(against)):
        return references.of_line_file(Path(against), track)
    others = find_laps(_on(read(against).require_ticks(), track, against), track)
    if not len(others):
        raise SettingError("--against {against}: holds no full lap; expected one to compare with.", against=against)
    fastest = int(np.argmin(others.lap_seconds))
    name = f"the fastest lap of {Path(against).resolve().name}"
    return references.of_lap(others, fastest, name)


def _on(ticks: pl.DataFrame, track: Track, against: str) -> pl.DataFrame:
    """Return ticks that were driven on a track, the same way round."""
    from racecraft.contract.errors import SettingError
    from racecraft.worlds.deepracer.analysis.logs import find_track

    other = find_track(ticks)
    if abs(other.length - track.length) > 0.1 or other.is_ccw != track.is_ccw:
        raise SettingError(
            "--against {against}: was driven on {name} ({direction}); expected {name_2} ({direction_2}).",
            against=against,
            name=other.name,
            direction=other.direction,
            name_2=track.name,
            direction_2=track.direction,
        )
    return ticks


def _best_known(timing: LapTiming, found: Logs, car: str | None) -> Reference:
    """Return the best known lap of the car and its top speed, planned again."""
    from racecraft.contract.errors import SettingError, nearest
    from racecraft.worlds.deepracer.driving.telemetry.reference import of_known_lap
    from racecraft.worlds.deepracer.env.actions import action_space
    from racecraft.worlds.deepracer.env.vehicle import PROFILES
    from racecraft.worlds.deepracer.files.model_metadata import action_space_from_aws, car_for_version

    if car is not None and car not in PROFILES:
        raise SettingError(
            "--car is {car!r}; expected one of {profiles}. {hint}",
            car=car,
            profiles=", ".join(PROFILES),
            hint=nearest(car, PROFILES),
        )
    profile = car or found.about.get("car") or car_for_version(found.about.get("version"))
    told = found.about.get("action_space")
    actions = None if told is None else action_space(action_space_from_aws(told))
    fastest = float(timing.laps.throttle_mps.max()) if actions is None else actions.fastest
    reference = of_known_lap(timing.laps.track, profile, fastest, actions)
    if reference is None:
        raise SettingError(
            "--against best: no lap of {name} is known for {profile} up to {fastest:g} m/s, and "
            "none could be planned; expected another --car, or a run to compare with.",
            name=timing.laps.track.name,
            profile=profile,
            fastest=fastest,
        )
    return reference


def _written(compared: LapComparison, request: TelemetryRequest, progress: Progress) -> dict[str, Path]:
    """Write what was asked for; return where it lies."""
    from racecraft.worlds.deepracer.driving.telemetry.export import write_lap_table

    written: dict[str, Path] = {}
    if request.csv is not None:
        write_lap_table(request.csv, compared.timing)
        written["csv"] = request.csv
    if request.line is not None:
        from racecraft.worlds.deepracer.analysis.ghosts import line_of
        from racecraft.worlds.deepracer.driving.line_file import write_line

        track = compared.timing.laps.track
        title = f"A lap of {compared.lap.lap_seconds:.2f} s on {track.name}"
        write_line(line_of(compared.lap, track), request.line, title)
        written["line"] = request.line
    if request.film is not None:
        from racecraft.worlds.deepracer.analysis.ghosts import film_ghosts

        with progress.counting("pictures") as count:
            written |= film_ghosts(request.film, compared, count)
    return written
