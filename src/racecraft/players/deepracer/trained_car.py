"""A car that was trained: its policy, its settings and what it drives, out of a run folder."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from racecraft.algorithms.ppo import PpoLearner
from racecraft.algorithms.weights import to_tensors
from racecraft.envs.deepracer.actions import ActionSpace, action_space
from racecraft.envs.deepracer.camera import CameraMount
from racecraft.envs.deepracer.world import RaceWorld, mount_for_version, world_spec
from racecraft.formats.aws.model_metadata import action_space_from_aws
from racecraft.formats.checkpoint import CheckpointEntry, Checkpoints
from racecraft.formats.run_folder import RunFolder
from racecraft.players.trained import GreedyPolicy
from racecraft.settings.groups import TrainSettings
from racecraft.settings.overrides import from_dictionary
from racecraft.tracks.track import Track

KIND = "deepracer"
"""What job.json calls a run of a car."""


@dataclass(frozen=True)
class TrainedCar:
    """A policy ready to drive, and the car it drives."""

    run: RunFolder
    checkpoint: CheckpointEntry
    policy: GreedyPolicy
    settings: TrainSettings
    actions: ActionSpace
    version: str | None
    """Version in its metadata; decides where the camera sits."""
    trained_on: str
    """Track it was trained on: a name, or a waypoint file."""

    @property
    def mount(self) -> CameraMount:
        """Where its camera sits."""
        return mount_for_version(self.version)

    def world(
        self, track: Track, num_cars: int, start_shares: Sequence[float] | None = None, laps: int = 1
    ) -> RaceWorld:
        """Return cars of this kind on a track, without a reward."""
        return RaceWorld(
            track,
            self.actions,
            race_config=self.settings.race,
            camera_config=self.settings.camera,
            num_cars=num_cars,
            start_shares=start_shares,
            laps=laps,
            mount=self.mount,
        )


def load_trained_car(path: str | Path, which: str = "best") -> TrainedCar:
    """Load a car from its run folder.

    Args:
        path: The run folder.
        which: "best", "last" or the number of an iteration.

    Raises:
        RunFolderError: No run folder, or the run of another kind of world.
        CheckpointError: No such checkpoint, or a damaged one.
    """
    run = RunFolder.open(path)
    job = run.read_job_of(KIND)
    shelf = Checkpoints(run.checkpoints)
    entry = shelf.find(which)
    weights, card = shelf.load_policy(which)
    settings = from_dictionary(TrainSettings, card["settings"])
    metadata = card["model_metadata"]
    car = TrainedCar(
        run=run,
        checkpoint=entry,
        policy=GreedyPolicy(_rebuild(settings, metadata, weights)),
        settings=settings,
        actions=_actions(metadata),
        version=metadata["version"],
        trained_on=job["asked"]["track"],
    )
    return car


def _rebuild(settings: TrainSettings, metadata: dict[str, Any], weights: dict[str, Any]) -> PpoLearner:
    spec = world_spec(_actions(metadata), settings.camera)
    learner = PpoLearner(spec, settings.network, settings.ppo, seed=0)
    learner.load_state_dict({"network": to_tensors(weights)})
    return learner


def _actions(metadata: dict[str, Any]) -> ActionSpace:
    return action_space(action_space_from_aws(metadata["action_space"]))
