"""`racecraft sensors FOLDER`: what a car's network sees at a place of the track."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

if TYPE_CHECKING:
    from racecraft.worlds.deepracer.training.plan import CarPlan


SHEET_COLUMNS = 5
"""Episodes that a sheet of disturbances shows of each."""


def sensors(
    folder: Annotated[
        Path | None, typer.Argument(help="A racer's folder, or a run folder; by default a car with a front camera.")
    ] = None,
    track: Annotated[
        str | None, typer.Option(help="A name or a waypoint file; by default what the folder says, else reinvent_base.")
    ] = None,
    at: Annotated[float, typer.Option(min=0.0, max=1.0, help="Where the car stands, share of the lap.")] = 0.0,
    preset: Annotated[str, typer.Option(help="fast or aws: decides the size of the frame.")] = "fast",
    fidelity: Annotated[
        str | None, typer.Option(help="sane, or aws with the LiDAR as the original mounts it; by default the preset's.")
    ] = None,
    set_: Annotated[list[str] | None, typer.Option("--set", help="group.name=value, as for `racecraft train`.")] = None,
    under: Annotated[
        str | None,
        typer.Option(help="Draw a sheet of frames instead: under each disturbance of a level, aws, light or strong."),
    ] = None,
    output: Annotated[Path, typer.Option("--output", "-o", help="The picture: .png, .svg or .pdf.")] = Path(
        "sensors.png"
    ),
    json: Annotated[bool, typer.Option("--json", help="One JSON object on one line of standard output.")] = False,
) -> None:
    """Draw what the network sees: every frame pixel by pixel, what the LiDAR tells, its beams on the map.

    Examples:

        racecraft sensors my-car --at 0.3

        racecraft sensors my-car --preset aws --track Oval_track -o seen.png

        racecraft sensors my-car --under strong -o sheet.png

        racecraft sensors runs/reinvent_base-1 --at 0.5 --json
    """
    from racecraft.cli.output import print_json
    from racecraft.contract.world import allocate
    from racecraft.worlds.deepracer.analysis.sight import draw_sight

    planned = _planned(folder, track, preset, fidelity, tuple(set_ or ()))
    if under is not None:
        rows = _draw_under(planned, at, under, output)
        if json:
            print_json({"picture": str(output), "track": planned.track.name, "at": at, "under": under, "rows": rows})
        else:
            print(f"Drawn into {output}: {', '.join(rows)}.")
        return
    world = _world_at(planned, at)
    buffers = allocate(world.spec)
    world.reset(buffers, planned.seed)
    title = f"{planned.track.title or planned.track.name}, {100 * at:g} % of the lap"
    draw_sight(world, buffers.observations, title, output)
    seen = {name: part for name, part in world.spec.observations.items() if not part.privileged}
    if json:
        print_json({"picture": str(output), "track": planned.track.name, "at": at, **_told(seen, buffers.observations)})
        return
    for name, part in seen.items():
        print(f"{name:26} {' x '.join(map(str, part.shape)):14} {part.doc}")
    print(f"Drawn into {output}.")


def _planned(
    folder: Path | None, track: str | None, preset: str, fidelity: str | None, overrides: tuple[str, ...]
) -> CarPlan:
    """Return the training that the folder asks for; of a run folder, the one it was."""
    from dataclasses import replace

    from racecraft.formats.run_folder import RunFolder
    from racecraft.settings.overrides import apply_overrides, with_values
    from racecraft.worlds.deepracer.tracks.catalogue import load_track
    from racecraft.worlds.deepracer.training.plan import RaceRequest, plan_car, plan_resume

    if folder is None or not RunFolder(folder).job.is_file():
        return plan_car(RaceRequest(folder, track, preset=preset, fidelity=fidelity, overrides=overrides))
    planned = plan_resume(folder)
    settings = planned.settings if fidelity is None else with_values(planned.settings, "race", {"fidelity": fidelity})
    settings = apply_overrides(settings, overrides)
    return replace(planned, settings=settings, track=load_track(track) if track else planned.track)


def _world_at(planned: CarPlan, at: float) -> Any:
    from racecraft.worlds.deepracer.training.trainer import race_world

    world = race_world(planned, 1)
    world.move_starts([at % 1.0])
    return world


def _draw_under(planned: CarPlan, at: float, level: str, output: Path) -> list[str]:
    """Draw what the first eye sees under each disturbance of a level that is seen at all; return their names."""
    from dataclasses import replace

    import numpy as np

    from racecraft.contract.world import allocate
    from racecraft.worlds.deepracer.analysis.varied_sight import draw_sheet
    from racecraft.worlds.deepracer.env.settings import TIME_TRIAL
    from racecraft.worlds.deepracer.env.variation import (
        DISTURBANCES,
        VariationConfig,
        checked_level,
        disturbances_of,
        only,
    )
    from racecraft.worlds.deepracer.training.trainer import race_world

    is_still = {"dropped-frames"}  # seen in motion only
    known = disturbances_of(level, planned.settings.race.type != TIME_TRIAL)
    names = [name for name in known if DISTURBANCES[name].is_seen and name not in is_still]
    rows = []
    for name in ("undisturbed", *names, "all together"):
        variation = (
            VariationConfig(checked_level(level)) if name == "all together" else only(level, {name} & set(names))
        )
        settings = planned.settings.with_group("variation", variation)
        world = race_world(replace(planned, settings=settings), SHEET_COLUMNS)
        world.move_starts(np.full(SHEET_COLUMNS, at % 1.0))
        buffers = allocate(world.spec)
        world.reset(buffers, planned.seed)
        frames = buffers.observations[world.sensors.camera_name][:, 0]
        rows.append((name, frames if frames.ndim == 3 else frames[..., 0]))
    place = f"{planned.track.title or planned.track.name}, {100 * at:g} % of the lap"
    note = f"{place}, {SHEET_COLUMNS} episodes a row, every pixel as the network gets it"
    draw_sheet(rows, f"Variation {level}, one disturbance at a time", note, output)
    return [name for name, _ in rows]


def _told(specs: dict[str, Any], observations: dict[str, Any]) -> dict[str, Any]:
    """Return what is seen, fit for JSON: shapes of frames, numbers of vectors."""
    return {
        "observations": {
            name: {"shape": list(part.shape), "doc": part.doc}
            | ({} if len(part.shape) > 1 else {"values": [round(float(v), 4) for v in observations[name][0, 0]]})
            for name, part in specs.items()
        }
    }
