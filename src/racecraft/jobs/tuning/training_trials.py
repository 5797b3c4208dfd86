"""A trial is a training command of ours with values of its own, run as a job. Begin with `TrainingTrials`."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from racecraft.contract.errors import SettingError, nearest
from racecraft.formats.job_spec import JobSpec
from racecraft.formats.run_folder import RunFolder
from racecraft.jobs.job import Job
from racecraft.jobs.job_paths import JobPaths
from racecraft.jobs.metrics import check_definitions, read_metrics
from racecraft.jobs.states import State
from racecraft.jobs.store import get
from racecraft.jobs.submit import environment_here, request_stop, submit_numbered
from racecraft.jobs.supervisor_start import ensure_supervisor
from racecraft.jobs.tuning.search import TrialStatus
from racecraft.jobs.tuning.space import as_text

TRIALS = "trials"
"""Folder of the runs, in that of the search."""
TUNING, TRIAL = "tuning", "trial"
"""What a job records: the folder of its search, and its trial's number there."""


@dataclass(frozen=True)
class Objective:
    """What is made large, or small.

    Raises:
        SettingError: A regular expression that is none, or takes no figure.
    """

    name: str = "evaluation_score"
    """A column of metrics.jsonl; or a regular expression over the log, its first group the figure."""
    maximise: bool = True
    take_last: bool = False
    """Whether the last figure counts; else the best one."""

    def __post_init__(self) -> None:
        if self.is_regex:
            check_definitions([{"Name": "objective", "Regex": self.name}])

    @property
    def is_regex(self) -> bool:
        """Whether it is read out of the log."""
        return "(" in self.name

    def so_far(self, figures: Sequence[tuple[int, float]]) -> tuple[tuple[int, float], ...]:
        """Return (iteration, figure) as (iteration, score so far)."""
        if self.take_last:
            return tuple(figures)
        better: Callable[[float, float], float] = max if self.maximise else min
        best, scores = None, []
        for iteration, figure in figures:
            best = figure if best is None else better(best, figure)
            scores.append((iteration, best))
        return tuple(scores)


class TrainingTrials:
    """Begins trials: a launcher for `search`.

    Args:
        folder: Of the search.
        words: The command behind `racecraft`: ("gym", "train", "CartPole-v1", "--stop=minutes=1").
        objective: What counts.
        cores: That each trial takes.
        home: Where the jobs lie.
    """

    def __init__(self, folder: Path, words: Sequence[str], objective: Objective, cores: int, home: JobPaths) -> None:
        self._folder, self._words, self._objective = folder, tuple(words), objective
        self._cores, self._home = cores, home

    def __call__(self, number: int, values: Mapping[str, Any]) -> TrainingTrial:
        """Begin a trial."""
        place = self._folder / TRIALS / str(number)
        sets = tuple(f"--set={name}={as_text(value)}" for name, value in values.items())
        verb, rest = split_verb(self._words)

        def spec(name: str) -> JobSpec:
            return JobSpec(
                command=(*verb, *sets, f"--run={place}", *rest),
                name=name,
                resume=(*verb, f"--run={place}", "--resume", *(word for word in rest if word.startswith("--stop"))),
                run=str(place),
                folder=str(Path.cwd()),
                environment=environment_here(),
                cores=self._cores,
                recorded={TUNING: str(self._folder.absolute()), TRIAL: number, "values": dict(values)},
            )

        job = submit_numbered(self._home, f"{legal_name(self._folder.name)}-{number}", spec)
        return TrainingTrial(job.name, place, self._objective, self._home)

    def find(self, number: int) -> TrainingTrial | None:
        """Return the training of a trial that an earlier process of this search started; None: there is none."""
        store = self._home.store()
        try:
            jobs = store.jobs()
        finally:
            store.close()
        mine = {TUNING: str(self._folder.absolute()), TRIAL: number}
        for job in reversed(jobs):
            if mine.items() <= job.spec.recorded.items():
                if not job.ended:
                    ensure_supervisor(self._home)  # that process may have been killed before it started one
                return TrainingTrial(job.name, self._folder / TRIALS / str(number), self._objective, self._home)
        return None


class TrainingTrial:
    """One training under way."""

    def __init__(self, name: str, place: Path, objective: Objective, home: JobPaths) -> None:
        self.name, self.place = name, place
        self._objective, self._home = objective, home

    def poll(self) -> TrialStatus:
        """Tell how it stands.

        Raises:
            SettingError: There is no such column.
        """
        store = self._home.store()
        try:
            job = get(store, self.name)
        finally:
            store.close()
        return TrialStatus(self._objective.so_far(self._figures()), job.ended, _failure(job))

    def stop(self) -> None:
        """Ask it to end."""
        store = self._home.store()
        try:
            request_stop(self._home, store, self.name)
        finally:
            store.close()

    def _figures(self) -> list[tuple[int, float]]:
        if self._objective.is_regex:
            definition = {"Name": "objective", "Regex": self._objective.name}
            points = read_metrics(self._home.log(self.name), self._home.log_times(self.name), [definition])
            return [(at, point.value) for at, point in enumerate(points, 1)]
        return column_of(RunFolder(self.place), self._objective.name)


def column_of(run: RunFolder, name: str) -> list[tuple[int, float]]:
    """Return (iteration, value) of every line of a run's metrics that has one; a line under way is left for later.

    Raises:
        SettingError: The lines have no such column.
        RunFolderError: A line is damaged, or the file cannot be read.
    """
    found = []
    for row in run.read_metrics():
        if name not in row:
            figures = [column for column, value in row.items() if isinstance(value, int | float | None)]
            hint = nearest(name, figures)
            hint = f" {hint}" if hint.startswith("Did") else ""  # otherwise it names them all, as is done here
            raise SettingError(
                "--objective {name}: expected one of {figures}.{hint}", name=name, figures=", ".join(figures), hint=hint
            )
        if isinstance(row[name], int | float) and math.isfinite(row[name]):
            found.append((int(row["iteration"]), float(row[name])))
    return found


def check_command(words: Sequence[str]) -> tuple[str, ...]:
    """Return the words of a training command.

    Raises:
        SettingError: They train nothing, or say what every trial is told by itself.
    """
    words = _joined(words)
    verb, rest = split_verb(words)
    if verb[-1] != "train":
        raise SettingError(
            "'{words}' trains nothing; expected a training command, such as gym train Pendulum-v1.",
            words=" ".join(words),
        )
    for taken in ("--run", "--resume", "--detach"):
        if any(word.partition("=")[0] == taken for word in rest):
            raise SettingError("{taken}: every trial has a run of its own; expected it left out.", taken=taken)
    if not any(word.partition("=")[0] == "--stop" for word in rest):
        raise SettingError(
            "the command has no --stop; expected one, such as --stop minutes=2, so that every trial ends alike."
        )
    return tuple(words)


def _joined(words: Sequence[str]) -> list[str]:
    """Return the words with every --stop and its condition in one."""
    joined: list[str] = []
    for word in words:
        if joined and joined[-1] == "--stop":
            joined[-1] = f"--stop={word}"
        else:
            joined.append(word)
    return joined


def split_verb(words: Sequence[str]) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Return the words up to "train", and those behind it.

    >>> split_verb(("gym", "train", "CartPole-v1"))
    (('gym', 'train'), ('CartPole-v1',))
    """
    cut = 1 if words[0] == "train" else 2
    return tuple(words[:cut]), tuple(words[cut:])


def _failure(job: Job) -> str:
    return job.reason.strip() or "it failed" if job.ended and job.state is State.FAILED else ""


def legal_name(name: str) -> str:
    """Return what of a folder's name may stand in a job's, 40 letters at most."""
    return re.sub(r"[^A-Za-z0-9]+", "-", name).strip("-")[:40] or "tuning"
