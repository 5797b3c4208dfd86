"""How every command trains. Begin with `Road`.

A command brings the options of its world, the request they make, and what is printed in the end. Everything between is
the same: a new run or an old one, a job or this terminal, buckets, metrics, workers.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Mapping
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from racecraft.actions.training_options import TrainingOptions
from racecraft.cli.from_request import TerminalProgress
from racecraft.cli.metrics_server import measured
from racecraft.cli.signals import SIGTERM, TERMINATED, sigterm_interrupts

if TYPE_CHECKING:
    from racecraft.training.callbacks import TrainingCallback
    from racecraft.training.request import TrainRequest
    from racecraft.training.trainer import Distribute, Trained

OF_A_NEW_RUN = ("seed", "seeds", "algorithm", "set_", "from_", "keep")
"""Options of every training that a run keeps: at --resume they are refused, unless they say what it was begun with."""
Left = dict[str, Any]
"""What a training leaves for people, by kind: paths, and figures of its own; `--json` tells it with the summary."""


@dataclass(frozen=True)
class Road:
    """How a world's command trains: what it calls its runs, and what a run that goes on keeps.

    Attributes:
        kind: Of the world, as `training.worlds` names it.
        example: A run folder as this command makes it, for letters.
        keeps: Names of the command's options, in Python, that belong to a new run.
        kept_as: Of those that the run keeps otherwise than they are typed: the name there, and the whole value.
        folder: The user's own, where there is one.
        model: What the metrics call it; None: by the run.
        cluster: What --cluster said.
        beside: Wraps who watches, such as a page does.
        again: Fields of the request that a run does not keep: they are given anew when it goes on.
    """

    kind: str
    example: str
    keeps: tuple[str, ...]
    kept_as: Mapping[str, tuple[str, Any]] = field(default_factory=dict)
    folder: Path | None = None
    model: str | None = None
    cluster: str | None = None
    beside: Callable[[TrainingCallback], AbstractContextManager[TrainingCallback]] = nullcontext
    again: Mapping[str, Any] = field(default_factory=dict)

    def train(
        self,
        context: typer.Context,
        options: TrainingOptions,
        request: Callable[[], TrainRequest],
        told: Callable[[Trained, Left], None],
        json: bool = False,
    ) -> None:
        """Train, or go on, here or as a job, and say what came of it.

        Args:
            context: How the command was typed.
            options: What was asked.
            request: Makes the request of a new run; called for no other.
            told: Says to a person what came of it.
            json: Whether standard output belongs to one JSON object.

        Raises:
            UserInputError: Something that was asked for cannot be used.
        """
        from racecraft.actions.mirroring import mirrored, place_of_mirror
        from racecraft.actions.training import leave_pictures
        from racecraft.cli.jobs.detaching import detach_training
        from racecraft.cli.jobs.seeds import several_seeds, train_seeds
        from racecraft.cli.output import print_json
        from racecraft.jobs.tuning.dry_run import PLAN_ONLY
        from racecraft.training import worlds
        from racecraft.training.progress import watcher

        tell = TerminalProgress(quiet_stdout=json)
        if os.environ.get(PLAN_ONLY):
            worlds.plan(request())
            return
        if options.seeds is not None and not options.resume:
            return train_seeds(context, several_seeds(options, json, tell), request())
        spread = self._spread()
        begun = self._begun(context, options)
        place = place_of_mirror(options.mirror, self.folder, begun, tell)
        asked = None if begun is not None else request()
        shown = watcher(sys.stderr if json else sys.stdout)
        named = self.model if options.run is None else options.run.name
        shown = measured(shown, options.metrics_port, options.metrics_host, named, tell, options.detach)
        if options.detach:
            return detach_training(context, options.run, asked, self.cluster, json)
        with self.beside(shown) as watching:  # a page stays behind what is told
            with mirrored(watching, place, tell, begun) as mirroring:
                with sigterm_interrupts():
                    trained = self._carry_out(asked, begun, options, mirroring, spread, tell)
                if trained.summary()["stopped_by"] == SIGTERM:
                    tell(f"saved in {trained.run.path}; --resume goes on from there")
                    raise typer.Exit(TERMINATED)
                left = leave_pictures(trained, options.pictures, tell)
            if json:
                print_json({**trained.summary(), **left})
            else:
                told(trained, left)

    def _spread(self) -> Distribute | None:
        """Return what carries the worlds to a cluster; None without one, whose code is then not brought along."""
        if self.cluster is None:
            return None
        from racecraft.cluster.distribute import distribute

        return distribute(self.cluster)

    def _begun(self, context: typer.Context, options: TrainingOptions) -> Path | None:
        """Return the run that is gone on with; None: a new one."""
        from racecraft.cli.resuming import refuse_changes

        if not options.resume:
            return None
        return refuse_changes(context, options.run, (*self.keeps, *OF_A_NEW_RUN), self.example, self.kept_as)

    def _carry_out(
        self,
        request: TrainRequest | None,
        begun: Path | None,
        options: TrainingOptions,
        callback: TrainingCallback,
        spread: Distribute | None,
        tell: TerminalProgress,
    ) -> Trained:
        from racecraft.training import worlds

        if begun is not None:
            return worlds.resume(begun, options.stop, callback, tell, self.kind, spread, self.again)
        assert request is not None
        return worlds.train(request, callback, tell, spread)


def verdict(summary: Mapping[str, Any]) -> str:
    """Return the word before what a judged training came to: none where no score counts as solved.

    >>> verdict({"solved": False, "evaluation": {"threshold": 475.0}})
    'not solved, '
    >>> verdict({"solved": False, "evaluation": {"threshold": None}})
    ''
    """
    if summary["evaluation"]["threshold"] is None:
        return ""
    return "solved, " if summary["solved"] else "not solved, "
