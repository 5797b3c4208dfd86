"""Find the racing line of a track, and the lap that is certainly possible."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from racecraft.actions.action import action
from racecraft.contract.errors import SettingError, nearest
from racecraft.contract.progress import Progress, quiet
from racecraft.settings.request import Request, argument, option

if TYPE_CHECKING:
    from racecraft.worlds.deepracer.driving.lap_times import LapTimes

LEAST_SPEEDS_MPS = 0.5
"""The colours of a line span at least so much, so that a steady one is drawn in one colour."""


@dataclass(frozen=True, kw_only=True)
class LineRequest(Request):
    """Which track, what drives there, and which files are written."""

    track: str = argument("A name from `racecraft tracks list`, or a waypoint file (.npy).")
    direction: str = option("forward", "forward or reverse; of a loop also cw or ccw.")
    car: str = option("v6", "v4, v5-classic, v6, v6-unlimited or kinematic.")
    top_speed: float | None = option(
        None, "Fastest command, m/s. [default: 2.5 for v6, 4 for other cars]", unit="m/s", low=0.5, high=4.0
    )
    table: str | None = option(
        None,
        "Action table: a model_metadata.json, 'default' (the console's ten), or angles x speeds such as 7x1.5,2.5. "
        "[default: seven angles and the car's usual speeds up to --top-speed]",
    )
    line: str = option("planned", "Which line --out and --picture take: planned, solver or a classical one.")
    out: Path | None = option(None, "Write the line: .csv, .npy, or .py, a list to paste into a reward.")
    picture: Path | None = option(None, "Draw the line, coloured by speed, into this PNG file.")

    def check(self) -> None:
        """Refuse, before a line is sought, what cannot be found or written.

        Raises:
            SettingError: An unknown car or line, a table with a top speed, or a file of another kind.
        """
        from racecraft.worlds.deepracer.driving.lap_times import LINE_NAMES
        from racecraft.worlds.deepracer.driving.line_file import ENDINGS
        from racecraft.worlds.deepracer.env.vehicle import PROFILES

        if self.car not in PROFILES:
            raise SettingError(
                "--car is {car!r}; expected one of {profiles}. {hint}",
                car=self.car,
                profiles=", ".join(PROFILES),
                hint=nearest(self.car, PROFILES),
            )
        if self.line not in LINE_NAMES:
            raise SettingError(
                "--line is {line!r}; expected one of {line_names}.", line=self.line, line_names=", ".join(LINE_NAMES)
            )
        if self.table is not None and self.top_speed is not None:
            raise SettingError("--table and --top-speed exclude each other: a table has its own speeds. Remove one.")
        if self.out is not None and self.out.suffix not in ENDINGS:
            raise SettingError(
                "--out is {out!r}; expected a name that ends in {endings}.",
                out=str(self.out),
                endings=", ".join(ENDINGS),
            )


@dataclass(frozen=True)
class FoundLines:
    """The lines of a track, and the files that were written."""

    track: str
    direction: str
    car: str
    table: str
    times: LapTimes
    files: dict[str, Path]

    @property
    def title(self) -> str:
        """What was driven, in words."""
        return f"{self.track} {self.direction}, car {self.car}, actions {self.table}"

    def as_dictionary(self) -> dict[str, Any]:
        """Return the figures by name: lengths in metres, times in seconds."""
        about = {"track": self.track, "direction": self.direction, "car": self.car, "table": self.table}
        return about | {"top_speed_mps": self.times.top_speed} | self.times.as_dictionary() | self.files


@action
def line(request: LineRequest, progress: Progress = quiet) -> FoundLines:
    """Find the fastest lap of a track: planned and driven in the world, so it is certainly possible.

    Beside it stand estimates: the minimum-time solver (with CasADi: pip install 'racecraft[line]') and classical lines.

    Examples:
        racecraft line reinvent_base --picture line.png

        racecraft line reinvent_base --car v5-classic --table my-car/model_metadata.json --out line.py

        racecraft line 2022_reinvent_champ --direction cw --top-speed 4 --json

    Raises:
        UserInputError: Something given cannot be used, or there is no such line on this track.
    """
    from racecraft.worlds.deepracer.driving.action_tables import default_table, default_top_speed, read_table
    from racecraft.worlds.deepracer.driving.lap_times import direction_named, lap_times
    from racecraft.worlds.deepracer.tracks.catalogue import load_track

    circuit = load_track(request.track)
    way = direction_named(circuit, request.direction)
    request.check()
    fastest = default_top_speed(request.car) if request.top_speed is None else request.top_speed
    table = request.table or default_table(request.car, fastest)
    times = lap_times(circuit, request.car, read_table(table), way)
    found = FoundLines(circuit.name, way, request.car, table, times, {})
    return replace(found, files=_written(request, found))


def _written(request: LineRequest, found: FoundLines) -> dict[str, Path]:
    """Write the files that were asked for; return them by kind.

    Raises:
        SettingError: The line that they are to show was not found.
    """
    from racecraft.worlds.deepracer.driving.line_file import write_line

    lines, files = found.times.lines, dict[str, Path]()
    if (request.out or request.picture) and request.line not in lines:
        raise SettingError(
            "--line is {line!r}, and there is none here; expected one of {lines}.",
            line=request.line,
            lines=", ".join(lines),
        )
    title = f"{found.title}: {request.line} line"
    if request.out is not None:
        write_line(lines[request.line], request.out, f"{title}, {found.times.seconds(request.line):.2f} s a lap")
        files["out"] = request.out
    if request.picture is not None:
        _draw(request, found, f"{title}, {found.times.seconds(request.line):.2f} s", request.picture)
        files["picture"] = request.picture
    return files


def _draw(request: LineRequest, found: FoundLines, title: str, picture: Path) -> None:
    import numpy as np

    from racecraft.worlds.deepracer.driving.known_laps import REVERSE
    from racecraft.worlds.deepracer.tracks.catalogue import load_track
    from racecraft.worlds.deepracer.tracks.picture import PaintedPath, draw_track

    circuit, line = load_track(request.track), found.times.lines[request.line]
    again = slice(0, len(line.xy) + line.closed)
    rows = np.arange(len(line.xy) + 1)[again] % len(line.xy)
    slowest, fastest = float(line.speed.min()), float(line.speed.max())  # seen, though a lap slows in few of its ticks
    limits = (min(slowest, fastest - LEAST_SPEEDS_MPS), fastest)
    path = PaintedPath(line.xy[rows], line.speed[rows], "speed (m/s)", limits)
    road = circuit.reversed() if found.direction == REVERSE else circuit
    draw_track(road, picture, paths=[path], title=title)
