"""Draw what a car's network sees at a place of the track."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from racecraft.actions.action import action
from racecraft.actions.figures import Figures
from racecraft.contract.progress import Progress, quiet
from racecraft.settings.request import Request, argument, option

if TYPE_CHECKING:
    from racecraft.worlds.deepracer.training.plan import CarPlan


@dataclass(frozen=True, kw_only=True)
class SensorsRequest(Request):
    """Which car stands where, and the picture that is drawn."""

    folder: Path | None = argument("A racer's folder, or a run folder; by default a car with a front camera.", None)
    track: str | None = option(None, "A name or a waypoint file; by default what the folder says, else reinvent_base.")
    at: float = option(0.0, "Where the car stands, share of the lap.", low=0.0, high=1.0)
    preset: str = option("fast", "fast or aws: decides the size of the frame.")
    fidelity: str | None = option(
        None, "sane, or aws with the LiDAR as the original mounts it; by default the preset's."
    )
    set_: tuple[str, ...] = option((), "group.name=value, as for `racecraft train`.")
    under: str | None = option(
        None, "Draw a sheet of frames instead: under each disturbance of a level, aws, light or strong."
    )
    output: Path = option(Path("sensors.png"), "The picture: .png, .svg or .pdf.", "--output", "-o")


@action
def sensors(request: SensorsRequest, progress: Progress = quiet) -> Figures:
    """Draw what the network sees: every frame pixel by pixel, what the LiDAR tells, its beams on the map.

    Examples:

        racecraft sensors my-car --at 0.3

        racecraft sensors my-car --preset aws --track Oval_track -o seen.png

        racecraft sensors my-car --under strong -o sheet.png

        racecraft sensors runs/reinvent_base-1 --at 0.5 --json
    """
    from racecraft.contract.world import allocate
    from racecraft.worlds.deepracer.analysis.sensor_figure import draw_sight

    planned = _planned(request)
    about = {"picture": request.output, "track": planned.track.name, "at": request.at}
    if request.under is not None:
        rows = _draw_under(planned, request.at, request.under, request.output)
        return Figures({**about, "under": request.under, "rows": rows})
    world = _world_at(planned, request.at)
    buffers = allocate(world.spec)
    world.reset(buffers, planned.seed)
    title = f"{planned.track.title or planned.track.name}, {100 * request.at:g} % of the lap"
    draw_sight(world, buffers.observations, title, request.output)
    seen = {name: part for name, part in world.spec.observations.items() if not part.privileged}
    return Figures({**about, "observations": _described(seen, buffers.observations)})


SHEET_COLUMNS = 5


def _planned(request: SensorsRequest) -> CarPlan:
    """Return the training that the folder asks for; of a run folder, the one it was."""
    from dataclasses import replace

    from racecraft.formats.run_folder import RunFolder
    from racecraft.settings.overrides import apply_overrides, with_values
    from racecraft.worlds.deepracer.tracks.catalogue import load_track
    from racecraft.worlds.deepracer.training.plan import RaceRequest, plan_car, plan_resume

    folder, track, fidelity = request.folder, request.track, request.fidelity
    if folder is None or not RunFolder(folder).job.is_file():
        race_request = RaceRequest(folder, track, preset=request.preset, fidelity=fidelity, overrides=request.set_)
        return plan_car(race_request)
    planned = plan_resume(folder)
    settings = planned.settings if fidelity is None else with_values(planned.settings, "race", {"fidelity": fidelity})
    settings = apply_overrides(settings, request.set_)
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


def _described(specs: dict[str, Any], observations: dict[str, Any]) -> dict[str, Any]:
    """Return each observation by name: the shapes of frames, the values of vectors."""
    return {
        name: {"shape": list(part.shape), "doc": part.doc}
        | ({} if len(part.shape) > 1 else {"values": [round(float(v), 4) for v in observations[name][0, 0]]})
        for name, part in specs.items()
    }
