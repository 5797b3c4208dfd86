"""What a report tells of, read once from a run folder. Begin with `read_facts`."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

from racecraft.contract.errors import UserInputError
from racecraft.contract.kind import WorldKind
from racecraft.contract.kinds import find_kind
from racecraft.formats.checkpoint import Checkpoints
from racecraft.formats.json_text import parse_json
from racecraft.formats.run_folder import RunFolder
from racecraft.formats.user_file import read_regular


class ReportError(UserInputError):
    """A report cannot be written of what the folder holds."""


@dataclass(frozen=True)
class WorldFacts:
    """What a world adds to the first words of a report; the defaults add nothing."""

    title: str = ""
    """The headline; "": the run's own title."""
    verb: str = "play"
    """What was asked of the agent: "to play CartPole-v1"."""
    tiles: tuple[tuple[str, str], ...] = ()
    """Figures behind the score: (number with unit, what it is)."""
    asked: tuple[str, ...] = ()
    """Sentences about the agent: what it saw and could do, what it was paid for."""
    happened: tuple[str, ...] = ()
    """Sentences behind the scores of a training that was judged."""


@dataclass(frozen=True)
class RunFacts:
    """What a run folder tells, read once."""

    run: RunFolder
    kind: WorldKind
    job: dict[str, Any]
    metrics: list[dict[str, Any]]
    evaluations: list[dict[str, Any]]
    best: int | None = None
    """Iteration of the best checkpoint, once one was evaluated."""
    world: WorldFacts = WorldFacts()

    @property
    def name(self) -> str:
        """The name of the run's folder."""
        return self.run.path.resolve().name

    @property
    def best_row(self) -> dict[str, Any]:
        """The metrics of the best checkpoint's iteration; empty before any was evaluated."""
        return next((row for row in self.metrics if row.get("iteration") == self.best), {})

    @property
    def title(self) -> str:
        """The headline: what was trained, or the run's name."""
        return self.world.title or str(self.job.get("title", self.name))


def read_facts(run: RunFolder) -> RunFacts:
    """Read what a report tells of.

    Raises:
        MissingWorldError: The run's kind of world is not installed.
        ReportError: An evaluation is damaged.
        RunFolderError: Another file is damaged.
    """
    job = run.read_job()
    facts = RunFacts(
        run=run,
        kind=find_kind(str(job.get("kind")), str(run.path)),
        job=job,
        metrics=run.read_metrics(),
        evaluations=list(_read_evaluations(run)),
        best=_best_of(run),
    )
    of_world = facts.kind.piece("facts")
    return replace(facts, world=of_world(facts)) if of_world else facts


def _best_of(run: RunFolder) -> int | None:
    """Return the iteration of the checkpoint that the run calls best; None before any was evaluated."""
    checkpoints = Checkpoints(run.checkpoints)
    if not any(entry.score is not None for entry in checkpoints.entries()):
        return None
    return checkpoints.find("best").iteration


def _read_evaluations(run: RunFolder) -> Iterator[dict[str, Any]]:
    """Yield the evaluations by iteration."""
    paths = [path for path in run.evaluations.glob("*.json") if path.stem.isdigit()]
    for path in sorted(paths, key=lambda one: int(one.stem)):
        try:
            evaluation = parse_json(read_regular(path))
        except (OSError, ValueError) as error:
            raise ReportError(
                "{path}: cannot be read ({error}); expected an evaluation. Take the file out.", path=path, error=error
            ) from error
        if isinstance(evaluation, dict):
            yield {"iteration": int(path.stem), **evaluation}
