"""The same training with several seeds, each a run of its own, judged together. Begin with `train_seeds`."""

from __future__ import annotations

import os
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from racecraft.actions.compare import Comparison, compare
from racecraft.actions.submit_job import Submitted, submit_training
from racecraft.actions.training_options import TrainingOptions
from racecraft.contract.errors import SettingError
from racecraft.contract.progress import Progress
from racecraft.formats.run_group import RunGroup

PAGE = "seeds.html"
"""The page of a group, in its folder."""
NOT_FOR_A_SEED = ("seeds", "seed", "run", "detach", "resume", "watch")
"""Options of a training that a seed is not given, or otherwise."""


@dataclass(frozen=True)
class TrainedSeeds:
    """Runs that differ in their seed alone, and how they compare; or the jobs that train them."""

    group: RunGroup
    comparison: Comparison | None
    """None: jobs are at it."""
    jobs: tuple[Submitted, ...] = ()
    exit_code: int = 0
    """That of the seed whose training failed, after which none was trained."""

    def as_dictionary(self) -> dict[str, Any]:
        """Return the group's folder, its runs, and their comparison or jobs."""
        facts: dict[str, Any] = {"group": str(self.group.path), "runs": [str(run) for run in self.group.runs]}
        if self.jobs:
            facts["jobs"] = [job.as_dictionary() for job in self.jobs]
        return facts if self.comparison is None else {**facts, **vars(self.comparison)}


def train_seeds(options: TrainingOptions, progress: Progress) -> TrainedSeeds:
    """Train seeds one after another, or as jobs, into the folder of a group.

    Args:
        options: What is trained; the first seed's is read and checked before anything is trained.
        progress: Receives messages.

    Raises:
        SettingError: A group or another folder stands at `run`, or `mirror` is given.
    """
    from racecraft.training import worlds

    if options.mirror is not None:
        raise SettingError("--mirror has one place for one run; expected it left out with --seeds.")
    worlds.plan(options.request(progress))
    first = 1 if options.seed is None else options.seed
    seeds = tuple(range(first, first + (options.seeds or 1)))
    group = RunGroup(_free_folder(options.run), (*options.verb, *options.args(NOT_FOR_A_SEED)), seeds)
    group.write()
    progress(f"{group.path}: seeds {seeds[0]} to {seeds[-1]}")
    if options.detach:
        return TrainedSeeds(group, None, tuple(_submit(group, options, seed) for seed in seeds))
    for seed in seeds:
        if code := _train(group, seed, progress):
            progress(f"seed {seed} ended with exit code {code}; the seeds before it lie in {group.path}")
            return TrainedSeeds(group, None, exit_code=code)
    page = group.path / PAGE if options.pictures else None
    return TrainedSeeds(group, compare(str(group.path), page=page, progress=progress))


def _submit(group: RunGroup, options: TrainingOptions, seed: int) -> Submitted:
    words = (*group.command[len(options.verb) :], f"--seed={seed}")
    return Submitted(submit_training(options.verb, words, group.run_of(seed)))


def _train(group: RunGroup, seed: int, progress: Progress) -> int:
    """Train one seed in a process of its own; return its exit code."""
    progress(f"seed {seed}")
    words = (*group.command, f"--seed={seed}", f"--run={group.run_of(seed)}")
    command = [sys.executable, "-m", "racecraft", *words]
    return subprocess.run(command, stdout=progress.child_output, check=False, env=dict(os.environ)).returncode


def _free_folder(run: Path | None) -> Path:
    """Return the folder of a new group: the one that was named, or the next number under runs/.

    Raises:
        SettingError: Something stands there.
    """
    if run is not None:
        if run.exists() and (not run.is_dir() or any(run.iterdir())):
            raise SettingError(
                "--run {run}: found a folder in use; expected a new one for the group of seeds.", run=run
            )
        return run
    number = 1
    while Path("runs", f"seeds-{number}").exists():
        number += 1
    return Path("runs", f"seeds-{number}")
