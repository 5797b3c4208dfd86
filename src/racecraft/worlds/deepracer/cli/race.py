"""`racecraft race`: cars against each other."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from racecraft.cli.option_groups import takes_groups

if TYPE_CHECKING:
    from racecraft.worlds.deepracer.analysis.films.film import FilmStyle
    from racecraft.worlds.deepracer.evaluation.head_to_head import HeadToHead, RaceResult


LEAST_PACE = 0.1
"""Share of the speed it is told that a car may be slowed down to."""


@dataclass(frozen=True)
class RulesOptions:
    """How a race is run."""

    laps: Annotated[int, typer.Option(help="Of every car.")] = 3
    races: Annotated[
        int | None,
        typer.Option(help="How many; by default one for each car, which then stands on every place of the grid once."),
    ] = None
    done_condition: Annotated[
        str, typer.Option(help="any: a race is over with the first car that finishes; all: with the last.")
    ] = "all"
    max_resets: Annotated[int, typer.Option(help="How often a car is set back in a race.")] = 100
    off_track_penalty: Annotated[float, typer.Option(help="Seconds it waits after leaving the road.")] = 5.0
    collision_penalty: Annotated[float, typer.Option(help="Seconds it waits after running into another car.")] = 5.0

    def rules(self) -> HeadToHead:
        """Return the rules.

        Raises:
            SettingError: One of them is out of its range.
        """
        from racecraft.worlds.deepracer.evaluation.head_to_head import HeadToHead

        return HeadToHead(
            self.laps, self.races, self.done_condition, self.max_resets, self.off_track_penalty, self.collision_penalty
        )


@dataclass(frozen=True)
class RaceFilm:
    """How the first race is filmed, as it was typed."""

    video: Annotated[Path | None, typer.Option(help="Film the first race into this MP4 file.")] = None
    view: Annotated[
        str | None, typer.Option(help="Camera of the film: car, chase, top, or pip (where nobody says).")
    ] = None
    size: Annotated[str | None, typer.Option(help="Of the film: 480p, 540p, 720p (where nobody says) or 1080p.")] = None
    fps: Annotated[int | None, typer.Option(help="Its pictures a second: 15 to 60, 30 where nobody says.")] = None

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
        asked = {name: value for name, value in typed.items() if value is not None}
        style = FilmStyle(**asked)
        if self.video is not None:
            film_path(self.video)
        elif asked:
            name, value = next(iter(asked.items()))
            raise SettingError(
                "--{name} {value} films nothing; expected --video FILE.mp4 with it.", name=name, value=value
            )
        return style


@takes_groups
def race(
    cars: Annotated[
        list[str],
        typer.Argument(help="2 to 8 of them: RUN[:best|last|N], or a model of AWS's. The first is seen in the film."),
    ],
    track: Annotated[
        str | None, typer.Option(help="A name or a waypoint file; by default the track the first was trained on.")
    ] = None,
    *,
    asked: RulesOptions,
    reverse_direction: Annotated[
        bool | None,
        typer.Option("--reverse-direction/--no-reverse-direction", help="By default as the first was trained."),
    ] = None,
    pace: Annotated[
        list[float] | None,
        typer.Option(
            help="Share of the speed it is told that each car drives at, 0.1 to 1, as often as there are cars."
        ),
    ] = None,
    film: RaceFilm,
    seed: Annotated[int, typer.Option(min=0, help="Of what chance does to the cars, with fidelity aws.")] = 0,
    json: Annotated[bool, typer.Option("--json", help="One JSON object on one line of standard output.")] = False,
) -> None:
    """Race trained cars against each other, as HEAD_TO_MODEL does: they see each other, and who runs into one waits.

    Examples:

        racecraft race runs/reinvent_base-1 runs/reinvent_base-2 --video race.mp4

        racecraft race runs/mine:last runs/mine:0 --races 20 --laps 1

        racecraft race runs/mine:last runs/mine:last --pace 1 --pace 0.5 --video pass.mp4

        racecraft race runs/mine ~/Downloads/their-model.tar.gz runs/other --track Oval_track --json
    """
    from racecraft.cli.output import counting, print_json, say
    from racecraft.worlds.deepracer.analysis.race_film import film_race
    from racecraft.worlds.deepracer.env.vehicle import beyond_logs
    from racecraft.worlds.deepracer.evaluation.head_to_head import race_heads, require_company
    from racecraft.worlds.deepracer.players.driver import driver_of, load_car, names_of
    from racecraft.worlds.deepracer.tracks.catalogue import load_track

    style, rules = film.style(), asked.rules()
    require_company(len(cars))
    paces = paces_asked(pace, len(cars))
    loaded = [load_car(source) for source in cars]
    drivers = [
        replace(driver_of(car, name), pace=share)
        for car, name, share in zip(loaded, names_of(cars), paces, strict=True)
    ]
    circuit = load_track(track) if track else loaded[0].trained_on
    config = loaded[0].settings.race
    if reverse_direction is not None:
        config = replace(config, reverse=reverse_direction)
    result = race_heads(drivers, circuit, rules, config, seed)
    files: dict[str, Path] = {}
    if film.video is not None:
        say(f"Filming {len(result.ticks[0])} ticks …", quiet_stdout=json)
        shown = circuit.reversed() if config.reverse else circuit
        with counting("pictures", quiet_stdout=json) as count:
            files = film_race(result, drivers, shown, film.video, style, count=count)
    facts: dict[str, Any] = {
        "track": circuit.name,
        **result.as_dictionary(),
        "video": None,
        **{kind: str(path) for kind, path in files.items()},
    }
    if json:
        print_json(facts)
        return
    over = f"over {asked.laps} laps" if circuit.closed else "from start to finish"
    print(f"{len(result.races)} races {over} on {circuit.title or circuit.name}:")
    print_standings(result)
    print(f"{result.overtakes_per_race:.2f} overtakes a race")
    limits = {beyond_logs(one.car, one.actions.fastest) for one in drivers}
    print("".join(f"{sentence}\n" for sentence in sorted(one for one in limits if one)), end="")
    for kind, path in files.items():
        print(f"{kind}: {path}")


def paces_asked(paces: list[float] | None, cars: int) -> list[float]:
    """Return each car's pace; 1 where nobody says.

    Raises:
        SettingError: There is not one for each car, or one is out of its range.
    """
    from racecraft.contract.errors import SettingError

    if not paces:
        return [1.0] * cars
    if len(paces) != cars or not all(LEAST_PACE <= pace <= 1.0 for pace in paces):
        told = " ".join(f"--pace {pace:g}" for pace in paces)
        raise SettingError(
            "{told}: expected {cars} shares from {least_pace:g} to 1, one for each car in their order.",
            told=told,
            cars=cars,
            least_pace=LEAST_PACE,
        )
    return paces


def print_standings(result: RaceResult) -> None:
    """Print a row a driver, the one with the best mean place first."""
    from rich.table import Table

    from racecraft.cli.output import print_table

    table = Table(box=None, pad_edge=False, header_style="bold")
    titles = ("car", "wins", "mean place", "finishes", "mean seconds", "overtakes", "crashes", "was hit", "off track")
    for title in titles:
        table.add_column(title, justify="left" if title == "car" else "right")
    told = result.as_dictionary()["drivers"]
    for one in sorted(told, key=lambda facts: facts["mean_place"]):
        seconds = "-" if one["mean_seconds"] is None else f"{one['mean_seconds']:.2f}"
        counts = (str(one[name]) for name in ("overtakes", "crashes", "was_hit", "off_tracks"))
        finishes = f"{one['finishes']}/{one['races']}"
        table.add_row(one["driver"], str(one["wins"]), f"{one['mean_place']:.2f}", finishes, seconds, *counts)
    print_table(table)
