"""Train in the corridor: the options of the command and of `rc.train`, and the request they make."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import ClassVar

from fifth_world.training import CorridorRequest
from racecraft.actions.action import action
from racecraft.actions.submit_job import Submitted
from racecraft.actions.train_run import Planned, TrainedRun, train_run
from racecraft.actions.train_seeds import TrainedSeeds
from racecraft.actions.training_options import TrainingOptions
from racecraft.contract.progress import Progress, quiet
from racecraft.settings.request import option


@dataclass(frozen=True, kw_only=True)
class CorridorTraining(TrainingOptions):
    """What a training is asked."""

    kind: ClassVar[str] = "corridor"
    length: int = option(9, "Cells.", low=2)

    def request(self, progress: Callable[[str], None]) -> CorridorRequest:
        """Return the request of a new run."""
        return CorridorRequest(length=self.length, **self.for_request(self.source(progress)))


@action
def train(request: CorridorTraining, progress: Progress = quiet) -> TrainedRun | TrainedSeeds | Submitted | Planned:
    """Train until the exit is found the short way."""
    return train_run(request, progress)
