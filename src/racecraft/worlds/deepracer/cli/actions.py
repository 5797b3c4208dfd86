"""`racecraft actions`: design an action table for tracks, or look at one."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

if TYPE_CHECKING:
    from racecraft.worlds.deepracer.driving.action_design import Design
    from racecraft.worlds.deepracer.env.actions import ActionSpace
    from racecraft.worlds.deepracer.tracks.track import Track


def actions(
    tracks: Annotated[list[str], typer.Argument(help="Names from `racecraft tracks list`, or waypoint files.")],
    *,
    count: Annotated[int, typer.Option(min=4, max=30, help="Largest number of actions.")] = 10,
    continuous: Annotated[bool, typer.Option("--continuous", help="Two ranges instead of a table.")] = False,
    table: Annotated[
        str | None, typer.Option(help="Judge this table instead: a model_metadata.json, or such as 7x1.5,2.5.")
    ] = None,
    log: Annotated[
        Path | None, typer.Option(help="A run folder or log: which of its actions were never chosen.")
    ] = None,
    car: Annotated[str, typer.Option(help="v4, v5-classic, v6, v6-unlimited or kinematic.")] = "v6",
    top_speed: Annotated[
        float | None, typer.Option(min=0.5, max=4.0, help="Fastest command, m/s. [default: 2.5 for v6, else 4]")
    ] = None,
    out: Annotated[Path | None, typer.Option(help="Write this model_metadata.json.")] = None,
    picture: Annotated[
        Path | None, typer.Option(help="Draw the table over what the tracks ask for into this PNG file.")
    ] = None,
    json: Annotated[bool, typer.Option("--json", help="One JSON object on one line.")] = False,
) -> None:
    """Find the action table that loses least time on one track or several, and the lap that it allows at best.

    Every lap is planned and driven in the world. With --table or --log, the table there is judged instead.

    Examples:

        racecraft actions reinvent_base --count 10 --out my-car/model_metadata.json

        racecraft actions reinvent_base Oval_track --car v5-classic --picture table.png

        racecraft actions reinvent_base --log runs/reinvent_base-1
    """
    from racecraft.cli.output import print_json
    from racecraft.contract.errors import SettingError, nearest
    from racecraft.worlds.deepracer.driving.action_design import design_ranges, design_table, evaluate_table
    from racecraft.worlds.deepracer.driving.action_tables import default_top_speed, read_table
    from racecraft.worlds.deepracer.driving.log_actions import chosen_actions
    from racecraft.worlds.deepracer.env.vehicle import PROFILES
    from racecraft.worlds.deepracer.tracks.catalogue import load_track

    circuits = [load_track(name) for name in tracks]
    if car not in PROFILES:
        raise SettingError(
            "--car is {car!r}; expected one of {profiles}. {hint}",
            car=car,
            profiles=", ".join(PROFILES),
            hint=nearest(car, PROFILES),
        )
    fastest = default_top_speed(car) if top_speed is None else top_speed
    chosen = None if log is None else chosen_actions(log, None if table is None else read_table(table))
    given = read_table(table) if table is not None else None if chosen is None else chosen.actions
    if given is not None:
        design: Design | None = evaluate_table(circuits, PROFILES[car], given)
    else:
        design = (design_ranges if continuous else design_table)(
            circuits, PROFILES[car], fastest, *([] if continuous else [count])
        )
    if design is None:
        raise SettingError(
            "{count} actions up to {fastest:g} m/s: no table tried laps every track; expected more --count or less "
            "--top-speed.",
            count=count,
            fastest=fastest,
        )
    facts = _facts(circuits, car, design)
    if chosen is not None:
        facts["never_chosen"] = chosen.never if chosen.is_whole else None
        facts["ticks"] = chosen.ticks
    if out is not None:
        _write(design.actions, car, out)
        facts["out"] = str(out)
    if picture is not None:
        from racecraft.worlds.deepracer.analysis.action_picture import draw_actions

        draw_actions(design.actions, design.demand, picture, f"{', '.join(one.name for one in circuits)}, {car}")
        facts["picture"] = str(picture)
    print_json(facts) if json else _print(facts)


def _facts(circuits: list[Track], car: str, design: Design) -> dict[str, Any]:
    """Return everything that is printed, by name; angles in degrees."""
    from racecraft.worlds.deepracer.driving.demand import find_turns, turns_beyond
    from racecraft.worlds.deepracer.env.vehicle import PROFILES
    from racecraft.worlds.deepracer.files.model_metadata import as_aws_dict

    beyond = {
        track.name: [
            str(turn) for turn in turns_beyond(PROFILES[car], design.actions, find_turns(track, PROFILES[car]))
        ]
        for track in circuits
    }
    return {
        "car": car,
        "action_space": as_aws_dict(_metadata(design.actions, car))["action_space"],
        "laps_seconds": {track.name: lap for track, lap in zip(circuits, design.laps, strict=True)},
        "too_sharp": {name: turns for name, turns in beyond.items() if turns},
    }


def _metadata(space: ActionSpace, car: str) -> Any:
    from racecraft.worlds.deepracer.env.actions import ActionBox
    from racecraft.worlds.deepracer.files.model_metadata import ActionRanges, CarAction, ModelMetadata

    version = {"v4": "4", "v5-classic": "5"}.get(car, "6")
    if isinstance(space, ActionBox):
        return ModelMetadata(ActionRanges(*space.steering, *space.speed), version=version)
    pairs = zip(space.steering, space.speed, strict=True)
    return ModelMetadata(tuple(CarAction(*pair) for pair in pairs), version=version)


def _write(space: ActionSpace, car: str, path: Path) -> None:
    from racecraft.worlds.deepracer.files.model_metadata import write_model_metadata

    write_model_metadata(_metadata(space, car), path)


def _print(facts: dict[str, Any]) -> None:
    space = facts["action_space"]
    if isinstance(space, dict):
        angle, speed = space["steering_angle"], space["speed"]
        print(f"steering {angle['low']:g} to {angle['high']:g}°, speed {speed['low']:g} to {speed['high']:g} m/s")
    else:
        print(f"{len(space)} actions (degrees, positive left; m/s):")
        by_angle: dict[float, list[str]] = {}
        for action in space:
            by_angle.setdefault(action["steering_angle"], []).append(f"{action['speed']:g}")
        for angle, speeds in by_angle.items():
            print(f"  {angle:6g}°  {', '.join(speeds)}")
    for name, lap in facts["laps_seconds"].items():
        print(f"{name}: best lap {lap:.2f} s" if lap is not None else f"{name}: no lap was found with these actions")
    for name, turns in facts["too_sharp"].items():
        for turn in turns:
            print(f"{name}: no action turns sharply enough, none at full lock is slow enough, for {turn}")
    if "never_chosen" in facts:
        never = facts["never_chosen"]
        if never is None:
            print("no model_metadata.json beside the log: name its table with --table to see which actions are unused")
        else:
            print(f"never chosen in {facts['ticks']} ticks: {', '.join(never) or 'none, all are used'}")
    for key in ("out", "picture"):
        if key in facts:
            print(f"{key}: {facts[key]}")
