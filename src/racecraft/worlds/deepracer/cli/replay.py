"""`racecraft replay`."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from racecraft.cli.from_request import command
from racecraft.cli.output import print_files, table
from racecraft.worlds.deepracer.actions.replay import Replayed
from racecraft.worlds.deepracer.actions.replay import replay as action

if TYPE_CHECKING:
    from racecraft.worlds.deepracer.evaluation.replay_report import ReplayReport


CARS = {
    "v4": "the classic simulator's car until mid-2022",
    "v5-classic": "the classic simulator's later car",
    "v6": "the ROS 2 build's car",
    "v6-unlimited": "the ROS 2 build's car without limits of grip, acceleration and speed",
    "kinematic": "the ideal bicycle",
}


def _print_report(report: ReplayReport, facts: Mapping[str, Any]) -> None:
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
        text = "not recorded" if count is None else f"{count:,}  ({100.0 * (1.0 - count / rows):.2f} % agree)"
        print(f"  {what:38} {text}")
    _print_open_loop(report, facts)


def _print_open_loop(report: ReplayReport, facts: Mapping[str, Any]) -> None:
    print(f"\nDriven again by {report.car} ({CARS[report.car]}), blind, from every fifth row:")
    rows = []
    for name, count in facts["windows"].items():
        position, yaw = facts["open_loop_position_m"][name], facts["open_loop_yaw_deg"][name]
        metres = (_shown(position[key], 3, " m") for key in ("median", "p90"))
        degrees = (_shown(yaw[key], 1, "°") for key in ("median", "p90"))
        rows.append((name.replace("s", " s"), f"{count:,}", *metres, *degrees))
    table(("after", "windows", "median", "9 of 10 within", "median turn", "9 of 10 within"), rows)
    if len(report.strayed_m) > 1:
        tried = ", ".join(f"{name} {_shown(strayed, 3, ' m')}" for name, strayed in report.strayed_m.items())
        print(f"  median after a second of every car tried: {tried}")
    for file in facts["files"][:1] if len(facts["files"]) == 1 else []:
        for window in file["worst_windows"]:
            far = max((value for value in window["position_m"].values() if value is not None), default=None)
            print(f"  strayed most in episode {window['episode']} from step {window['steps']}: {_shown(far, 3, ' m')}")


def _shown(value: float | None, digits: int, unit: str) -> str:
    return "-" if value is None else f"{value:.{digits}f}{unit}"


def _show(done: Replayed) -> None:
    _print_report(done.report, done.figures)
    print(f"\n{done.answer}")
    for note in done.figures["notes"]:
        print(f"note: {note}")
    print_files(done.figures.files)


replay = command(action, _show, messages_aside=True)
