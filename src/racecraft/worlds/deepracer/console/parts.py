"""What cars add to the console's pages."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import cache
from pathlib import Path
from types import MappingProxyType
from typing import Any

from racecraft.console.form import Step
from racecraft.console.parts import Card, Figure, Look, RaceDrive, RaceMaking, Rows, WorldParts, checkpoint_text
from racecraft.console.section import Section
from racecraft.console.workspace import Note
from racecraft.evaluation.run_groups import SeedGroup
from racecraft.formats.run_folder import RunFolder
from racecraft.league.race import Race
from racecraft.pages.chart import Chart, Level, Series
from racecraft.worlds.deepracer.analysis.logs.judged import fastest_evaluated_lap
from racecraft.worlds.deepracer.console import car_form, car_values
from racecraft.worlds.deepracer.console.car_form import TEMPLATES
from racecraft.worlds.deepracer.console.circuits import track_choices
from racecraft.worlds.deepracer.driving.known_laps import gap_percent
from racecraft.worlds.deepracer.tracks.catalogue import known_name, load_track, summary
from racecraft.worlds.deepracer.tracks.thumbnail import thumbnail_svg


class CarParts(WorldParts):
    """Cars in the console."""

    noun = "car"
    stage = f"{TEMPLATES}/stage.html"
    stage_modules = ("racecraft.worlds.deepracer.pages/cars.js",)
    stage_styles = ("racecraft.worlds.deepracer.pages/cars.css",)
    lesson = "It sees the road through its camera, is paid for getting on, tries until it laps, and laps ever faster."
    first: Mapping[str, Any] = MappingProxyType({"minutes": 1.0})

    def card(self, run: RunFolder, job: Mapping[str, Any], metrics: Rows) -> Card:
        """Return what a list says of a car's run."""
        name = str((job.get("track") or {}).get("name", ""))
        lap, gap = fastest_lap(metrics)
        return Card(
            place=_title(name),
            picture=name if known_name(name) else "",
            about=_about(run, job),
            rank=lap,
            best_text="" if lap is None else f"{lap:.2f} s",
            gap_percent=gap,
        )

    def figures(self, row: Mapping[str, Any]) -> list[Figure]:
        """Return the best lap and how far it is from the best known one."""
        gap = row["gap_percent"]
        lap = row["best_text"].removesuffix(" s") or "–"
        return [
            Figure(value=lap, unit="s" if row["best_text"] else "", label="best lap"),
            Figure(
                value="–" if gap is None else f"{gap:+.0f}",
                unit="" if gap is None else "%",
                label="to the best known lap",
            ),
        ]

    def charts(self, row: Mapping[str, Any], metrics: Rows) -> list[Chart]:
        """Return the reward graph and the lap times."""
        return [*super().charts(row, metrics), lap_chart(row, metrics)]

    def compared(self) -> list[tuple[str, str, str]]:
        """Return lap time and progress."""
        return [("Lap time while training", "fastest lap, s", "best_lap_seconds"), *super().compared()]

    def compared_look(self, groups: Sequence[SeedGroup]) -> Look:
        """Return their fastest laps on one map."""
        runs = tuple(tuple((one.name, str(one.run.path)) for one in group.runs) for group in groups)
        return Look(
            f"{TEMPLATES}/compared_laps.html",
            f"{TEMPLATES}.compared_laps:compared_laps",
            (runs,),
            modules=("racecraft.worlds.deepracer.pages/ghosts.js",),
            styles=("racecraft.worlds.deepracer.pages/telemetry.css",),
        )

    def race_making(self) -> RaceMaking:
        """Return the action that makes a race of cars, and the tracks."""
        from racecraft.worlds.deepracer.actions.create_race import create_race

        return RaceMaking(
            action=create_race,
            command="league create",
            first=("title", "track", "type", "laps", "ranking", "format", "closes", "season"),
            choices={"track": track_choices()},
        )

    def drive_page(
        self, race: Race, track: str, drives: Sequence[tuple[str, Path, int]], query: Mapping[str, str]
    ) -> tuple[str, dict[str, Any]]:
        """Return a drive beside the leader's."""
        from racecraft.worlds.deepracer.console.race_drive import drive_page

        return f"{TEMPLATES}/race_drive.html", drive_page(race.rules, track, drives, query)

    def tabs(self, row: Mapping[str, Any]) -> list[tuple[str, str]]:
        """Return the pages of laps, of failures and of the reward function."""
        return [("Laps", "/laps"), ("Why it fails", "/why"), ("Reward", "/reward")]

    def tab_page(
        self, row: Mapping[str, Any], tab: str, query: Mapping[str, str], drives: Callable[[], Sequence[RaceDrive]]
    ) -> tuple[str, dict[str, Any]]:
        """Return one of those pages."""
        run = RunFolder(Path(row["run"]))
        if tab == "reward":
            from racecraft.worlds.deepracer.analysis.run_facts import reward_of

            return f"{TEMPLATES}/reward_tab.html", {"source": reward_of(run)}
        if tab == "why":
            from racecraft.worlds.deepracer.console.why_tab import why_data

            return f"{TEMPLATES}/why.html", why_data(run)
        if tab == "laps":
            from racecraft.worlds.deepracer.console.laps import laps_page

            return f"{TEMPLATES}/laps.html", laps_page(Path(row["run"]), query, drives())
        return super().tab_page(row, tab, query, drives)

    def tab_task(self, row: Mapping[str, Any], tab: str) -> tuple[str, list[str]] | None:
        """Return `racecraft why` for the page of failures."""
        return ("Finding out why it fails", ["why", row["run"]]) if tab == "why" else None

    def look(self, row: Mapping[str, Any], tab: str, query: Mapping[str, str]) -> Look | None:
        """Return what the reward function of a run pays for."""
        if tab != "reward" or not RunFolder(Path(row["run"])).reward_function.is_file():
            return None
        return _reward_look("", row["run"], row["picture"], query)

    def look_ahead(self, step: str, values: Mapping[str, Any], query: Mapping[str, str]) -> Look | None:
        """Return what the reward function of the form pays for, or the lap that its actions allow."""
        if step == "reward":
            return _reward_look(str(values["reward"]), "", str(values["track"]), query)
        if step == "car":
            with_lap = {"yes": True, "no": False}.get(query.get("lap", ""))
            table = (str(values["actions"]), str(values["track"]), bool(values["reverse"]), with_lap)
            return Look(f"{TEMPLATES}/car_look.html", f"{TEMPLATES}.car_look:look_at_actions", table)
        return None

    def sections(self) -> Sequence[Section]:
        """Return tracks, driving by hand and laps as files."""
        from racecraft.worlds.deepracer.console import driving, laps, track_pages

        return (track_pages.SECTION, driving.SECTION, laps.SECTION)

    def has_picture(self, key: str) -> bool:
        """Tell whether a track is of the catalogue; racers' own are not kept here."""
        return known_name(key) is not None

    def picture(self, key: str) -> str:
        """Return a track as the text of an SVG file."""
        return _svg(key)

    def steps(self, values: Mapping[str, Any]) -> list[Step]:
        """Return the five steps in which a car is made."""
        return car_form.steps(values)

    def note(self, values: Mapping[str, Any]) -> Note:
        """Return the track that a car will drive on."""
        name = str((self.defaults() | dict(values))["track"])
        return Note(kind=self.kind.name, place=_title(name), picture=name if known_name(name) else "")

    def files(self, values: Mapping[str, Any]) -> dict[str, str]:
        """Return the car's reward function, metadata and hyperparameters."""
        return car_values.files(values)

    def words(self, values: Mapping[str, Any]) -> list[str]:
        """Return `train` and its options."""
        return car_values.words(values)

    def import_words(self, archive: Path, run: Path) -> list[str]:
        """Return `import` and its words."""
        return ["import", str(archive), str(run)]

    def words_of_files(self, archive: Path, folder: Path) -> list[str]:
        """Return `new` and its words."""
        return ["new", str(folder), f"--files={archive}"]

    def log_words(self, log: Path, page: Path) -> Sequence[list[str]]:
        """Return `telemetry`, which compares full laps, and `logs`, which also reads metrics and other episodes."""
        commands = [[command, str(log), f"--page={page}"] for command in ("telemetry", "logs")]
        return commands[1:] if log.suffix == ".json" else commands

    def values_of(self, run: RunFolder) -> dict[str, Any]:
        """Return the track, race, actions, sensors and reward function of a car's run."""
        return car_values.values_of(run)

    def require_same_body(self, values: Mapping[str, Any], base: Mapping[str, Any]) -> None:
        """Refuse other actions, sensors or another algorithm than the weights were learned with."""
        car_values.require_same_body(values, base)

    def summary(self, values: Mapping[str, Any]) -> list[tuple[str, str]]:
        """Return track, race, algorithm, actions and when it ends."""
        return car_values.summary(values)

    def remarks(self, values: Mapping[str, Any]) -> list[str]:
        """Return why the reward function or the actions cannot be used."""
        return car_values.remarks(values)


def _reward_look(text: str, folder: str, track: str, query: Mapping[str, str]) -> Look:
    return Look(
        f"{TEMPLATES}/reward_look.html", f"{TEMPLATES}.reward_look:look_at_reward", (text, folder, track, dict(query))
    )


def fastest_lap(metrics: Rows) -> tuple[float | None, float | None]:
    """Return the fastest lap of a run's evaluations, s, and how much longer than the best known lap it is, per cent.

    >>> fastest_lap([{"flying_lap_seconds": 6.0, "gap_percent": 20.0}, {"best_lap_seconds": 5.5}])
    (5.5, 10.0)
    """
    lap = fastest_evaluated_lap(metrics)
    timed = [row for row in metrics if row.get("flying_lap_seconds") and row.get("gap_percent") is not None]
    if lap is None or not timed:
        return lap, None
    known = timed[0]["flying_lap_seconds"] / (1.0 + timed[0]["gap_percent"] / 100.0)
    return lap, round(gap_percent(lap, known), 3)


def lap_chart(row: Mapping[str, Any], metrics: Rows) -> Chart:
    """Return the fastest lap of each evaluation, with the best known lap."""
    laps = [one for one in metrics if one.get("flying_lap_seconds") or one.get("best_lap_seconds")]
    seconds = [one.get("flying_lap_seconds") or one["best_lap_seconds"] for one in laps]
    known = row["rank"] / (1.0 + row["gap_percent"] / 100.0) if row["gap_percent"] is not None else None
    return Chart(
        "Lap time",
        "iteration",
        "fastest lap, s",
        [Series("evaluating", [one["iteration"] for one in laps], seconds, "both", colour=2)],
        levels=[] if known is None else [Level(known, f"best known lap {known:.2f} s")],
        low=known,
    )


@cache
def _svg(name: str) -> str:
    return thumbnail_svg(load_track(name))


def _title(name: str) -> str:
    return summary(name).title if known_name(name) else name


def _source(weights: str) -> str:
    """Return what a run began with; a number is a training of the same workspace, and the model's page says whose.

    >>> _source("old-run:best"), _source("old.tar.gz"), _source("1:last")
    ('from old-run, best checkpoint', 'from old.tar.gz', '')
    """
    name, _, which = weights.partition(":")
    if not name or name.isdigit():
        return ""
    return f"from {name}, {checkpoint_text(which)}" if which else f"from {name}"


def _about(run: RunFolder, job: Mapping[str, Any]) -> str:
    """Return what is peculiar about a car: its race, where that is no time trial, and who pays it."""
    request: Mapping[str, Any] = job.get("asked") or {}
    race = (job.get("settings") or {}).get("race", {}).get("type", "TIME_TRIAL")
    lines: Sequence[str] = [
        *([] if race == "TIME_TRIAL" else [race.replace("_", " ").lower()]),
        *([f"against {', '.join(request['against'])}"] if request.get("against") else []),
        _source(str(request.get("from") or "")),
        "own reward function" if run.reward_function.is_file() and request.get("folder") else "",
    ]
    return ", ".join(filter(None, lines))
