"""Judge a car under disturbances: what of the lap survives a level of variation."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

from racecraft.actions.figures import Figures
from racecraft.contract.progress import Progress
from racecraft.settings.request import Request, option

if TYPE_CHECKING:
    from racecraft.worlds.deepracer.players.trained_car import TrainedCar
    from racecraft.worlds.deepracer.tracks.track import Track

TRIES, MAX_TRIES = 20, 1000


@dataclass(frozen=True, kw_only=True)
class DisturbedDrive(Request):
    """How a car is judged under disturbances, as it was typed."""

    PANEL: ClassVar[str] = "Under disturbances"
    under: str | None = option(
        None, "Judge it under variation of a level: perturbed, aws, light or strong; one episode from every start."
    )
    each: bool = option(False, "Under each of the level's disturbances by itself as well.")
    only: tuple[str, ...] = option((), "Under this disturbance by itself, such as glare; may be repeated.")
    tries: int | None = option(
        None, f"Starts for each of them, spread over the lap; {TRIES} by default.", low=2, high=MAX_TRIES
    )

    def check(self, others: Mapping[str, Any]) -> None:
        """Refuse, before the drive, levels and disturbances that are none, and options that could do nothing.

        Args:
            others: Options of an undisturbed evaluation that were given.

        Raises:
            SettingError: One of them.
        """
        from racecraft.contract.errors import SettingError
        from racecraft.worlds.deepracer.env.variation import LEVELS, checked_disturbance, checked_level

        if self.under is None:
            idle = list(self.given())
            if idle:
                levels = " or ".join(name for name in LEVELS if name != "off")
                raise SettingError(
                    "{idle} says how to judge under a level; expected --under too: {levels}.",
                    idle=idle[0],
                    levels=levels,
                )
            return
        checked_level(self.under)
        for name in self.only:
            checked_disturbance(name)
        foreign = list(others)
        if foreign:
            raise SettingError(
                "--under drives one episode from every start and films nothing, so {foreign} has no say "
                "there; expected one or the other.",
                foreign=", ".join(foreign),
            )


class SurvivedLaps(Figures):
    """What survives of the lap under each disturbance."""

    def __init__(self, figures: Mapping[str, Any], where: str, files: Mapping[str, Path]) -> None:
        super().__init__(figures, files)
        self.where = where
        """Run, checkpoint, track and level, in words."""


def drive_disturbed(
    options: DisturbedDrive, run: Path, car: TrainedCar, circuit: Track, picture: Path | None, progress: Progress
) -> SurvivedLaps:
    """Drive under disturbances, draw the bars and keep the figures beside them.

    Args:
        options: The level, and which of its disturbances.
        run: The run, as the user named it.
        car: Who drives.
        circuit: Where.
        picture: The PNG of the bars; None: in the run's evaluations folder.
        progress: Receives a message a bar.
    """
    from json import dumps

    from racecraft.formats.atomic import make_folder, write_atomic
    from racecraft.worlds.deepracer.analysis.robustness import draw_robustness
    from racecraft.worlds.deepracer.evaluation.robustness import (
        ALL,
        Bar,
        RobustnessReport,
        judge_under,
        requested_names,
    )

    level, tries, bars = str(options.under), options.tries or TRIES, list[Bar]()
    names = requested_names(car, level, options.each, options.only)
    progress(f"Driving {tries} starts undisturbed, then under {', '.join([*names, ALL])} …")
    with progress.counting("episodes") as count:
        for bar in judge_under(car, circuit, level, names, tries, on_progress=count):
            bars.append(bar)
            progress(f"{bar.name}: {bar.report.full_laps} of {tries} laps ({len(bars)} of {len(names) + 2})")
    report = RobustnessReport(level, tuple(bars)).as_dictionary()
    make_folder(car.run.evaluations)
    stem = f"{circuit.name}-{car.checkpoint.iteration}-under-{level}"
    files = {
        "picture": picture or car.run.evaluations / f"{stem}.png",
        "figures": car.run.evaluations / f"{stem}.json",
    }
    place = f"checkpoint {car.checkpoint.iteration}, on {circuit.title or circuit.name}"
    note = f"{car.run.path.name}, {place}, {tries} starts a bar"
    draw_robustness(report["bars"], f"What survives of the lap: variation {level}", files["picture"], note)
    figures = {"run": str(run), "checkpoint": car.checkpoint.iteration, "track": circuit.name, **report}
    write_atomic(files["figures"], dumps(figures, indent=2) + "\n")
    return SurvivedLaps(figures, f"{run}, {place}, under {level}", files)
