"""Cars in a league. Begin with `CarLeague`, which the world's kind names.

What drives is imported when something drives: pages ask for boards and replays alone.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from racecraft.league.race import Race
from racecraft.league.world_part import Driven, DriveOrder, OnProgress, no_progress

if TYPE_CHECKING:
    from racecraft.worlds.deepracer.league.drives import CarDrive


class CarLeague:
    """A car race, as `racecraft.league.world_part.LeagueWorld` asks for it."""

    def admit(self, source: str, folder: Path, rules: Mapping[str, Any]) -> dict[str, Any]:
        """Copy a car, check it, and return its facts; see `entry.admit_car`."""
        from racecraft.worlds.deepracer.league.entry import admit_car
        from racecraft.worlds.deepracer.league.rules import CarRules

        return admit_car(source, folder, CarRules.from_dictionary(rules))

    def name_of(self, source: str) -> str:
        """Return what a board calls a car."""
        from racecraft.worlds.deepracer.players.driver import name_of

        return name_of(source)

    def describe(self, rules: Mapping[str, Any], tracks: Sequence[str]) -> list[str]:
        """Return the rules, a line each."""
        from racecraft.worlds.deepracer.league.rules import CarRules

        return CarRules.from_dictionary(rules).describe()

    def road(self, track: str) -> dict[str, Any]:
        """Return the borders of a track."""
        from racecraft.worlds.deepracer.league.shown import shown_road

        return shown_road(track)

    def shown(self, folder: Path) -> dict[str, Any]:
        """Return where each car of a drive was."""
        from racecraft.worlds.deepracer.league.shown import shown_drive

        return shown_drive(folder)

    def history(self, race: Race, laps: Sequence[float | None], archive: Path) -> list[dict[str, Any]]:
        """Return AWS's races on the track, oldest first: rank and times, no names."""
        from racecraft.worlds.deepracer.league.history import history

        return history(race, laps, archive)

    def canonical_track(self, name: str) -> str:
        """Return a track's own name, however it was spelt."""
        from racecraft.worlds.deepracer.tracks.catalogue import load_track

        return load_track(name).name

    def is_alone(self, order: DriveOrder) -> bool:
        """Cars that meet drive in one process."""
        return True

    def warm_up(self) -> None:
        """Drive an untrained car for a moment: everything is imported and compiled then."""
        from racecraft.worlds.deepracer.league.warm_up import warm_up

        warm_up()

    def drive(self, order: DriveOrder, on_progress: OnProgress = no_progress) -> Driven:
        """Let the cars drive."""
        return self._driven(order, None, on_progress)

    def redrive(self, order: DriveOrder, folder: Path) -> Driven:
        """Drive again by recorded actions."""
        return self._driven(order, folder)

    def film(self, order: DriveOrder, folder: Path, video: Path, seen_from: int) -> None:
        """Film a drive: the car's own view beside the figures, or of cars that met the first race from one of them."""
        from racecraft.worlds.deepracer.league.film import film_cars

        film_cars(self._drives(order, folder), order.names, video, seen_from)

    def _driven(self, order: DriveOrder, recorded: Path | None, on_progress: OnProgress = no_progress) -> Driven:
        from racecraft.worlds.deepracer.league.files import files_of

        drives = self._drives(order, recorded, on_progress)
        return Driven(tuple(one.outcome for one in drives), {} if recorded else files_of(drives))

    def _drives(
        self, order: DriveOrder, recorded: Path | None, on_progress: OnProgress = no_progress
    ) -> list[CarDrive]:
        from racecraft.worlds.deepracer.league.drives import drive_cars
        from racecraft.worlds.deepracer.league.files import recorded_in
        from racecraft.worlds.deepracer.league.rules import CarRules
        from racecraft.worlds.deepracer.players.trained_car import load_trained_car
        from racecraft.worlds.deepracer.tracks.catalogue import load_track

        cars = [load_trained_car(model) for model in order.models]
        actions = None if recorded is None else recorded_in(recorded, len(cars))
        rules = CarRules.from_dictionary(order.rules)
        return drive_cars(cars, order.names, load_track(order.track), rules, order.seed, actions, on_progress)
