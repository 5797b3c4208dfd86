"""Put a command into the queue of jobs. Begin with `run_job`, then `submit_training`."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from racecraft.actions.action import action
from racecraft.contract.progress import Progress, quiet
from racecraft.settings.request import Request, argument, option

if TYPE_CHECKING:
    from racecraft.actions.training_options import TrainingOptions
    from racecraft.jobs.job import Job

KEPT_ON_RESUME = ("--stop", "--cluster", "--notify")
"""Options of a training that it is told again when it goes on, each with a value."""
FLAGS_ON_RESUME = ("--pictures", "--no-pictures")
"""Those without."""


@dataclass(frozen=True, kw_only=True)
class RunJobRequest(Request):
    """Which command becomes a job, and what it may use."""

    words: tuple[str, ...] = argument("A job file, or the words behind `racecraft`.", metavar="SPEC.json | COMMAND…")
    name: str = option("", "Of the job; by default the next number.")
    cores: int | None = option(None, "Cores it takes; by default all of them, of serve and tune none.", low=0)
    memory: int = option(1024, "MiB of memory it takes.", low=0)
    max_run: int | None = option(None, "Seconds it may train.", low=1)
    max_wait: int | None = option(None, "Seconds from now to its end, waiting included.", low=1)
    spot: bool = option(False, "Make room for other jobs, and go on after them.")


@dataclass(frozen=True)
class Submitted:
    """A job that is on its way."""

    job: Job

    def as_dictionary(self) -> dict[str, Any]:
        """Return its name, run folder and status."""
        run = str(self.job.spec.run_folder() or "")
        return {"job": self.job.name, "run": run, "status": self.job.status}


@action
def run_job(request: RunJobRequest, progress: Progress = quiet) -> Submitted:
    """Run a command as a job: it waits for cores, outlives the terminal, and goes on after a crash.

    Examples:

        racecraft jobs run --cores 1 gym train CartPole-v1 --stop score=475

        racecraft jobs run --spot --max-wait 7200 --name oval train my-car --track Oval_track

        racecraft jobs run run train-unity.py

        racecraft jobs run job_spec.json
    """
    limits: dict[str, Any] = {
        "cores": request.cores,
        "memory_mib": request.memory,
        "max_run_seconds": request.max_run,
        "max_wait_seconds": request.max_wait,
        "use_spot_instances": request.spot,
    }
    if len(request.words) == 1 and request.words[0].endswith(".json"):
        job = _submit_file(Path(request.words[0]), request.name)
    else:
        job = _submit_words(request.words, request.name, limits)
    return Submitted(job)


NOT_FOR_A_JOB = ("detach", "resume", "run")
"""Options of a training that its job is not given, or otherwise."""


def submit_options(options: TrainingOptions, progress: Progress) -> Submitted:
    """Put a training, or a run that is resumed, into the queue.

    Args:
        options: What is trained: it is read and checked here, so that errors come now.
        progress: Receives messages.

    Raises:
        UserInputError: Something given cannot be used.
    """
    from racecraft.actions.metrics import refuse_metrics
    from racecraft.training import worlds

    refuse_metrics(options)
    if not options.resume:
        worlds.plan(options.request(progress))
    if options.cluster is not None:
        from racecraft.cluster.ray_transport import imported_ray

        imported_ray()
    return Submitted(submit_training(options.verb, options.args(NOT_FOR_A_JOB), options.run, goes_on=options.resume))


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
        again = (*verb, at, "--resume", *resumed_words(words))
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


def resumed_words(words: Sequence[str]) -> list[str]:
    """Return what a training that goes on is told of its words, values joined to their options or behind them.

    >>> resumed_words(["CartPole-v1", "--stop", "score=475", "--seed", "2", "--stop=minutes=9", "--no-pictures"])
    ['--stop=score=475', '--stop=minutes=9', '--no-pictures']
    """
    kept, left = [], iter(words)
    for word in left:
        if word in KEPT_ON_RESUME:
            kept.append(f"{word}={next(left, '')}")
        elif word.partition("=")[0] in KEPT_ON_RESUME or word in FLAGS_ON_RESUME:
            kept.append(word)
    return kept


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
    from racecraft.contract.errors import SettingError, nearest
    from racecraft.formats.job_spec import COMMANDS, WITHOUT_CORES, JobSpec, commands_of_worlds
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
    if words[0] in WITHOUT_CORES and limits["cores"] is None:
        limits = {**limits, "cores": 0}
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
