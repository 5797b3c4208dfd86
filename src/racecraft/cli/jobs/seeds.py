"""`train --seeds N`: the same training with N seeds, each a run of its own, judged together. See `train_seeds`."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from racecraft.contract.errors import SettingError

if TYPE_CHECKING:
    from racecraft.actions.training_options import TrainingOptions
    from racecraft.formats.run_group import RunGroup
    from racecraft.training.request import TrainRequest

STDERR = 2
PAGE = "seeds.html"
"""The page of a group, in its folder."""
NOT_FOR_A_SEED = ("seeds", "seed", "run", "detach", "resume", "json", "watch")
"""Parameters of a training command that a seed is not told, or told otherwise."""


@dataclass(frozen=True)
class SeedRequest:
    """Which seeds are trained, and how."""

    seeds: tuple[int, ...]
    run: Path | None
    """Folder of the group; None: the next number under runs/."""
    detach: bool
    """Whether each is a job."""
    json: bool
    """Whether standard output belongs to one JSON object."""
    pictures: bool
    """Whether a page of all seeds is left in the folder."""
    tell: Callable[[str], None]
    """Says a line to a person."""


def several_seeds(options: TrainingOptions, json: bool, tell: Callable[[str], None]) -> SeedRequest:
    """Return what `--seeds` asks for.

    Raises:
        SettingError: --mirror was given.
    """
    if options.mirror is not None:
        raise SettingError("--mirror has one place for one run; expected it left out with --seeds.")
    first, count = options.seed if options.seed is not None else 1, options.seeds or 1
    seeds = tuple(range(first, first + count))
    return SeedRequest(seeds, options.run, options.detach, json, options.pictures, tell)


def train_seeds(context: typer.Context, asked: SeedRequest, request: TrainRequest) -> None:
    """Train seeds one after another, or as jobs, into the folder of a group.

    Args:
        context: How the command was typed.
        asked: Which seeds, and how.
        request: Of the first one, so that whatever cannot be used is said before anything is trained.

    Raises:
        SettingError: A group or another folder stands at --run.
    """
    from racecraft.actions.submit_job import Submitted, submit_training
    from racecraft.cli.jobs.detaching import show_submitted, typed_words, verb_of
    from racecraft.cli.output import print_json
    from racecraft.formats.run_group import RunGroup
    from racecraft.training import worlds

    worlds.plan(request)
    verb, words = verb_of(context), typed_words(context, NOT_FOR_A_SEED)
    place = _free_folder(asked.run)
    group = RunGroup(place, (*verb, *words), asked.seeds)
    group.write()
    asked.tell(f"{place}: seeds {asked.seeds[0]} to {asked.seeds[-1]}")
    if asked.detach:
        for seed in group.seeds:
            submitted = Submitted(submit_training(verb, (*words, f"--seed={seed}"), group.run_of(seed)))
            print_json(submitted) if asked.json else show_submitted(submitted)
        return
    for seed in group.seeds:
        _train(group, seed, asked)
    found = _report(group, asked)
    if asked.json:
        print_json(found)


def _train(group: RunGroup, seed: int, asked: SeedRequest) -> None:
    """Train one seed in a process of its own; its standard output joins standard error where ours is for JSON."""
    asked.tell(f"seed {seed}")
    told = (*group.command, f"--seed={seed}", f"--run={group.run_of(seed)}")
    out = STDERR if asked.json else None
    done = subprocess.run([sys.executable, "-m", "racecraft", *told], stdout=out, check=False, env=dict(os.environ))
    if done.returncode:
        asked.tell(f"seed {seed} ended with exit code {done.returncode}; the seeds before it lie in {group.path}")
        raise typer.Exit(done.returncode)


def _report(group: RunGroup, asked: SeedRequest) -> dict[str, object]:
    """Judge the seeds on fresh starts, and say what they came to."""
    from racecraft.actions.compare import compare
    from racecraft.cli.runs.compare import show

    page = group.path / PAGE if asked.pictures else None
    compared = compare(str(group.path), page=page, progress=asked.tell)
    if not asked.json:
        show(compared)
    return {"group": str(group.path), "runs": [str(run) for run in group.runs], **asdict(compared)}


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
