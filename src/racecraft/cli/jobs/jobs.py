"""`racecraft jobs`: trainings that outlive the terminal they were begun in."""

from __future__ import annotations

import sys
import time
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from racecraft.cli.options import Json

if TYPE_CHECKING:
    from racecraft.jobs.job import Job

Name = Annotated[str, typer.Argument(metavar="JOB", help="A job's name; `racecraft jobs list` has them all.")]
WORDS = {"allow_interspersed_args": False, "ignore_unknown_options": True}
"""What follows the first word is the job's own."""

app = typer.Typer(help="Trainings that go on by themselves: run, watch, stop, resume.", no_args_is_help=True)


@app.callback()
def jobs() -> None:
    """Trainings that go on by themselves: run, watch, stop, resume."""


@app.command(context_settings=WORDS)
def run(
    words: Annotated[
        list[str], typer.Argument(metavar="SPEC.json | COMMAND…", help="A job file, or the words behind `racecraft`.")
    ],
    name: Annotated[str, typer.Option(help="Of the job; by default the next number.")] = "",
    cores: Annotated[int | None, typer.Option(min=0, help="Cores it takes; by default all of them.")] = None,
    memory: Annotated[int, typer.Option(min=0, help="MiB of memory it takes.")] = 1024,
    max_run: Annotated[int | None, typer.Option(min=1, help="Seconds it may train.")] = None,
    max_wait: Annotated[int | None, typer.Option(min=1, help="Seconds from now to its end, waiting included.")] = None,
    spot: Annotated[bool, typer.Option("--spot", help="Make room for other jobs, and go on after them.")] = False,
    json: Json = False,
) -> None:
    """Run a command as a job: it waits for cores, outlives the terminal, and goes on after a crash.

    Examples:

        racecraft jobs run --cores 1 gym train CartPole-v1 --stop score=475

        racecraft jobs run --spot --max-wait 7200 --name oval train my-car --track Oval_track

        racecraft jobs run run train-unity.py

        racecraft jobs run job_spec.json
    """
    from racecraft.cli.jobs.detaching import tell_submitted

    limits: dict[str, Any] = {
        "cores": cores,
        "memory_mib": memory,
        "max_run_seconds": max_run,
        "max_wait_seconds": max_wait,
        "use_spot_instances": spot,
    }
    if len(words) == 1 and words[0].endswith(".json"):
        job = _submit_file(Path(words[0]), name)
    else:
        job = _submit_words(tuple(words), name, limits)
    tell_submitted(job, json)


@app.command(name="list")
def list_(json: Json = False) -> None:
    """List all jobs, the oldest first.

    Example: racecraft jobs list
    """
    from racecraft.cli.output import print_json
    from racecraft.jobs.job_paths import JobPaths
    from racecraft.jobs.supervisor_start import ensure_supervisor

    home = JobPaths.of_user()
    found = home.store().jobs()
    if any(not job.ended for job in found):
        ensure_supervisor(home)
    if json:
        print_json({"jobs": [_told(job) for job in found]})
        return
    if not found:
        print("no jobs yet; `--detach` behind a training makes one")
        return
    width = max(len(job.name) for job in found)
    for job in found:
        spent = _clock(job.training_seconds(time.time()))
        print(f"{job.name:{width}}  {job.state:12}  {spent:>9}  {' '.join(job.spec.command)[:60]}")
        if job.reason and job.state not in ("Completed", "Training"):
            print(f"{'':{width}}  {job.reason}")


@app.command()
def show(name: Name, json: Json = False) -> None:
    """Show all that is known of a job.

    Example: racecraft jobs show gym-1
    """
    from racecraft.cli.output import print_json
    from racecraft.jobs.job_paths import JobPaths
    from racecraft.jobs.store import get

    home = JobPaths.of_user()
    job = get(home.store(), name)
    if json:
        print_json({**_told(job), "spec": job.spec.as_dictionary(), "log": str(home.log(name))})
        return
    print(f"{job.name}: {job.status} ({job.state}){': ' + job.reason if job.reason else ''}")
    print(f"  command  racecraft {' '.join(job.spec.command)}")
    print(f"  folder   {job.spec.folder}")
    print(f"  run      {job.spec.run or '-'}")
    print(f"  log      {home.log(name)}")
    times = f"{job.attempts} time{'s' * (job.attempts != 1)}"
    print(f"  started  {times}, {_clock(job.training_seconds(time.time()))} of work")
    for step in job.transitions:
        when = time.strftime("%Y-%m-%d %H:%M:%S", time.localtime(step.time))
        print(f"  {when}  {step.state:12}  {step.message}".rstrip())


@app.command()
def logs(
    name: Name, follow_: Annotated[bool, typer.Option("--follow", "-f", help="Until the job has ended.")] = False
) -> None:
    """Print what a job said.

    Example: racecraft jobs logs -f gym-1
    """
    from racecraft.jobs.follow import follow
    from racecraft.jobs.job_paths import JobPaths
    from racecraft.jobs.store import get

    home = JobPaths.of_user()
    store = home.store()
    get(store, name)
    for text in follow(home.log(name), lambda: not follow_ or get(store, name).ended):
        sys.stdout.write(text)
        sys.stdout.flush()


@app.command()
def stop(name: Name) -> None:
    """Ask a job to end; what it has learned until then stays, and `jobs resume` goes on from there.

    Example: racecraft jobs stop gym-1
    """
    from racecraft.jobs.job_paths import JobPaths
    from racecraft.jobs.submit import request_stop

    home = JobPaths.of_user()
    job = request_stop(home, home.store(), name)
    print(f"{name}: {job.state}")


@app.command()
def wait(
    name: Name,
    seconds: Annotated[float | None, typer.Option(min=0, help="No longer than that.")] = None,
    json: Json = False,
) -> None:
    """Wait until a job has ended; exit code 0 where it completed or was stopped, 1 where it failed.

    Example: racecraft jobs wait gym-1 && racecraft report runs/gym-1
    """
    from racecraft.cli.output import print_json
    from racecraft.jobs.job_paths import JobPaths
    from racecraft.jobs.submit import wait as wait_for

    home = JobPaths.of_user()
    job = wait_for(home, home.store(), name, seconds)
    if json:
        print_json(_told(job))
    else:
        print(f"{name}: {job.state}{': ' + job.reason if job.reason else ''}")
    raise typer.Exit(1 if job.status == "Failed" else 0)


@app.command()
def resume(
    name: Name, stop: Annotated[list[str] | None, typer.Option(help="New stop conditions, such as minutes=10.")] = None
) -> None:
    """Have a job that has ended go on from where it stands.

    Example: racecraft jobs resume gym-1 --stop minutes=10
    """
    from racecraft.jobs.job_paths import JobPaths
    from racecraft.jobs.submit import resume as resume_job

    home = JobPaths.of_user()
    job = resume_job(home, home.store(), name, tuple(stop or ()))
    print(f"{name}: {job.state}")


@app.command()
def delete(name: Name) -> None:
    """Forget a job that has ended, and its log; its run folder stays.

    Example: racecraft jobs delete gym-1
    """
    from racecraft.jobs.job_paths import JobPaths
    from racecraft.jobs.submit import delete as delete_job

    home = JobPaths.of_user()
    delete_job(home, home.store(), name)
    print(f"{name}: forgotten")


@app.command(hidden=True)
def enter(folder: Annotated[Path, typer.Argument(help="A job's own folder.")]) -> None:
    """Run an estimator's script in the rooms of its job; started by a supervisor."""
    from racecraft.cli.script_errors import told_as_python_would
    from racecraft.compat.shims import run_script
    from racecraft.sagemaker.container import entered

    with told_as_python_would(), entered(folder) as (script, arguments):
        run_script(script, arguments)


def _submit_file(path: Path, name: str) -> Job:
    from dataclasses import replace

    from racecraft.formats.job_spec import read_job_spec
    from racecraft.jobs.job_paths import JobPaths
    from racecraft.jobs.submit import submit, submit_numbered

    spec = read_job_spec(path)
    folder = path.absolute().parent / spec.folder
    spec = replace(spec, name=name or spec.name, folder=str(folder))
    home = JobPaths.of_user()
    if spec.name:
        return submit(home, spec)
    return submit_numbered(home, path.stem.replace("_", "-"), lambda name: replace(spec, name=name))


def _submit_words(words: tuple[str, ...], name: str, limits: dict[str, Any]) -> Job:
    from racecraft.cli.jobs.detaching import submit_training
    from racecraft.contract.errors import SettingError, nearest
    from racecraft.formats.job_spec import COMMANDS, JobSpec, commands_of_worlds
    from racecraft.jobs.job_paths import JobPaths
    from racecraft.jobs.submit import environment_here, submit, submit_numbered
    from racecraft.jobs.tuning.dry_run import require_can_begin

    commands = sorted(commands_of_worlds() | set(COMMANDS) - {"jobs"})
    if words[0] not in commands:
        known = nearest(words[0], commands)
        raise SettingError(
            "'{words}' cannot be a job. {known} Options of `jobs run` itself stand before it.",
            words=words[0],
            known=known,
        )
    behind = next((at + 1 for at, word in enumerate(words[:2]) if word == "train"), 0)
    if behind:
        rest, run = _without_run(words[behind:])
        again = "--resume" in rest
        rest = [word for word in rest if word not in ("--resume", "--detach")]
        if not again:
            require_can_begin((*words[:behind], *rest))
        return submit_training(words[:behind], rest, run, goes_on=again, name=name, **limits)
    if words[0] == "run":
        _require_script(words[1:])
    home, here = JobPaths.of_user(), str(Path.cwd())
    if name:
        return submit(home, JobSpec(words, name, folder=here, environment=environment_here(), **limits))
    return submit_numbered(
        home, words[0], lambda name: JobSpec(words, name, folder=here, environment=environment_here(), **limits)
    )


def _require_script(words: tuple[str, ...]) -> None:
    """Refuse to run later what is not there now."""
    from racecraft.contract.errors import InputFileError

    script = next((word for word in words if not word.startswith("-")), "")
    if not Path(script).is_file():
        raise InputFileError(script or "run", "there is no such file", "a Python script, or a notebook (.ipynb)")


def _without_run(words: tuple[str, ...]) -> tuple[list[str], Path | None]:
    """Return the words without --run, and what it named."""
    rest, run, left = [], None, iter(words)
    for word in left:
        if word == "--run":
            run = Path(next(left, "."))
        elif word.startswith("--run="):
            run = Path(word.removeprefix("--run="))
        else:
            rest.append(word)
    return rest, run


def _told(job: Job) -> dict[str, Any]:
    return {
        "name": job.name,
        "status": job.status,
        "secondary_status": job.state.value,
        "reason": job.reason,
        "command": list(job.spec.command),
        "run": str(job.spec.run_folder() or ""),
        "attempts": job.attempts,
        "created": job.created,
        "training_seconds": round(job.training_seconds(time.time()), 1),
        "transitions": [
            {"status": step.state.value, "time": step.time, "message": step.message} for step in job.transitions
        ],
    }


def _clock(seconds: float) -> str:
    """Return a time as people read it.

    >>> _clock(3725)
    '1:02:05'
    """
    minutes, rest = divmod(round(seconds), 60)
    return f"{minutes // 60}:{minutes % 60:02}:{rest:02}"
