"""Design an action table for tracks, or judge one."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from racecraft.actions.action import action
from racecraft.actions.figures import Figures
from racecraft.contract.errors import SettingError, nearest
from racecraft.contract.progress import Progress, quiet
from racecraft.settings.request import Request, argument, option

if TYPE_CHECKING:
    from racecraft.worlds.deepracer.driving.action_design import Design
    from racecraft.worlds.deepracer.env.actions import ActionSpace
    from racecraft.worlds.deepracer.tracks.track import Track


@dataclass(frozen=True, kw_only=True)
class ActionsRequest(Request):
    """Which tracks and car, which table is judged, and what is written."""

    tracks: tuple[str, ...] = argument("Names from `racecraft tracks list`, or waypoint files.")
    count: int = option(10, "Largest number of actions.", low=4, high=30)
    continuous: bool = option(False, "Two ranges instead of a table.")
    table: str | None = option(None, "Judge this table instead: a model_metadata.json, or such as 7x1.5,2.5.")
    log: Path | None = option(None, "A run folder or log: which of its actions were never chosen.")
    car: str = option("v6", "v4, v5-classic, v6, v6-unlimited or kinematic.")
    top_speed: float | None = option(None, "Fastest command, m/s. [default: 2.5 for v6, else 4]", low=0.5, high=4.0)
    out: Path | None = option(None, "Write this model_metadata.json.")
    picture: Path | None = option(None, "Draw the table over what the tracks ask for into this PNG file.")


@action
def action_table(request: ActionsRequest, progress: Progress = quiet) -> Figures:
    """Find the action table that loses least time on one track or several, and the lap that it allows at best.

    Every lap is planned and driven in the world. With --table or --log, the table there is judged instead.

    Examples:

        racecraft actions reinvent_base --count 10 --out my-car/model_metadata.json

        racecraft actions reinvent_base Oval_track --car v5-classic --picture table.png

        racecraft actions reinvent_base --log runs/reinvent_base-1
    """
    from racecraft.worlds.deepracer.driving.action_design import design_ranges, design_table, evaluate_table
    from racecraft.worlds.deepracer.driving.action_tables import default_top_speed, read_table
    from racecraft.worlds.deepracer.driving.log_actions import chosen_actions
    from racecraft.worlds.deepracer.env.vehicle import PROFILES
    from racecraft.worlds.deepracer.tracks.catalogue import load_track

    circuits = [load_track(name) for name in request.tracks]
    if request.car not in PROFILES:
        raise SettingError(
            "--car is {car!r}; expected one of {profiles}. {hint}",
            car=request.car,
            profiles=", ".join(PROFILES),
            hint=nearest(request.car, PROFILES),
        )
    fastest = default_top_speed(request.car) if request.top_speed is None else request.top_speed
    chosen = (
        None
        if request.log is None
        else chosen_actions(request.log, None if request.table is None else read_table(request.table))
    )
    given = read_table(request.table) if request.table is not None else None if chosen is None else chosen.actions
    profile = PROFILES[request.car]
    if given is not None:
        design: Design | None = evaluate_table(circuits, profile, given)
    elif request.continuous:
        design = design_ranges(circuits, profile, fastest)
    else:
        design = design_table(circuits, profile, fastest, request.count)
    if design is None:
        raise SettingError(
            "{count} actions up to {fastest:g} m/s: no table tried laps every track; expected more --count or less "
            "--top-speed.",
            count=request.count,
            fastest=fastest,
        )
    facts = _facts(circuits, request.car, design)
    if chosen is not None:
        facts["never_chosen"] = chosen.never if chosen.is_whole else None
        facts["ticks"] = chosen.ticks
    return Figures(facts, _written(request, circuits, design))


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


def _written(request: ActionsRequest, circuits: list[Track], design: Design) -> dict[str, Path]:
    """Write the files that were asked for; return them by kind."""
    files: dict[str, Path] = {}
    if request.out is not None:
        from racecraft.worlds.deepracer.files.model_metadata import write_model_metadata

        write_model_metadata(_metadata(design.actions, request.car), request.out)
        files["out"] = request.out
    if request.picture is not None:
        from racecraft.worlds.deepracer.analysis.action_picture import draw_actions

        title = f"{', '.join(one.name for one in circuits)}, {request.car}"
        draw_actions(design.actions, design.demand, request.picture, title)
        files["picture"] = request.picture
    return files
