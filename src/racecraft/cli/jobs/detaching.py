"""`--detach`, for every command that trains: the training goes on as a job, and the terminal is free."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from racecraft.actions.submit_job import Submitted, submit_training

if TYPE_CHECKING:
    from racecraft.training.request import TrainRequest

NOT_FOR_THE_JOB = ("detach", "resume", "run", "json")
"""Parameters of a training command that its job is not told, or told otherwise."""


def detach_training(
    context: typer.Context, run: Path | None, request: TrainRequest | None, cluster: str | None, json: bool
) -> None:
    """Begin a training, or go on with one, as a job; say how to look after it.

    Args:
        context: How the command was typed.
        run: What --run named.
        request: What is to be trained, read and checked here so that a letter comes now; None: `run` goes on.
        cluster: What --cluster named; Ray is then asked for here, too.
        json: Whether standard output belongs to one JSON object.

    Raises:
        UserInputError: Whatever was asked for and cannot be used.
    """
    from racecraft.cli.output import print_json
    from racecraft.training import worlds

    verb = verb_of(context)
    words = typed_words(context, NOT_FOR_THE_JOB)
    if request is not None:
        worlds.plan(request)
    if cluster is not None:
        from racecraft.cluster.ray_transport import imported_ray

        imported_ray()
    job = submit_training(verb, words, run, goes_on=request is None)
    submitted = Submitted(job)
    print_json(submitted) if json else show_submitted(submitted)


def show_submitted(submitted: Submitted) -> None:
    """Say that a job is on its way, and what can be done with it."""
    job = submitted.job
    where = f", run {job.spec.run}" if job.spec.run else ""
    print(f"job {job.name} goes on by itself{where}; this terminal may be closed")
    print(f"  racecraft jobs logs -f {job.name}     # watch it")
    print(f"  racecraft jobs stop {job.name}        # end it; `jobs resume` goes on later")


def verb_of(context: typer.Context) -> tuple[str, ...]:
    """Return a command's words behind `racecraft`, such as ("gym", "train")."""
    parent = context.parent
    return () if parent is None else (*verb_of(parent), str(context.info_name))  # type: ignore[arg-type]


def typed_words(context: typer.Context, leave_out: Sequence[str]) -> tuple[str, ...]:
    """Return what was typed behind a command, said again: options first, arguments behind them."""
    options: list[str] = []
    arguments: list[str] = []
    for part in context.command.params:
        source = context.get_parameter_source(str(part.name))
        if part.name in leave_out or source is None or source.name != "COMMANDLINE":
            continue
        value = context.params[str(part.name)]
        values = value if isinstance(value, list | tuple) else [value]
        if part.param_type_name == "argument":
            arguments += [str(one) for one in values]
        elif isinstance(value, bool):
            options.append(part.opts[0] if value else part.secondary_opts[0])
        else:
            long = next(name for name in part.opts if name.startswith("--"))
            options += [f"{long}={one}" for one in values]
    return (*options, *arguments)
