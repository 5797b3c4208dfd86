"""One training, one folder: where everything stands, who is writing to it, what was asked and what was measured.

Begin with `RunFolder.create` (a new one) or `RunFolder.open` (one that stands). The layout, version 1::

    job.json               what was asked, with the format's name and version; its presence makes the folder a run
    reward_function.py     copies of the user's files, as they were
    model_metadata.json
    hyperparameters.json
    *.py                   modules that the reward function needs, from beside it
    code/                  the user's own network or algorithm, and the modules that it needs
    track.npy              the circuit, where the catalogue does not have it
    tracks/                further circuits likewise, one file each, of a training on several
    *-demonstrations.*     the recorded episodes that a setting names, under the name of its group
    metrics.jsonl          one JSON object a line, one line an iteration
    log.txt                what was said, the reward function's prints among it
    stop                   somebody asks the training to stop; taken away when it goes on
    checkpoints/           see checkpoint.py
    episodes/              see episodes.py
    evaluations/           one JSON file for each evaluation
    mirror.json            the bucket in which the run is kept as well; see storage/mirror_note.py
    run.lock               held by the process that trains; the system frees it when that process dies
    generalisation.csv     how the latest evaluation went on each track, where there are several
    watched                touched by who watches and wants ticks; see live_ticks.py
    live.safetensors       the ticks left for it

Processes meet only here; they hand no objects to each other.
"""

from __future__ import annotations

import json
import math
import os
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import IO, Any

from racecraft.contract.errors import RunFolderError
from racecraft.contract.kinds import MissingWorldError, find_kind
from racecraft.formats.atomic import OutputFileError, output_error, write_atomic
from racecraft.formats.json_text import parse_json
from racecraft.formats.run_lock import LOCK, RunLock, holder, unwritable
from racecraft.formats.user_file import read_regular

FORMAT = "racecraft run"
VERSION = 1

JOB = "job.json"
METRICS = "metrics.jsonl"
LOG = "log.txt"
STOP = "stop"
WATCHED = "watched"
LIVE = "live.safetensors"
REWARD_FUNCTION = "reward_function.py"
MODEL_METADATA = "model_metadata.json"
HYPERPARAMETERS = "hyperparameters.json"
TRACK = "track.npy"
TRACKS = "tracks"
GENERALISATION = "generalisation.csv"
CODE = "code"
CHECKPOINTS = "checkpoints"
EPISODES = "episodes"
EVALUATIONS = "evaluations"
FOLDERS = (CHECKPOINTS, EPISODES, EVALUATIONS)


@dataclass(frozen=True)
class RunFolder:
    """A folder that holds one training."""

    path: Path

    @classmethod
    def create(
        cls,
        path: str | Path,
        job: Mapping[str, Any] | None = None,
        fill: Callable[[RunFolder], None] = lambda run: None,
    ) -> RunFolder:
        """Make a new run folder at path; `job.json` is written last, so that what stands is a whole run or none.

        An empty folder that stands there is used, and so is one whose birth was broken off.

        Args:
            path: Where to.
            job: What was asked.
            fill: Writes the copies of the user's files.

        Raises:
            RunFolderError: A run, a file, or somebody's other files stand there, or the place is not writable.
            OutputFileError: `fill` could not write; the same place may be used again.
        """
        path = Path(path)
        _require_free(path)
        run = cls(path)
        run.make_folders()
        with run.lock():
            _require_free(path)  # somebody may have been quicker
            fill(run)
            run.write_job(job or {})
        return run

    @classmethod
    def create_numbered(
        cls,
        parent: str | Path,
        name: str,
        job: Mapping[str, Any] | None = None,
        fill: Callable[[RunFolder], None] = lambda run: None,
    ) -> RunFolder:
        """Make the next free `<parent>/<name>-<number>`, counted from 1, as `create` does.

        Raises:
            RunFolderError: The place is not writable.
        """
        parent = Path(parent)
        _require_no_file(parent)
        pattern = re.compile(re.escape(name) + r"-(\d+)")
        taken = [pattern.fullmatch(entry.name) for entry in parent.iterdir()] if parent.is_dir() else []
        number = max((int(match[1]) for match in taken if match), default=0) + 1
        while True:
            path = parent / f"{name}-{number}"
            try:
                path.mkdir(parents=True)
            except FileExistsError:
                number += 1  # somebody was quicker
                continue
            except OSError as error:
                raise unwritable(path, error) from error
            return cls.create(path, job, fill)

    @classmethod
    def open(cls, path: str | Path) -> RunFolder:
        """Open a run folder that stands.

        Raises:
            RunFolderError: There is none, it is not ours, it is damaged, or a newer racecraft wrote it.
        """
        path = Path(path)
        if not path.exists():
            _require_no_checkpoint(path)
            raise RunFolderError(
                "{path}: there is no such folder; expected a run folder, such as runs/reinvent_base-1.", path=path
            )
        _require_no_file(path)
        if not (path / JOB).is_file():
            raise RunFolderError(
                "{path}: holds no {job}; expected a run folder of racecraft. Name the folder itself.",
                path=path,
                job=JOB,
            )
        run = cls(path)
        run.read_job()
        return run

    def make_folders(self) -> None:
        """Make the run's folders where they are missing: a bucket keeps no empty ones.

        Raises:
            RunFolderError: The place is not writable.
        """
        try:
            for folder in (self.path, *(self.path / name for name in FOLDERS)):
                folder.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise unwritable(self.path, error) from error

    @property
    def job(self) -> Path:
        """What was asked."""
        return self.path / JOB

    @property
    def metrics(self) -> Path:
        """What was measured, a line an iteration."""
        return self.path / METRICS

    @property
    def log(self) -> Path:
        """What was said."""
        return self.path / LOG

    @property
    def reward_function(self) -> Path:
        """Copy of the user's reward function."""
        return self.path / REWARD_FUNCTION

    @property
    def model_metadata(self) -> Path:
        """Copy of the user's car."""
        return self.path / MODEL_METADATA

    @property
    def hyperparameters(self) -> Path:
        """Copy of the user's hyperparameters."""
        return self.path / HYPERPARAMETERS

    @property
    def track(self) -> Path:
        """The circuit, where the catalogue does not have it."""
        return self.path / TRACK

    @property
    def tracks(self) -> Path:
        """Folder of further circuits that the catalogue does not have; it need not be there."""
        return self.path / TRACKS

    @property
    def generalisation(self) -> Path:
        """The latest evaluation by track; see generalisation.py."""
        return self.path / GENERALISATION

    @property
    def checkpoints(self) -> Path:
        """Folder of the checkpoints."""
        return self.path / CHECKPOINTS

    @property
    def episodes(self) -> Path:
        """Folder of the episodes."""
        return self.path / EPISODES

    @property
    def evaluations(self) -> Path:
        """Folder of the evaluations."""
        return self.path / EVALUATIONS

    @property
    def watched(self) -> Path:
        """Touched while somebody watches."""
        return self.path / WATCHED

    @property
    def live(self) -> Path:
        """The latest ticks, while somebody watches."""
        return self.path / LIVE

    def write_job(self, job: Mapping[str, Any]) -> None:
        """Write what was asked; the format's name and version are added.

        Raises:
            RunFolderError: The folder cannot be written to.
        """
        text = json.dumps({"format": FORMAT, "version": VERSION, **job}, indent=2, default=_plain) + "\n"
        try:
            write_atomic(self.path / JOB, text)
        except OutputFileError as error:
            raise RunFolderError(str(error)) from error

    def read_job_of(self, kind: str) -> dict[str, Any]:
        """Return what was asked of a run that must be of a kind of world.

        Raises:
            RunFolderError: As `read_job`, or the run is of another kind.
        """
        job = self.read_job()
        if job.get("kind") != kind:
            made, expected = (_made_by(str(one)) for one in (job.get("kind"), kind))
            raise RunFolderError(
                "{path}: the run is {made}; expected {expected}.", path=self.path, made=made, expected=expected
            )
        return job

    def read_job(self) -> dict[str, Any]:
        """Return what was asked, with "format" and "version".

        Raises:
            RunFolderError: `job.json` is missing, damaged, foreign, or of a newer version.
        """
        path = self.path / JOB
        try:
            job = parse_json(read_regular(path).decode())
        except FileNotFoundError:
            raise RunFolderError(
                "{path}: there is no such file; expected a run folder of racecraft.", path=path
            ) from None
        except json.JSONDecodeError as error:
            raise RunFolderError(
                "{path}:{lineno}: no valid JSON ({msg}); expected what racecraft wrote. Restore the file.",
                path=path,
                lineno=error.lineno,
                msg=error.msg,
            ) from None
        except (OSError, ValueError) as error:
            raise RunFolderError(
                "{path}: cannot be read ({error}); expected what racecraft wrote.", path=path, error=error
            ) from error
        if not isinstance(job, dict) or job.get("format") != FORMAT:
            raise RunFolderError(
                '{path}: not written by racecraft; expected "format": "{format}".', path=path, format=FORMAT
            )
        version = job.get("version")
        if not isinstance(version, int) or not 1 <= version <= VERSION:
            raise RunFolderError(
                "{path}: format version is {version!r}; expected 1 to {newest}. A newer racecraft wrote it: upgrade.",
                path=path,
                version=version,
                newest=VERSION,
            )
        return job

    def note_resumed(self, iteration: int, stops: Sequence[str]) -> None:
        """Write beside what was asked that the run goes on behind an iteration, and until when.

        Raises:
            RunFolderError: As `read_job` and `write_job`.
        """
        job = self.read_job()
        again = {"after_iteration": iteration, "stops": list(stops)}
        self.write_job({**job, "resumed": [*job.get("resumed", ()), again]})

    def append_metrics(self, row: Mapping[str, Any]) -> None:
        """Add one line to the metrics; what is no finite number becomes null. A torn last line is cut off first.

        Raises:
            RunFolderError: The file cannot be written.
        """
        line = json.dumps({key: _finite(value) for key, value in row.items()}, default=_plain) + "\n"
        try:
            with open(self.path / METRICS, "ab+") as file:
                _cut_torn_line(file)
                file.write(line.encode())
        except OSError as error:
            raise RunFolderError(output_error(self.path / METRICS, error)) from error

    def read_metrics(self) -> list[dict[str, Any]]:
        """Return the metrics, a dictionary a line; a last line that was torn by a crash is passed over.

        Raises:
            RunFolderError: A line is damaged, or the file cannot be read.
        """
        path = self.path / METRICS
        try:
            lines = read_regular(path).split(b"\n")
        except FileNotFoundError:
            return []
        except OSError as error:
            raise RunFolderError(
                "{path}: cannot be read ({strerror}); expected a metrics file.", path=path, strerror=error.strerror
            ) from error
        rows = []
        for number, line in enumerate(lines[:-1], start=1):
            try:
                rows.append(parse_json(line))
            except ValueError:
                raise RunFolderError(
                    "{path}:{number}: {line!r} is no JSON; expected one object a line. Take the line out.",
                    path=path,
                    number=number,
                    line=line[:60],
                ) from None
        return rows

    def cut_metrics(self, iteration: int) -> None:
        """Take out the metrics of iterations after `iteration`: a run that was killed goes on from there.

        Raises:
            RunFolderError: The file is damaged.
            OutputFileError: It cannot be written.
        """
        rows = self.read_metrics()
        kept = [row for row in rows if row["iteration"] <= iteration]
        if (self.path / METRICS).exists():
            write_atomic(self.path / METRICS, "".join(json.dumps(row) + "\n" for row in kept))

    def request_stop(self) -> None:
        """Ask whoever trains here to stop: the training ends as if Ctrl-C had been pressed.

        Raises:
            OutputFileError: The folder cannot be written to.
        """
        write_atomic(self.path / STOP, "")

    def stop_requested(self) -> bool:
        """Tell whether a stop of a training here was requested."""
        return (self.path / STOP).exists()

    def clear_stop(self) -> None:
        """Take the asking back, so that the training can go on."""
        (self.path / STOP).unlink(missing_ok=True)

    def is_training(self) -> bool:
        """Tell whether a process of this machine trains here."""
        return holder(self.path) is not None

    def lock(self) -> RunLock:
        """Take the folder for this process until `release`, the end of a `with`, or the end of the process.

        Raises:
            RunFolderError: Another training holds it; the message says which process, and since when.
        """
        return RunLock(self.path)


def last_stops(job: Mapping[str, Any]) -> tuple[str, ...]:
    """Return what ends the training of a job file, as typed; of one that was resumed what ends it now.

    >>> last_stops({"asked": {"stops": ["minutes=7"]}, "resumed": [{"after_iteration": 3, "stops": ["laps"]}]})
    ('laps',)
    """
    again = job.get("resumed")
    return tuple(map(str, (again[-1] if again else job.get("asked", {})).get("stops") or ()))


def ten_minutes_more(metrics: Sequence[Mapping[str, Any]]) -> str:
    """Return the stop with which a run goes on for ten minutes, by its metrics: stops count from a run's birth.

    >>> ten_minutes_more([{"seconds": 61.0}]), ten_minutes_more([])
    ('minutes=12', 'minutes=10')
    """
    seconds = float(metrics[-1]["seconds"]) if metrics else 0.0
    return f"minutes={math.ceil(seconds / 60.0) + 10}"


def _require_free(path: Path) -> None:
    """Refuse a place where a run stands, a file, or what is not ours; a run that was never born is none."""
    if (path / JOB).exists():
        raise RunFolderError(
            "{path}: a run stands here already; expected a new place. Give another name, or open it to go on.",
            path=path,
        )
    _require_no_file(path)
    if path.is_dir() and any(path.iterdir()) and not _is_incomplete(path):
        raise RunFolderError(
            "{path}: holds files that are no run; expected a new or empty folder. Give another.", path=path
        )


def _is_incomplete(path: Path) -> bool:
    """Tell a folder whose birth was broken off: ours, empty but for the first copies, and without `job.json`."""
    copies = {LOCK, JOB, REWARD_FUNCTION, MODEL_METADATA, HYPERPARAMETERS}
    names = {entry.name.removesuffix(".part") for entry in path.iterdir()}
    existing = [path / name for name in FOLDERS if (path / name).is_dir()]
    return bool(existing) and names <= copies | set(FOLDERS) and not any(any(folder.iterdir()) for folder in existing)


def _require_no_checkpoint(path: Path) -> None:
    """Refuse "RUN:word" where a run itself is asked for, or where the word is none."""
    run, colon, word = str(path).rpartition(":")
    if colon and (Path(run) / JOB).is_file():
        raise RunFolderError(
            "{path}: {run} is a run, and nothing here is called '{word}'; expected the run alone or, where a command "
            "takes a checkpoint, best, last, an iteration's number or a merit such as laptime behind the colon. "
            "racecraft checkpoints {run} lists them.",
            path=path,
            run=run,
            word=word,
        )


def _require_no_file(path: Path) -> None:
    if path.exists() and not path.is_dir():
        raise RunFolderError("{path}: a file stands in its place; expected a folder. Give another name.", path=path)


def _cut_torn_line(file: IO[bytes]) -> None:
    """Cut the file after its last line end, where a crash left half a line."""
    size = file.seek(0, os.SEEK_END)
    at = size
    while at > 0:
        begin = max(0, at - 4096)
        file.seek(begin)
        found = file.read(at - begin).rfind(b"\n")
        if found >= 0:
            at = begin + found + 1
            break
        at = begin
    if at != size:
        file.truncate(at)  # whatever is written goes to the end: the file was opened to be added to


def _finite(value: Any) -> Any:
    value = _plain(value) if hasattr(value, "item") else value
    return None if isinstance(value, float) and not math.isfinite(value) else value


def _plain(value: Any) -> Any:
    """Return what JSON can hold for a path or a NumPy number."""
    if isinstance(value, Path):
        return str(value)
    if hasattr(value, "tolist"):
        return value.tolist()
    raise TypeError(f"{type(value).__name__} cannot be written as JSON")


def _made_by(kind: str) -> str:
    """Return which runs those of a kind of world are, for a message: by the command that makes them, if it has one."""
    try:
        command = find_kind(kind).train_command
    except MissingWorldError:
        return f"of an unknown kind, {kind!r}"
    return f"one of `{command}`" if command else f"one of the kind {kind!r}"
