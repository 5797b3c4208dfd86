"""The one way to a training in any kind of world: request → plan → train. Begin with `train`.

`WorldTraining` says what a kind of world promises here; its `WorldKind.training` names it.
"""

from __future__ import annotations

import contextlib
from collections.abc import Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any, Protocol, cast

from racecraft.algorithms.registry import Algorithm
from racecraft.contract.kinds import find_kind
from racecraft.formats.run_folder import RunFolder
from racecraft.settings.composition import Settings
from racecraft.training import trainer
from racecraft.training.callbacks import TrainingCallback
from racecraft.training.loop import Outcome
from racecraft.training.request import TrainRequest
from racecraft.training.resume import MessageCallback
from racecraft.training.trained import Trained
from racecraft.training.trainer import Distribute, Experiment


class Plan(Protocol):
    """A request made definite; every kind's own."""

    request: Any


class WorldTraining(Protocol):
    """What trains in a kind of world: a module, or an object."""

    Request: type[TrainRequest]

    def default_settings(self, algorithm: Algorithm) -> Settings:
        """Return what a training runs with where nothing is said."""
        ...

    def plan(self, request: Any) -> Any:
        """Read and check everything a request names; nothing is written, nothing started."""
        ...

    def plan_resume(self, path: Path, stops: tuple[str, ...]) -> Any:
        """Read from a run folder what it was asked for; `stops` replaces its own unless empty."""
        ...

    def build_experiment(self, plan: Any, on_message: MessageCallback) -> contextlib.AbstractContextManager[Experiment]:
        """Open the worlds that are learned and judged in; they are closed afterwards."""
        ...

    def summary(self, plan: Any, run: RunFolder, outcome: Outcome) -> dict[str, Any]:
        """Return what `--json` prints."""
        ...


def training_in(kind: str, whose: str = "") -> WorldTraining:
    """Return what trains in a kind of world; `whose` asks, for the message.

    Raises:
        MissingWorldError: No installed package brings the kind.
    """
    return cast(WorldTraining, find_kind(kind, whose).piece("training"))


def plan(request: TrainRequest) -> Any:
    """Return a request made definite.

    Raises:
        UserInputError: Something cannot be used.
    """
    return training_in(request.kind).plan(request)


def train(
    request: TrainRequest,
    callback: TrainingCallback,
    on_message: MessageCallback = print,
    spread: Distribute | None = None,
) -> Trained:
    """Train what is asked for until a stop condition holds.

    Args:
        request: What is trained, and how.
        callback: Watches the training.
        on_message: Called with a line for a person.
        spread: Carries the worlds elsewhere; None: they are carried here.

    Raises:
        UserInputError: Something that was asked for cannot be used.
    """
    return carry_out(request.kind, plan(request), callback, on_message, spread)


def carry_out(
    kind: str,
    planned: Any,
    callback: TrainingCallback,
    on_message: MessageCallback = print,
    spread: Distribute | None = None,
) -> Trained:
    """Train as planned, in a run folder of its own."""
    module = training_in(kind)
    request = planned.request
    with _opened(kind, planned, on_message, spread) as experiment:
        run, outcome = trainer.train(experiment, request.run, callback, on_message, request.clone_from)
        seed = experiment.seed
    return Trained(kind, run, outcome, seed, module.summary(planned, run, outcome))


def resume(
    path: str | Path,
    stops: tuple[str, ...],
    callback: TrainingCallback,
    on_message: MessageCallback = print,
    kind: str | None = None,
    spread: Distribute | None = None,
    again: Mapping[str, Any] | None = None,
) -> Trained:
    """Go on with a run from its last whole iteration, as if it had never stopped.

    Args:
        path: The run folder.
        stops: New stop conditions, as typed; none: those the run was begun with.
        callback: Watches the training.
        on_message: Called with a line for a person.
        kind: What the run must be of; None: any kind.
        spread: Carries the worlds elsewhere, wherever they were until now; None: they are carried here.
        again: Fields of the request that the run does not keep.

    Raises:
        RunFolderError: No run folder, one of another kind, one that is being trained, or that cannot be gone on with.
    """
    run = RunFolder.open(path)
    kind = (run.read_job() if kind is None else run.read_job_of(kind)).get("kind", "")
    module = training_in(kind, str(path))
    planned = module.plan_resume(Path(path), stops)
    if again:
        planned = replace(planned, request=replace(planned.request, **again))
    with _opened(kind, planned, on_message, spread) as experiment:
        outcome = trainer.resume(experiment, run, callback, on_message)
        seed = experiment.seed
    return Trained(kind, run, outcome, seed, module.summary(planned, run, outcome))


@contextlib.contextmanager
def _opened(kind: str, planned: Any, on_message: MessageCallback, spread: Distribute | None) -> Iterator[Experiment]:
    """Open the worlds, and have them carried elsewhere where that is asked for."""
    with training_in(kind).build_experiment(planned, on_message) as experiment:
        elsewhere = (
            contextlib.nullcontext(experiment) if spread is None else spread(kind, planned, experiment, on_message)
        )
        with elsewhere as settled:
            yield settled
