"""Race trained cars against each other."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from racecraft.actions.action import action
from racecraft.contract.progress import Progress, quiet
from racecraft.settings.request import Request, argument, group, option
from racecraft.worlds.deepracer.actions.mishap_options import MishapOptions

if TYPE_CHECKING:
    from racecraft.worlds.deepracer.analysis.films.film import FilmStyle
    from racecraft.worlds.deepracer.evaluation.head_to_head import HeadToHead, RaceResult
    from racecraft.worlds.deepracer.tracks.track import Track


MIN_PACE = 0.1
"""Share of the speed it is told that a car may be slowed down to."""


@dataclass(frozen=True, kw_only=True)
class RulesOptions(Request):
    """How a race is run."""

    laps: int = option(3, "Of every car.")
    races: int | None = option(
        None, "How many; by default one for each car, which then stands on every place of the grid once."
    )
    done_condition: str = option("all", "any: a race is over with the first car that finishes; all: with the last.")
    mishaps: MishapOptions = group(MishapOptions)

    def rules(self) -> HeadToHead:
        """Return the rules.

        Raises:
            SettingError: One of them is out of its range.
        """
        from racecraft.worlds.deepracer.evaluation.head_to_head import HeadToHead

        return HeadToHead(self.laps, self.races, self.done_condition, **self.mishaps.typed())


@dataclass(frozen=True, kw_only=True)
class RaceFilm(Request):
    """How the first race is filmed, as it was typed."""

    video: Path | None = option(None, "Film the first race into this MP4 file.")
    view: str | None = option(None, "Camera of the film: car, chase, top, or pip (where nobody says).")
    size: str | None = option(None, "Of the film: 480p, 540p, 720p (where nobody says) or 1080p.")
    fps: int | None = option(None, "Its pictures a second: 15 to 60, 30 where nobody says.")

    def style(self) -> FilmStyle:
        """Return the film's style; refuse, before the race and not after it, what could do nothing.

        Raises:
            VideoError: The file is no MP4.
            SettingError: No such style, or one for no film.
        """
        from racecraft.analysis.video import film_path
        from racecraft.contract.errors import SettingError
        from racecraft.worlds.deepracer.analysis.films.film import FilmStyle

        typed: dict[str, Any] = {"view": self.view, "size": self.size, "fps": self.fps}
        given = {name: value for name, value in typed.items() if value is not None}
        style = FilmStyle(**given)
        if self.video is not None:
            film_path(self.video)
        elif given:
            name, value = next(iter(given.items()))
            raise SettingError(
                "--{name} {value} films nothing; expected --video FILE.mp4 with it.", name=name, value=value
            )
        return style


@dataclass(frozen=True, kw_only=True)
class RaceRequest(Request):
    """Which cars race where, by which rules, and how the first race is filmed."""

    cars: tuple[str, ...] = argument(
        "2 to 8 of them: RUN[:best|last|N], or a model of AWS's. The first is seen in the film."
    )
    track: str | None = option(None, "A name or a waypoint file; by default the track the first was trained on.")
    rules: RulesOptions = group(RulesOptions)
    reverse_direction: bool | None = option(None, "By default as the first was trained.")
    pace: tuple[float, ...] = option(
        (), "Share of the speed it is told that each car drives at, 0.1 to 1, as often as there are cars."
    )
    film: RaceFilm = group(RaceFilm)
    seed: int = option(0, "Of what chance does to the cars, with fidelity aws.", low=0)


@dataclass(frozen=True)
class Raced:
    """What the races came to, and the films that were made."""

    track: Track
    laps: int
    result: RaceResult
    limits: tuple[str, ...]
    """What is worth saying of cars beyond the speeds that logs tell of, a sentence each."""
    files: dict[str, Path]

    def as_dictionary(self) -> dict[str, Any]:
        """Return the figures by name."""
        return {"track": self.track.name, **self.result.as_dictionary(), "video": None, **self.files}


@action
def race(request: RaceRequest, progress: Progress = quiet) -> Raced:
    """Race trained cars against each other, as HEAD_TO_MODEL does: they see each other, and who runs into one waits.

    Examples:

        racecraft race runs/reinvent_base-1 runs/reinvent_base-2 --video race.mp4

        racecraft race runs/mine:last runs/mine:0 --races 20 --laps 1

        racecraft race runs/mine:last runs/mine:last --pace 1 --pace 0.5 --video pass.mp4

        racecraft race runs/mine ~/Downloads/their-model.tar.gz runs/other --track Oval_track --json
    """
    from racecraft.worlds.deepracer.analysis.race_film import film_race
    from racecraft.worlds.deepracer.env.vehicle import beyond_logs
    from racecraft.worlds.deepracer.evaluation.head_to_head import race_head_to_head, require_company
    from racecraft.worlds.deepracer.players.driver import driver_of, load_car, names_of
    from racecraft.worlds.deepracer.tracks.catalogue import load_track

    style, rules = request.film.style(), request.rules.rules()
    require_company(len(request.cars))
    paces = requested_paces(request.pace, len(request.cars))
    loaded = [load_car(source) for source in request.cars]
    drivers = [
        replace(driver_of(car, name), pace=share)
        for car, name, share in zip(loaded, names_of(request.cars), paces, strict=True)
    ]
    circuit = load_track(request.track) if request.track else loaded[0].trained_on
    config = loaded[0].settings.race
    if request.reverse_direction is not None:
        config = replace(config, reverse=request.reverse_direction)
    result = race_head_to_head(drivers, circuit, rules, config, request.seed)
    files: dict[str, Path] = {}
    if request.film.video is not None:
        progress(f"Filming {len(result.ticks[0])} ticks …")
        road = circuit.reversed() if config.reverse else circuit
        with progress.counting("pictures") as count:
            files = film_race(result, drivers, road, request.film.video, style, count=count)
    limits = {beyond_logs(one.car, one.actions.fastest) for one in drivers}
    return Raced(circuit, rules.laps, result, tuple(sorted(one for one in limits if one)), files)


def requested_paces(paces: Sequence[float], cars: int) -> Sequence[float]:
    """Return each car's pace; 1 where nobody says.

    Raises:
        SettingError: There is not one for each car, or one is out of its range.
    """
    from racecraft.contract.errors import SettingError

    if not paces:
        return [1.0] * cars
    if len(paces) != cars or not all(MIN_PACE <= pace <= 1.0 for pace in paces):
        options = " ".join(f"--pace {pace:g}" for pace in paces)
        raise SettingError(
            "{told}: expected {cars} shares from {least_pace:g} to 1, one for each car in their order.",
            told=options,
            cars=cars,
            least_pace=MIN_PACE,
        )
    return paces
