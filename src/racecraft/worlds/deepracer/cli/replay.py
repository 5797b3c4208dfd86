"""`racecraft replay`: show from recorded races that this is the same car."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

if TYPE_CHECKING:
    from racecraft.worlds.deepracer.evaluation.replay_report import ReplayReport

CARS = {
    "v4": "the classic simulator's car until mid-2022",
    "v5-classic": "the classic simulator's later car",
    "v6": "the ROS 2 build's car",
    "v6-unlimited": "the ROS 2 build's car without limits of grip, acceleration and speed",
    "kinematic": "the ideal bicycle",
}


def replay(
    traces: Annotated[
        list[Path],
        typer.Argument(help="Simulation traces (.csv) or logs, archives (.tar.gz) or folders of them.", metavar="LOG…"),
    ],
    track: Annotated[
        str | None, typer.Option(help="The track they were driven on, or its waypoint file; by default it is found.")
    ] = None,
    car: Annotated[
        str | None,
        typer.Option(
            help="v4, v5-classic, v6, v6-unlimited or kinematic; by default whichever of the first three was recorded."
        ),
    ] = None,
    picture: Annotated[
        Path | None, typer.Option(help="Draw the longest recorded episode and our car's attempts into this PNG.")
    ] = None,
    page: Annotated[
        Path | None, typer.Option("--report", help="Write everything on one self-contained page (.html).")
    ] = None,
    json: Annotated[bool, typer.Option("--json", help="One JSON object on one line of standard output.")] = False,
) -> None:
    """Tell and drive recorded races again: what does our track say of their poses, where does our car stray?

    Examples:

        racecraft replay my-old-logs --track reinvent_base --report same-car.html

        racecraft replay model.tar.gz

        racecraft replay my-model/training-simtrace --track reinvent_base.npy --car v4 --picture replay.png
    """
    from racecraft.cli.output import print_json, say
    from racecraft.worlds.deepracer.analysis.replay_page import answer, write_replay_page
    from racecraft.worlds.deepracer.evaluation.replay_picture import draw_replay, replay_figure
    from racecraft.worlds.deepracer.evaluation.replay_report import replay as replay_traces

    report = replay_traces(traces, track or _found_track(traces), car)
    facts = report.as_dictionary()
    for clause in facts["damaged_rows"]:
        say(clause, quiet_stdout=True)
    if picture is not None:
        draw_replay(report, picture)
        facts["picture"] = str(picture)
    if page is not None:
        write_replay_page(page, facts, replay_figure(report), report.errors_m())
        facts["report"] = str(page)
    if json:
        print_json(facts)
        return
    _print_report(report, facts)
    print(f"\n{answer(facts)}")
    for note in facts["notes"]:
        print(f"note: {note}")
    for kind in ("picture", "report"):
        if kind in facts:
            print(f"{kind}: {facts[kind]}")


def _found_track(paths: list[Path]) -> str:
    """Return the name of the track that logs were driven on."""
    from racecraft.worlds.deepracer.analysis.logs import find_track, track_or_none
    from racecraft.worlds.deepracer.logs import read

    found = read(paths)
    ticks = found.require_ticks()
    return (track_or_none(ticks, found.about.get("world")) or find_track(ticks)).name


def _print_report(report: ReplayReport, facts: dict[str, Any]) -> None:
    rows, episodes = facts["rows"], facts["episodes"]
    print(f"{rows:,} rows, {episodes:,} episodes, {len(report.files)} file(s), on {report.track.name}.")
    if facts["direction"] == "reversed":
        print("All of it was driven against the track's direction.")
    elif facts["direction"] == "both":
        print(f"{facts['reversed_episodes']:,} of the episodes were driven against the track's direction.")
    print("\nTold again from the recorded poses, rows that differ:")
    for key, what in (
        ("progress_mismatches", "progress (by more than 0.01 points)"),
        ("closest_waypoint_mismatches", "closest waypoint"),
        ("all_wheels_mismatches", "all wheels on track"),
        ("off_track_mismatches", "off track"),
    ):
        count = facts[key]
        shown = "not recorded" if count is None else f"{count:,}  ({100.0 * (1.0 - count / rows):.2f} % agree)"
        print(f"  {what:38} {shown}")
    _print_open_loop(report, facts)


def _print_open_loop(report: ReplayReport, facts: dict[str, Any]) -> None:
    from rich.table import Table

    from racecraft.cli.output import print_table

    print(f"\nDriven again by {report.car} ({CARS[report.car]}), blind, from every fifth row:")
    table = Table(box=None, pad_edge=False, header_style="bold")
    for title in ("after", "windows", "median", "9 of 10 within", "median turn", "9 of 10 within"):
        table.add_column(title, justify="right")
    for name, count in facts["windows"].items():
        position, yaw = facts["open_loop_position_m"][name], facts["open_loop_yaw_deg"][name]
        table.add_row(
            name.replace("s", " s"),
            f"{count:,}",
            *(_shown(position[key], 3, " m") for key in ("median", "p90")),
            *(_shown(yaw[key], 1, "°") for key in ("median", "p90")),
        )
    print_table(table)
    if len(report.strayed_m) > 1:
        tried = ", ".join(f"{name} {_shown(strayed, 3, ' m')}" for name, strayed in report.strayed_m.items())
        print(f"  median after a second of every car tried: {tried}")
    for file in facts["files"][:1] if len(facts["files"]) == 1 else []:
        for window in file["worst_windows"]:
            far = max((value for value in window["position_m"].values() if value is not None), default=None)
            print(f"  strayed most in episode {window['episode']} from step {window['steps']}: {_shown(far, 3, ' m')}")


def _shown(value: float | None, digits: int, unit: str) -> str:
    return "-" if value is None else f"{value:.{digits}f}{unit}"
