"""Train as the options of a world's command say. Begin with `train_run`.

A world brings its options (`TrainingOptions`) and the request they make. Everything between is the same for all: a new
run or an old one, a job or this process, one seed or several, buckets, metrics, a page, workers.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from contextlib import ExitStack
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from racecraft.actions.action import Served
from racecraft.actions.training_options import TrainingOptions
from racecraft.contract.kinds import find_kind
from racecraft.contract.progress import Progress, quiet
from racecraft.training.callbacks import Callbacks, NullCallback, TrainingCallback
from racecraft.training.notify import notified, require_addresses
from racecraft.training.signals import SIGTERM, TERMINATED, sigterm_interrupts
from racecraft.training.trained import Trained

if TYPE_CHECKING:
    from racecraft.actions.submit_job import Submitted
    from racecraft.actions.train_seeds import TrainedSeeds
    from racecraft.serving.watch_process import WatchProcess
    from racecraft.training.request import TrainRequest
    from racecraft.training.trainer import Distribute


@dataclass(frozen=True)
class TrainedRun(Trained, Served):
    """A training that ended, and what it left for people."""

    files: Mapping[str, Any] = field(default_factory=dict)
    """By kind: paths, and figures of a world's own."""
    page: WatchProcess | None = None
    """The page opened by `watch`; it stays until it is closed, or this process ends."""

    @property
    def exit_code(self) -> int:
        """Exit code of a command: that of a process which SIGTERM ended, else 0."""
        return TERMINATED if self.figures["stopped_by"] == SIGTERM else 0

    def as_dictionary(self) -> dict[str, Any]:
        """Return its summary and what it left."""
        return {**self.summary(), **self.files}

    def serve(self, ready: Callable[[], None], progress: Progress) -> None:
        """Call `ready`, then keep the page, where there is one, until Ctrl-C; without a terminal close it."""
        if self.page is None:
            ready()
        else:
            self.page.serve(ready, progress)


@dataclass(frozen=True)
class Planned:
    """A training that was read through and not begun."""


def train_run(
    options: TrainingOptions, progress: Progress = quiet, callback: TrainingCallback | None = None
) -> TrainedRun | TrainedSeeds | Submitted | Planned:
    """Train, or go on with a run, here or as a job.

    Args:
        options: What is trained, and how.
        progress: Receives messages; shows each iteration where `callback` is None.
        callback: Watches the training.

    Raises:
        UserInputError: Something given cannot be used.
    """
    from racecraft.actions.resuming import resumed_run
    from racecraft.jobs.tuning.dry_run import PLAN_ONLY
    from racecraft.training import worlds

    require_addresses(options.notify)
    if os.environ.get(PLAN_ONLY):
        worlds.plan(options.request(progress))
        return Planned()
    if options.seeds is not None and not options.resume:
        from racecraft.actions.train_seeds import train_seeds

        return train_seeds(options, progress)
    resumed = resumed_run(options)
    if options.detach:
        from racecraft.actions.submit_job import submit_options

        return submit_options(options, progress)
    watcher = callback or progress.training_callback() or NullCallback()
    return _train_here(options, None if resumed else options.request(progress), watcher, progress)


def _train_here(
    options: TrainingOptions, request: TrainRequest | None, callback: TrainingCallback, progress: Progress
) -> TrainedRun:
    """Train a request, or go on with the run that the options name where it is None."""
    from racecraft.actions.metrics import with_metrics
    from racecraft.actions.mirroring import mirrored, place_of_mirror

    run = options.run if request is None else None
    spread = _spread(options)
    place = place_of_mirror(options.mirror, options.installation, run, progress)
    callback = with_metrics(callback, options, progress)
    with ExitStack() as until_end:
        page = options.open_page(progress)
        if page is not None:
            until_end.callback(page.close)
            callback = Callbacks(page, callback)
        with (
            notified(callback, options.notify, progress) as telling,
            mirrored(telling, place, progress, run) as mirroring,
        ):
            with sigterm_interrupts():
                trained = _carry_out(options, request, mirroring, spread, progress)
            made = TrainedRun(**vars(trained), page=page)
            if not made.exit_code:
                made = TrainedRun(**vars(trained), files=leave_files(made, options.pictures, progress), page=page)
        until_end.pop_all()
    return made


def _carry_out(
    options: TrainingOptions,
    request: TrainRequest | None,
    callback: TrainingCallback,
    spread: Distribute | None,
    progress: Progress,
) -> Trained:
    from racecraft.training import worlds

    if request is not None:
        return worlds.train(request, callback, progress, spread)
    assert options.run is not None
    return worlds.resume(options.run, options.stop, callback, progress, options.kind, spread, options.fields_as_given())


def _spread(options: TrainingOptions) -> Distribute | None:
    """Return what carries the worlds to a cluster; None without one, whose code is then not imported."""
    if options.cluster is None:
        return None
    from racecraft.cluster.distribute import distribute

    return distribute(options.cluster)


def leave_files(trained: Trained, pictures: bool, progress: Callable[[str], None]) -> dict[str, Any]:
    """Leave pictures and pages in the run folder of a training; return their paths, and figures of their own, by kind.

    Args:
        trained: The training.
        pictures: Whether they are wanted; what a world judges after a training is judged anyway.
        progress: Receives messages.
    """
    from racecraft.actions.report import leave_report

    own = find_kind(trained.kind).piece("pictures")
    if own is not None:
        left: dict[str, Any] = own(trained, pictures, progress)
        return left
    return dict(leave_report(trained.run.path, progress)) if pictures else {}
