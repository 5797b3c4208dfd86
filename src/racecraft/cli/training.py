"""What every command that trains asks alike, and the road it takes. Begin with `TrainingOptions`, then `Road`.

A command brings the words of its world: which options say what is trained, the request they make, what is left in the
run folder in the end, and what is told of it. Everything between is the same: a new run or an old one, a job or this
terminal, buckets, metrics, workers.
"""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Mapping
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from racecraft.cli.buckets.training import MirrorAt
from racecraft.cli.metrics_server import MetricsHost, MetricsPort, measured
from racecraft.cli.options import AlgorithmName, Detach, From, Json, Overrides, Resume
from racecraft.cli.signals import SIGTERM, TERMINATED, sigterm_interrupts

if TYPE_CHECKING:
    from racecraft.cli.jobs.seeds import SeedRequest
    from racecraft.training.callbacks import TrainingCallback
    from racecraft.training.request import TrainRequest
    from racecraft.training.trainer import Spread, Trained

OF_A_NEW_RUN = ("seed", "seeds", "algorithm", "set_", "from_", "keep")
"""Options of every training that a run keeps: at --resume they are refused, unless they say what it was begun with."""
Left = dict[str, Any]
"""What a training leaves for people, by kind: paths, and figures of its own; `--json` tells it with the summary."""


@dataclass(frozen=True)
class TrainingOptions:
    """What every training is asked alike; a world says in its own words what stops it and where its run lies."""

    stop: Annotated[
        list[str] | None, typer.Option(help="minutes=10, iterations=50, steps=200000; may be repeated.")
    ] = None
    run: Annotated[Path | None, typer.Option(help="Run folder to make.")] = None
    seed: Annotated[int | None, typer.Option(min=0, help="Same seed, same machine, same training.")] = 1
    seeds: Annotated[
        int | None,
        typer.Option(
            min=2,
            max=100,
            help="Train so many seeds one after another, from --seed on, each into a run of its own below --run, and "
            "judge them on fresh starts; with --detach each is a job. `racecraft compare` takes the folder.",
        ),
    ] = None
    algorithm: AlgorithmName = None
    """None: what the user's own files ask for, else ppo."""
    set_: Overrides = None
    from_: From = None
    resume: Resume = False
    detach: Detach = False
    keep: Annotated[
        str | None,
        typer.Option(help="Checkpoints that stay: all, or best,last,N (N more, spread out).", metavar="KEPT"),
    ] = None
    mirror: MirrorAt = None
    pictures: Annotated[bool, typer.Option(help="Leave a report with its curves in the run folder.")] = True
    metrics_port: MetricsPort = None
    metrics_host: MetricsHost = "127.0.0.1"
    json: Json = False

    @property
    def stops(self) -> tuple[str, ...]:
        """The stop conditions, as typed."""
        return tuple(self.stop or ())

    @property
    def overrides(self) -> tuple[str, ...]:
        """The settings, as typed, and those that options of their own stand for."""
        from racecraft.training.settings import keep_override

        return (*(self.set_ or ()), *(() if self.keep is None else (keep_override(self.keep),)))

    def tell(self, text: str) -> None:
        """Say a line to a person."""
        from racecraft.cli.output import say

        say(text, quiet_stdout=self.json)

    def source(self, folder: Path | None = None) -> str | None:
        """Return the run whose weights are begun with, fetched where it is named by an address."""
        from racecraft.cli.buckets.training import fetch_run

        return None if self.from_ is None else fetch_run(self.from_, self.tell, folder)

    def asked(self, source: str | None) -> dict[str, Any]:
        """Return all this as keywords of a `TrainRequest`."""
        return {
            "algorithm": self.algorithm,
            "stops": self.stops,
            "run": self.run,
            "seed": self.seed,
            "overrides": self.overrides,
            "clone_from": source,
        }

    def several_seeds(self, count: int) -> SeedRequest:
        """Return what `--seeds` asks for.

        Raises:
            SettingError: --mirror was given.
        """
        from racecraft.cli.jobs.seeds import SeedRequest
        from racecraft.contract.errors import SettingError

        if self.mirror is not None:
            raise SettingError("--mirror has one place for one run; expected it left out with --seeds.")
        first = self.seed if self.seed is not None else 1
        return SeedRequest(
            tuple(range(first, first + count)), self.run, self.detach, self.json, self.pictures, self.tell
        )

    def leave_report(self, trained: Trained) -> Left:
        """Leave the run's page in its folder, where that is wanted."""
        from racecraft.cli.runs.report import leave_report

        return dict(leave_report(trained.run.path, self.tell)) if self.pictures else {}


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
        leave: Callable[[Trained], Left] | None = None,
    ) -> None:
        """Train, or go on, here or as a job, and say what came of it.

        Args:
            context: How the command was typed.
            options: What was asked.
            request: Makes the request of a new run; called for no other.
            told: Says to a person what came of it.
            leave: Lays pictures and pages into the run folder when it is trained; None: the run's report, if wanted.

        Raises:
            UserInputError: Whatever was asked for and cannot be used, as a letter.
        """
        from racecraft.cli.buckets.training import mirrored, place_of_mirror
        from racecraft.cli.jobs.detaching import detach_training
        from racecraft.cli.jobs.seeds import train_seeds
        from racecraft.cli.output import print_json
        from racecraft.jobs.tuning.dry_run import PLAN_ONLY
        from racecraft.training import worlds
        from racecraft.training.progress import watcher

        if os.environ.get(PLAN_ONLY):
            worlds.plan(request())
            return
        if options.seeds is not None and not options.resume:
            return train_seeds(context, options.several_seeds(options.seeds), request())
        spread = self._spread()
        begun = self._begun(context, options)
        place = place_of_mirror(options.mirror, self.folder, begun, options.tell)
        asked = None if begun is not None else request()
        shown = watcher(sys.stderr if options.json else sys.stdout)
        named = self.model if options.run is None else options.run.name
        shown = measured(shown, options.metrics_port, options.metrics_host, named, options.tell, options.detach)
        if options.detach:
            return detach_training(context, options.run, asked, self.cluster, options.json)
        with self.beside(shown) as watching:  # a page stays behind what is told
            with mirrored(watching, place, options.tell, begun) as mirroring:
                with sigterm_interrupts():
                    trained = self._carry_out(asked, begun, options, mirroring, spread)
                if trained.summary()["stopped_by"] == SIGTERM:
                    options.tell(f"saved in {trained.run.path}; --resume goes on from there")
                    raise typer.Exit(TERMINATED)
                left = (leave or options.leave_report)(trained)
            if options.json:
                print_json({**trained.summary(), **left})
            else:
                told(trained, left)

    def _spread(self) -> Spread | None:
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
        spread: Spread | None,
    ) -> Trained:
        from racecraft.training import worlds

        if begun is not None:
            return worlds.resume(begun, options.stops, callback, options.tell, self.kind, spread, self.again)
        assert request is not None
        return worlds.train(request, callback, options.tell, spread)


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
