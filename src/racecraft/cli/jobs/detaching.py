"""`--detach`, for every command that trains: the training goes on as a job, and the terminal is free."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

if TYPE_CHECKING:
    from racecraft.jobs.job import Job
    from racecraft.training.request import TrainRequest

NOT_FOR_THE_JOB = ("detach", "resume", "run", "json")
"""Parameters of a training command that its job is not told, or told otherwise."""
KEPT_ON_RESUME = ("--stop", "--cluster")
"""Options of a training that it is told again when it goes on, each with a value."""
FLAGS_ON_RESUME = ("--pictures", "--no-pictures")
"""Those without."""


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
    from racecraft.training import worlds

    verb = verb_of(context)
    words = typed_words(context, NOT_FOR_THE_JOB)
    if request is not None:
        worlds.plan(request)
    if cluster is not None:
        from racecraft.cluster.ray_transport import imported_ray

        imported_ray()
    job = submit_training(verb, words, run, goes_on=request is None)
    tell_submitted(job, json)


def submit_training(
    verb: tuple[str, ...], words: Sequence[str], run: Path | None, goes_on: bool = False, **more: Any
) -> Job:
    """Put a training into the store.

    Args:
        verb: ("gym", "train").
        words: Its arguments and options, --run left out.
        run: The run folder; None: runs/ and the job's name.
        goes_on: Whether the run is there, and is gone on with.
        more: Further fields of `JobSpec`.

    Raises:
        RunFolderError: A run stands there already, or none where one should.
    """
    from racecraft.contract.errors import RunFolderError
    from racecraft.formats.job_spec import JobSpec
    from racecraft.formats.run_folder import JOB, RunFolder
    from racecraft.jobs.job_paths import JobPaths
    from racecraft.jobs.submit import environment_here, submit, submit_numbered

    name = more.pop("name", "")
    if goes_on and run is not None:
        RunFolder.open(run)
    elif run is not None and (run / JOB).exists():
        raise RunFolderError(
            "{run}: a run stands here already; expected a new place. Give another, or --resume.", run=run
        )

    def spec(name: str) -> JobSpec | None:
        place = run or Path("runs", name)
        if run is None and place.exists():
            return None
        at = f"--run={place}"
        again = (*verb, at, "--resume", *told_again(words))
        return JobSpec(
            command=again if goes_on else (*verb, *words, at),
            name=name,
            resume=again,
            run=str(place),
            folder=str(Path.cwd()),
            environment=environment_here(),
            **more,
        )

    home = JobPaths.of_user()
    if name and (made := spec(name)) is not None:
        return submit(home, made)
    return submit_numbered(home, name or ("-".join(verb[:-1]) or "car"), spec)


def told_again(words: Sequence[str]) -> list[str]:
    """Return what a training that goes on is told of its words, values joined to their options or behind them.

    >>> told_again(["CartPole-v1", "--stop", "score=475", "--seed", "2", "--stop=minutes=9", "--no-pictures"])
    ['--stop=score=475', '--stop=minutes=9', '--no-pictures']
    """
    told, left = [], iter(words)
    for word in left:
        if word in KEPT_ON_RESUME:
            told.append(f"{word}={next(left, '')}")
        elif word.partition("=")[0] in KEPT_ON_RESUME or word in FLAGS_ON_RESUME:
            told.append(word)
    return told


def tell_submitted(job: Job, json: bool) -> None:
    """Say that a job is on its way, and what can be done with it."""
    from racecraft.cli.output import print_json

    if json:
        print_json({"job": job.name, "run": str(job.spec.run_folder() or ""), "status": job.status})
        return
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
