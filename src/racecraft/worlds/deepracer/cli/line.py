"""`racecraft line`: the racing line of a track, and the lap that is certainly possible."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

if TYPE_CHECKING:
    from racecraft.worlds.deepracer.driving.lap_times import LapTimes


def line(
    track: Annotated[str, typer.Argument(help="A name from `racecraft tracks list`, or a waypoint file (.npy).")],
    *,
    direction: Annotated[str, typer.Option(help="forward or reverse; of a loop also cw or ccw.")] = "forward",
    car: Annotated[str, typer.Option(help="v4, v5-classic, v6, v6-unlimited or kinematic.")] = "v6",
    top_speed: Annotated[
        float | None, typer.Option(help="Fastest command, m/s. [default: 2.5 for v6, 4 for other cars]")
    ] = None,
    table: Annotated[
        str | None,
        typer.Option(
            help="Action table: a model_metadata.json, 'default' (the console's ten), or angles x speeds such as "
            "7x1.5,2.5. [default: seven angles and the car's usual speeds up to --top-speed]"
        ),
    ] = None,
    kind: Annotated[
        str, typer.Option("--line", help="Which line --out and --picture take: planned, solver or a classical one.")
    ] = "planned",
    out: Annotated[
        Path | None, typer.Option(help="Write the line: .csv, .npy, or .py, a list to paste into a reward.")
    ] = None,
    picture: Annotated[Path | None, typer.Option(help="Draw the line, coloured by speed, into this PNG file.")] = None,
    json: Annotated[bool, typer.Option("--json", help="One JSON object on one line.")] = False,
) -> None:
    """Find the fastest lap of a track: planned and driven in the world, so it is certainly possible.

    Beside it stand estimates: the minimum-time solver (with CasADi: pip install 'racecraft[line]') and classical lines.

    Examples:

        racecraft line reinvent_base --picture line.png

        racecraft line reinvent_base --car v5-classic --table my-car/model_metadata.json --out line.py

        racecraft line 2022_reinvent_champ --direction cw --top-speed 4 --json
    """
    from racecraft.cli.output import print_json
    from racecraft.contract.errors import SettingError, nearest
    from racecraft.worlds.deepracer.driving.action_tables import default_top_speed, read_table, usual_table
    from racecraft.worlds.deepracer.driving.lap_times import LINE_NAMES, direction_named, lap_times
    from racecraft.worlds.deepracer.driving.line_file import ENDINGS, write_line
    from racecraft.worlds.deepracer.env.vehicle import PROFILES
    from racecraft.worlds.deepracer.tracks.catalogue import load_track

    circuit = load_track(track)
    way = direction_named(circuit, direction)
    if car not in PROFILES:
        raise SettingError(f"--car is {car!r}; expected one of {', '.join(PROFILES)}. {nearest(car, PROFILES)}")
    if kind not in LINE_NAMES:
        raise SettingError(f"--line is {kind!r}; expected one of {', '.join(LINE_NAMES)}.")
    if table is not None and top_speed is not None:
        raise SettingError("--table and --top-speed exclude each other: a table has its own speeds. Remove one.")
    if out is not None and out.suffix not in ENDINGS:
        raise SettingError(f"--out is {str(out)!r}; expected a name that ends in {', '.join(ENDINGS)}.")
    name = table or usual_table(car, default_top_speed(car) if top_speed is None else top_speed)
    times = lap_times(circuit, car, read_table(name), way)
    if (out or picture) and kind not in times.lines:
        raise SettingError(f"--line is {kind!r}, and there is none here; expected one of {', '.join(times.lines)}.")
    title = f"{circuit.name} {way}, car {car}, actions {name}"
    files = {}
    if out is not None:
        write_line(times.lines[kind], out, f"{title}: {kind} line, {times.lines[kind].lap_seconds:.2f} s a lap")
        files["out"] = str(out)
    if picture is not None:
        _draw(circuit, way, times, kind, title, picture)
        files["picture"] = str(picture)
    if json:
        facts = {"track": circuit.name, "direction": way, "car": car, "table": name, "top_speed_mps": times.top_speed}
        print_json(facts | times.as_dictionary() | files)
        return
    _print(title, car, times)
    for key, path in files.items():
        print(f"{key}: {path}")


def _print(title: str, car: str, times: LapTimes) -> None:
    from rich.table import Table

    from racecraft.cli.output import print_table
    from racecraft.worlds.deepracer.driving.lap_times import PLANNED, SOLVER
    from racecraft.worlds.deepracer.env.vehicle import beyond_logs

    print(title)
    rows = Table(box=None, pad_edge=False, header_style="bold")
    for heading, side in (("line", "left"), ("lap", "right"), ("length", "right"), ("slowest", "right"), ("", "left")):
        rows.add_column(heading, justify=side)  # type: ignore[arg-type]
    remarks = {PLANNED: "driven lap by lap in the world", SOLVER: "estimate, minimum time"}
    for name, found in times.lines.items():
        figures = (f"{found.lap_seconds:.2f} s", f"{found.arc[-1]:.1f} m", f"{found.speed.min():.2f} m/s")
        rows.add_row(name, *figures, remarks.get(name, "estimate, by the car's limits along the line"))
    print_table(rows)
    if times.plan is None:
        print("No lap was found with these actions: they are too fast, or steer too little, for this track.")
    if times.best_seconds is not None:
        print(f"Best known lap of {car} up to {times.top_speed:g} m/s: {times.best_seconds:.2f} s")
    if (note := beyond_logs(car, times.top_speed)) is not None:
        print(note)


def _draw(circuit: object, way: str, times: LapTimes, kind: str, title: str, picture: Path) -> None:
    import numpy as np

    from racecraft.worlds.deepracer.driving.known_laps import REVERSE
    from racecraft.worlds.deepracer.tracks.picture import PaintedPath, draw_track
    from racecraft.worlds.deepracer.tracks.track import Track

    assert isinstance(circuit, Track)
    found = times.lines[kind]
    again = slice(0, len(found.xy) + found.closed)
    rows = np.arange(len(found.xy) + 1)[again] % len(found.xy)
    path = PaintedPath(found.xy[rows], found.speed[rows], "speed (m/s)")
    road = circuit.reversed() if way == REVERSE else circuit
    draw_track(road, picture, paths=[path], title=f"{title}: {kind} line, {found.lap_seconds:.2f} s")
