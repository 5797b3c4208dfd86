"""Whoever drives a car among others: a policy, what it sees with and what it can be told. Begin with `load_driver`."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path

from racecraft.contract.policy import Policy
from racecraft.formats.archive import without_ending
from racecraft.formats.checkpoint_ranking import split_source
from racecraft.formats.run_folder import JOB, RunFolder
from racecraft.players.open_run import open_run
from racecraft.worlds.deepracer.env.actions import ActionSpace
from racecraft.worlds.deepracer.env.camera import Camera, CameraMount
from racecraft.worlds.deepracer.env.light import light_for
from racecraft.worlds.deepracer.env.scene import build_scene
from racecraft.worlds.deepracer.env.sensors import Sensors
from racecraft.worlds.deepracer.env.settings import CameraConfig
from racecraft.worlds.deepracer.players.trained_car import KIND, TrainedCar, load_trained_car
from racecraft.worlds.deepracer.tracks.track import Track


@dataclass(frozen=True)
class Driver:
    """A policy and the car it drives."""

    name: str
    """As tables call it."""
    policy: Policy
    actions: ActionSpace
    """What its car can be told; every car of a race may have another."""
    car: str
    """Vehicle profile, a key of `vehicle.PROFILES`."""
    frame: CameraConfig
    """Size and light of its frame."""
    mount: CameraMount
    """Where its camera sits."""
    sensors: Sensors
    """What it sees with."""
    pace: float = 1.0
    """Share of the speed it is told that its car drives at."""

    @property
    def light(self) -> str:
        """Year of the simulator in whose light it drives."""
        return light_for(self.frame.light, self.car)

    def sees_like(self, other: Driver) -> bool:
        """Tell whether both are shown the same from the same place."""
        return self._sight == other._sight and self.sensors == other.sensors

    def camera(self, track: Track) -> Camera:
        """Return its camera on a track, in driving direction."""
        return Camera(build_scene(track, self.light, self.frame.grass), self.frame.width, self.frame.height, self.mount)

    @property
    def _sight(self) -> tuple[int, int, bool, str, CameraMount]:
        return self.frame.width, self.frame.height, self.frame.grass, self.light, self.mount


def driver_of(car: TrainedCar, name: str) -> Driver:
    """Return a trained car as a driver."""
    settings = car.settings
    return Driver(name, car.policy, car.actions, settings.race.car, settings.camera, car.mount, car.sensors)


def load_driver(source: str) -> Driver:
    """Return the driver of a run, RUN[:best|last|N], or of a model of AWS's: an archive, a folder, a graph.

    Raises:
        UserInputError: Something cannot be used.
    """
    return driver_of(load_car(source), name_of(source))


def load_car(source: str) -> TrainedCar:
    """Return the trained car of a run, or of a model of AWS's, which is imported for as long as this process lives.

    Raises:
        UserInputError: Something cannot be used.
    """
    path, which = split_source(source)
    return load_trained_car(open_run(path).path, which)


def name_of(source: str) -> str:
    """Return what a table calls a source.

    >>> name_of("runs/oval-1"), name_of("runs/oval-1:last"), name_of("old/model.tar.gz")
    ('oval-1', 'oval-1:last', 'model')
    """
    path, which = split_source(source)
    named = without_ending(Path(path).name)
    return f"{named}:{which}" if source.endswith(f":{which}") else named


def names_of(sources: Sequence[str]) -> list[str]:
    """Return what a table calls each source; where two would be called the same, they are numbered.

    >>> names_of(["runs/a", "old/a", "b.tar.gz"])
    ['a (1)', 'a (2)', 'b']
    """
    names = [name_of(source) for source in sources]
    return [
        f"{name} ({names[: place + 1].count(name)})" if names.count(name) > 1 else name
        for place, name in enumerate(names)
    ]


def league_in(sources: Iterable[str]) -> list[str]:
    """Return the sources with every folder that holds runs of cars replaced by these runs, a league.

    What is no such folder stays as it is: `load_driver` says what is wrong with it.
    """
    found: list[str] = []
    for source in sources:
        folder = Path(source)
        is_shelf = folder.is_dir() and not (folder / JOB).is_file()
        members = sorted(one.parent for one in folder.glob(f"*/{JOB}")) if is_shelf else []
        cars = [str(one) for one in members if RunFolder.open(one).read_job().get("kind") == KIND]
        found += cars or [source]
    return found
