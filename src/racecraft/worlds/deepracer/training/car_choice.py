"""Which of the original's cars is trained, in whose light, and how its waypoints count. Begin with `choose_car`."""

from __future__ import annotations

from pathlib import Path

from racecraft.settings.composition import Settings
from racecraft.settings.overrides import with_values
from racecraft.worlds.deepracer.driving.demand import table_warning
from racecraft.worlds.deepracer.env.actions import action_space
from racecraft.worlds.deepracer.env.vehicle import PROFILES
from racecraft.worlds.deepracer.evaluation.recorded_car import recorded_car
from racecraft.worlds.deepracer.files.model_metadata import ModelMetadata
from racecraft.worlds.deepracer.tracks.track import Track


def choose_car(
    settings: Settings, metadata: ModelMetadata, requested: str | None, is_set: bool, folder: Path | None
) -> tuple[Settings, tuple[str, ...]]:
    """Return settings with the car filled in, and a note where the racer's recordings chose it.

    In this order: what was set or asked for; the car that the recordings in the racer's folder show, where they can
    tell; the one that goes with the metadata's version. Cars of version 1 and 2 drive in the light of 2019.

    Args:
        settings: As they stand.
        metadata: The racer's model_metadata.json.
        requested: A car that was asked for by name.
        is_set: `race.car` was set, and stays.
        folder: The racer's folder.
    """
    notes: tuple[str, ...] = ()
    if not is_set:
        car, notes = (requested, ()) if requested else _recorded_or_written(metadata, folder)
        settings = with_values(settings, "race", {"car": car})
    if settings.camera.light == "car" and metadata.version in ("1", "2"):
        settings = with_values(settings, "camera", {"light": "2019"})
    return settings, notes


def _recorded_or_written(metadata: ModelMetadata, folder: Path | None) -> tuple[str, tuple[str, ...]]:
    found = None if folder is None else recorded_car(folder)
    if found is None:
        return metadata.car, ()
    car = found.verdict.car or metadata.car
    note = f"car {car}: of {found.rows} rows in {folder}, {found.verdict.text()}"
    if found.verdict.car is None:
        note += f"; the metadata's version {metadata.version} goes with {metadata.car}"
    elif car != metadata.car:
        note += f"; the metadata's version says {metadata.car}"
    return car, (note,)


def waypoint_notes(settings: Settings, track: Track) -> tuple[str, ...]:
    """Return a note where the track's route file repeats a row, as a reward may speak of waypoints by number."""
    if not track.repeated_rows:
        return ()
    rows = ", ".join(map(str, track.repeated_rows))
    if settings.race.waypoints == "as_filed":
        return (
            f"waypoint {rows} of {track.name} repeats the one before and is counted, as in all logs of AWS we know; a "
            "reward with the numbers of simapp 6.0.5's code wants race.waypoints=distinct",
        )
    return (
        f"waypoint {rows} of {track.name} repeats the one before and is not counted; a reward with the numbers of "
        "AWS's logs wants race.waypoints=as_filed",
    )


def table_notes(settings: Settings, metadata: ModelMetadata, track: Track) -> tuple[str, ...]:
    """Return a note where the car's action table cannot lap the track, or only slowly.

    Args:
        settings: With the car filled in.
        metadata: The racer's model_metadata.json.
        track: As it is filed.
    """
    road = track.reversed() if settings.race.reverse else track
    car = settings.race.car
    warning = table_warning(road, car, PROFILES[car], action_space(metadata.action_space))
    return () if warning is None else (warning,)
