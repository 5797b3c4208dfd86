"""Which installation a dr- command is about, and how its jobs are shown."""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from racecraft.cli.from_request import TerminalProgress
from racecraft.contract.errors import UserInputError
from racecraft.worlds.deepracer.actions.drfc.jobs import opened
from racecraft.worlds.deepracer.files.drfc_folder import DrfcFolder

if TYPE_CHECKING:
    from racecraft.jobs.job import Job

SHOWN = TerminalProgress(quiet_stdout=False)
"""Prints the messages of dr- commands on standard output, as DeepRacer for Cloud does."""


def installation(context: typer.Context) -> DrfcFolder:
    """Return the installation, its settings read anew, what the shell says laid over them.

    Raises:
        UserInputError: There is none, or its files cannot be used.
    """
    return opened(context.obj)


def say_notes(drfc: DrfcFolder) -> None:
    """Say what was noticed while reading."""
    for note in drfc.notes:
        print(f"- {note}")


def follow_job(job: Job) -> None:
    """Print what a job says until it has ended; Ctrl-C ends the printing and not the job."""
    from racecraft.jobs.job_paths import JobPaths
    from racecraft.jobs.store import get

    home = JobPaths.of_user()
    store = home.store()
    follow_file(home.log(job.name), lambda: get(store, job.name).ended, job.name)


def follow_file(path: Path, ended: Callable[[], bool], name: str) -> None:
    """Print a file as it grows; Ctrl-C ends the printing."""
    from racecraft.jobs.follow import follow

    try:
        for text in follow(path, ended):
            print(text, end="", flush=True)
    except KeyboardInterrupt:
        print(f"\n{name} goes on by itself.")


def ask_first(question: str, force: bool) -> None:
    """Ask before something is changed, unless it was said to be done anyway.

    Raises:
        UserInputError: Nobody is there to answer.
        Abort: The answer is no.
    """
    if force:
        return
    if not sys.stdin.isatty():
        raise UserInputError(
            "{question} Nobody is here to answer; expected -f where no question shall be asked.", question=question
        )
    typer.confirm(question, abort=True)
