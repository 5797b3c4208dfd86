"""A car that was trained: its policy, its settings and what it drives, out of a run folder."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from racecraft.contract.errors import RunFolderError
from racecraft.contract.world import DiscreteActions
from racecraft.formats.checkpoint import CheckpointEntry
from racecraft.formats.run_folder import RunFolder
from racecraft.players.trained import TrainedPolicy, load_policy
from racecraft.settings.composition import Settings
from racecraft.settings.overrides import from_dictionary
from racecraft.worlds.deepracer.env.actions import ActionSpace, action_space
from racecraft.worlds.deepracer.env.camera import CameraMount, mount_for_version
from racecraft.worlds.deepracer.env.light import light_for
from racecraft.worlds.deepracer.env.sensors import Sensors, car_sensors
from racecraft.worlds.deepracer.env.settings import TIME_TRIAL, CameraConfig, RaceConfig, objects_of, race_groups
from racecraft.worlds.deepracer.env.variation import VariationConfig
from racecraft.worlds.deepracer.env.world import RaceWorld
from racecraft.worlds.deepracer.files.model_metadata import action_space_from_aws
from racecraft.worlds.deepracer.players.open_run import is_aws_model
from racecraft.worlds.deepracer.players.run_track import KIND, track_of_run
from racecraft.worlds.deepracer.tracks.track import Track


@dataclass(frozen=True)
class TrainedCar:
    """A policy ready to drive, and the car it drives."""

    run: RunFolder
    checkpoint: CheckpointEntry
    policy: TrainedPolicy
    settings: Settings
    """Its race, what is in its way, and its camera: the groups `race`, `boxes` or `bots`, and `camera`."""
    actions: ActionSpace
    version: str | None
    """Version in its metadata; decides where the camera sits."""
    sensors: Sensors
    """What it sees with."""
    trained_on: Track
    """Track it was trained on."""

    @property
    def mount(self) -> CameraMount:
        """Where its camera sits."""
        return mount_for_version(self.version)

    @property
    def light(self) -> str:
        """Year of the simulator in whose light it drives."""
        return light_for(self.settings.camera.light, self.settings.race.car)

    def world(
        self,
        track: Track,
        num_cars: int,
        start_shares: Sequence[float] | None = None,
        laps: int = 1,
        race: RaceConfig | None = None,
        variation: VariationConfig = VariationConfig(),  # noqa: B008 (frozen)
    ) -> RaceWorld:
        """Return cars of this kind on a track, without a reward; `race` where it differs from how it was trained.

        However a car was trained, it is judged without variation unless one is given.
        """
        return RaceWorld(
            track,
            self.actions,
            race_config=race or self.settings.race,
            camera_config=self.settings.camera,
            num_cars=num_cars,
            start_shares=start_shares,
            laps=laps,
            mount=self.mount,
            sensors=self.sensors,
            objects=objects_of(self.settings),
            variation=variation,
        )


def load_trained_car(path: str | Path, which: str = "best") -> TrainedCar:
    """Load a car from its run folder.

    Args:
        path: The run folder.
        which: "best", "last" or the number of an iteration.

    Raises:
        RunFolderError: No run folder, a model that must be imported first, or the run of another kind of world.
        CheckpointError: No such checkpoint, or a damaged one.
    """
    if is_aws_model(path):
        raise RunFolderError(
            "{path}: is a model of AWS's trainer; expected a run folder. Make one of it: racecraft import {path}",
            path=path,
        )
    run = RunFolder.open(path)
    run.read_job_of(KIND)
    policy = load_policy(run, which)
    metadata = policy.metadata
    try:
        settings = settings_of(metadata)
        actions, sensors = actions_of(metadata["model_metadata"]), sensors_of(metadata["model_metadata"])
    except (KeyError, TypeError, AttributeError) as error:
        raise RunFolderError(
            "{path}: checkpoint {iteration} does not say what car it drives ({error!r}); expected "
            "the metadata and settings that racecraft wrote into it. Take a checkpoint that is whole.",
            path=path,
            iteration=policy.checkpoint.iteration,
            error=error,
        ) from error
    _require_own_car(path, policy, actions, sensors, settings.camera)
    return TrainedCar(
        run=run,
        checkpoint=policy.checkpoint,
        policy=policy,
        settings=settings,
        actions=actions,
        version=metadata["model_metadata"]["version"],
        sensors=sensors,
        trained_on=track_of_run(run),
    )


def settings_of(metadata: Mapping[str, Any]) -> Settings:
    """Return a car's race, what is in its way and its camera, from what its checkpoint says of itself."""
    race_type = metadata["settings"]["race"].get("type", TIME_TRIAL)
    groups = Settings(race=RaceConfig(), camera=CameraConfig(), **race_groups(race_type))
    return from_dictionary(groups, metadata["settings"])


def sensors_of(metadata: Mapping[str, Any]) -> Sensors:
    """Return what a car sees with, from AWS's metadata as plain values."""
    return car_sensors(metadata["sensor"], metadata.get("lidar_config"))


def actions_of(metadata: Mapping[str, Any]) -> ActionSpace:
    """Return what a car can be told, from AWS's metadata as plain values."""
    return action_space(action_space_from_aws(metadata["action_space"]))


def _require_own_car(
    path: str | Path, policy: TrainedPolicy, actions: ActionSpace, sensors: Sensors, camera: CameraConfig
) -> None:
    """Refuse a network whose outputs are not its car's actions, or whose inputs are not what its car sees.

    Raises:
        RunFolderError: The message names both.
    """
    decided, driven = _decisions(policy.spec.actions), _decisions(actions.spec)
    if decided != driven:
        raise RunFolderError(
            "{path}: its network decides by {decided}, and its car's metadata has {driven}; expected one output for "
            "each action. Put back the model_metadata.json that it was trained with.",
            path=path,
            decided=decided,
            driven=driven,
        )
    seen = {name: part.shape for name, part in policy.spec.visible.items()}
    shapes = {name: part.shape for name, part in sensors.specs(camera.width, camera.height).items()}
    if any(shapes.get(name) != shape for name, shape in seen.items()):
        raise RunFolderError(
            "{path}: its network sees {sights}, and its car {sights_2}; expected the same. Put back the "
            "model_metadata.json and camera settings that it was trained with.",
            path=path,
            sights=_sights(seen),
            sights_2=_sights(shapes),
        )


def _decisions(spec: Any) -> str:
    return f"{spec.count} actions" if isinstance(spec, DiscreteActions) else "two ranges"


def _sights(shapes: Mapping[str, tuple[int, ...]]) -> str:
    return " and ".join(f"{name} of {'x'.join(map(str, shape))}" for name, shape in shapes.items())
