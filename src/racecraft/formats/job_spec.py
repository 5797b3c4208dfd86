"""What a job is to do, as a JSON file a stranger can read and write. Begin with `JobSpec`, `read_job_spec`.

The file, version 1::

    {
      "format": "racecraft job", "version": 1,
      "name": "gym-1",
      "command": ["gym", "train", "CartPole-v1", "--stop=score=475"],
      "resume": ["gym", "train", "--run=runs/gym-1", "--resume"],
      "run": "runs/gym-1",
      "folder": "/home/me/snakes",
      ...
    }

Only "command" must stand there; the fields of `JobSpec` say what the others mean.
"""

from __future__ import annotations

import dataclasses
import json
import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from racecraft.contract.errors import InputFileError, UserInputError, nearest
from racecraft.contract.kinds import kinds
from racecraft.contract.message import Message
from racecraft.formats.atomic import write_atomic
from racecraft.formats.json_text import kind_of, read_json

FORMAT = "racecraft job"
VERSION = 1
LEGAL_NAME = re.compile(r"[A-Za-z0-9](?:[A-Za-z0-9-]{0,61}[A-Za-z0-9])?")
"""Names of jobs: those of SageMaker (facts: battlesnake-and-sagemaker-rl.md C.1), so that old ones go on working."""
COMMANDS = ("run", "serve", "tune", "jobs")
"""The first words of racecraft's commands that may be a job, besides those that train in a world."""
WITHOUT_CORES = ("serve", "tune")
"""Those that take no core worth counting, where nothing is said: a search's trials are jobs with cores of their own."""
EXPERIMENT_VARIABLES = {
    "ExperimentName": "RACECRAFT_EXPERIMENT",
    "TrialName": "RACECRAFT_TRIAL",
    "TrialComponentDisplayName": "RACECRAFT_TRIAL_COMPONENT",
}
"""Where a job's training finds the names that SageMaker's `experiment_config` gives."""


class JobSpecError(InputFileError):
    """A job file cannot be used."""


class JobNameError(UserInputError):
    """A job's name is not legal."""


@dataclass(frozen=True)
class JobSpec:
    """What one job is to do, and with what."""

    command: tuple[str, ...]
    """Words behind `racecraft` that begin it."""
    name: str = ""
    """Of the job, unique in its store; "": the store's next free one."""
    resume: tuple[str, ...] = ()
    """Words behind `racecraft` that go on with what `run` holds; (): it is begun anew with `command`."""
    run: str = ""
    """The run folder it trains into; "": none is known."""
    older_run: str = ""
    """The mark (`run_mark`) of a run in `run` that was there before it, and that it takes the place of; "": none."""
    folder: str = "."
    """Where it works; what is named above begins there."""
    environment: Mapping[str, str] = field(default_factory=dict)
    """Variables it sees beside those of its supervisor."""
    python: str = ""
    """The interpreter; "": the supervisor's."""
    cores: int | None = None
    """Cores it takes; None: all of the machine, 0: none worth counting."""
    memory_mib: int = 1024
    """Memory it takes, MiB."""
    max_run_seconds: int | None = None
    """Seconds it may train; None: as long as it wants."""
    use_spot_instances: bool = False
    """Whether it makes room for jobs that are none of this kind: interrupted, and gone on with later."""
    max_wait_seconds: int | None = None
    """Seconds from its birth to its end, waiting included; None: as long as it wants."""
    metric_definitions: tuple[Mapping[str, str], ...] = ()
    """What is read out of its log: {"Name": …, "Regex": …}, the figure in the first group."""
    recorded: Mapping[str, Any] = field(default_factory=dict)
    """Whatever else was said of it, kept for people."""

    def as_dictionary(self) -> dict[str, Any]:
        """Return what the file holds, format and version left out."""
        values: dict[str, Any] = json.loads(json.dumps(dataclasses.asdict(self)))
        return values

    def run_folder(self) -> Path | None:
        """Return where it trains into, as its supervisor finds it."""
        return Path(self.folder, self.run) if self.run else None


def write_job_spec(path: str | Path, spec: JobSpec) -> None:
    """Write a job file.

    Raises:
        OutputFileError: The disk is full, or the place cannot be written.
    """
    write_atomic(path, json.dumps({"format": FORMAT, "version": VERSION, **spec.as_dictionary()}, indent=2) + "\n")


def read_job_spec(path: str | Path) -> JobSpec:
    """Read a job file.

    Raises:
        JobSpecError: No such file, no JSON, another format or version, an unknown field, a value of another kind.
    """
    document = read_json(path, JobSpecError, "a JSON object with a command, such as racecraft writes")
    if not isinstance(document.value, dict):
        raise document.error_at(found=kind_of(document.value), expected='an object with "command"')
    values = dict(document.value)
    told_format, version = values.pop("format", FORMAT), values.pop("version", VERSION)
    if told_format != FORMAT:
        raise document.error_at(
            "format",
            found=Message("{told_format!r}", told_format=told_format),
            expected=Message("{format!r}", format=FORMAT),
        )
    if version != VERSION:
        raise document.error_at(
            "version",
            found=repr(version),
            expected=Message("{version}", version=VERSION),
            hint="A newer racecraft wrote it: upgrade.",
        )
    for name, value in values.items():
        if name not in _LEGAL:
            raise document.error_at(
                name, found="an unknown field", expected="one of a job's", hint=nearest(name, _LEGAL)
            )
        expected, is_legal = _LEGAL[name]
        if not is_legal(value):
            raise document.error_at(name, found=Message("{value!r}", value=value), expected=expected)
    if "command" not in values:
        raise document.error_at(
            found='no "command"', expected='one, such as "command": ["gym", "train", "CartPole-v1"]'
        )
    try:
        return spec_of(values)
    except JobNameError as error:
        raise document.error_at("name", found=repr(values["name"]), expected=str(error)) from None


def spec_of(values: Mapping[str, Any]) -> JobSpec:
    """Return the spec that `JobSpec.as_dictionary` told.

    Raises:
        JobNameError: The name is not legal.
    """
    fields: dict[str, Any] = {
        name: tuple(value) if isinstance(value, list) else value for name, value in values.items()
    }
    spec = JobSpec(**fields)
    if spec.name:
        require_legal_name(spec.name)
    return spec


def require_legal_name(name: str) -> str:
    """Return a job's name.

    Raises:
        JobNameError: It is none.
    """
    if not LEGAL_NAME.fullmatch(name):
        raise JobNameError(
            "{name!r} is no name of a job; expected 1 to 63 letters, digits and -, no - at the ends.", name=name
        )
    return name


def _is_complete(value: Any) -> bool:
    return isinstance(value, int) and not isinstance(value, bool) and value >= 0


def _is_words(value: Any) -> bool:
    return isinstance(value, list) and all(isinstance(one, str) for one in value)


def _is_command(value: Any) -> bool:
    return _is_words(value) and bool(value) and (value[0] in COMMANDS or value[0] in commands_of_worlds())


def commands_of_worlds() -> set[str]:
    """Return the first words of the commands that train in the installed worlds."""
    train = {kind.train_command.split()[1] for kind in kinds() if kind.train_command}
    return train | {command.name for kind in kinds() for command in kind.commands if command.queues}


def _is_text(value: Any) -> bool:
    return isinstance(value, str)


def _is_texts(value: Any) -> bool:
    return isinstance(value, dict) and all(isinstance(one, str) for one in value.values())


def _is_metrics(value: Any) -> bool:
    return isinstance(value, list) and all(_is_texts(one) and set(one) == {"Name", "Regex"} for one in value)


def _is_seconds(value: Any) -> bool:
    return value is None or (_is_complete(value) and value > 0)


_SECONDS = "a whole number of seconds above 0, or null"
_LEGAL = {
    "name": ("a word", _is_text),
    "command": (
        f"a list of words behind `racecraft`, the first of {', '.join(COMMANDS)}, or of a world's training",
        _is_command,
    ),
    "resume": ("a list of words behind `racecraft`", _is_words),
    "run": ("a folder", _is_text),
    "older_run": ("the mark of a run", _is_text),
    "folder": ("a folder", _is_text),
    "environment": ("an object of texts", _is_texts),
    "python": ("the path of an interpreter", _is_text),
    "cores": ("a whole number, or null for all", lambda value: value is None or _is_complete(value)),
    "memory_mib": ("a whole number of MiB", _is_complete),
    "max_run_seconds": (_SECONDS, _is_seconds),
    "use_spot_instances": ("true or false", lambda value: isinstance(value, bool)),
    "max_wait_seconds": (_SECONDS, _is_seconds),
    "metric_definitions": ('a list of {"Name": …, "Regex": …}', _is_metrics),
    "recorded": ("an object", lambda value: isinstance(value, dict)),
}
