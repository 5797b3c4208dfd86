"""A folder of models, as the console and the command line share it. Begin with `Workspace.open`.

::

    models/NAME/        a racer's folder, as `racecraft new` makes it, with its runs in runs/1, runs/2, …
        model.json      tags, notes and origin of the model; need not be there
    runs/NAME/          a run that a command made here; it is a model as well
    drafts/ID.json      models that are being made
    driven/TRACK.safetensors  laps driven by hand
    tunings/N/          searches for settings, each with its trials
    logs/NAME/          a log that came without a model, and the page about it
    bin/NAME.SECONDS/   models that were deleted at that time, seconds since 1970
    console.sqlite      the index over all this; see `index.py`
"""

from __future__ import annotations

import itertools
import json
import os
import re
import shutil
import time
from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

from racecraft.contract.errors import UserInputError, nearest
from racecraft.contract.message import shortened
from racecraft.formats.atomic import OutputFileError, make_folder, write_atomic
from racecraft.formats.run_folder import JOB

MODELS, RUNS, DRAFTS, BIN = "models", "runs", "drafts", "bin"
DRIVEN, TUNINGS, LOGS = "driven", "tunings", "logs"
PEOPLE, LEAGUE = "people", "league"
"""Of the owner's workspace: the workspaces of the others, and the races that all see."""
MODEL_FILE = "model.json"
FORMAT, VERSION = "racecraft model", 1
LEGAL_NAME = re.compile(r"\w[\w .+-]{0,62}\w|\w")
BIN_SECONDS = 30 * 86400.0
"""How long a deleted model is kept."""


class WorkspaceError(UserInputError):
    """A model or a name of the workspace cannot be used."""


@dataclass(frozen=True, kw_only=True)
class Note:
    """What people say of a model."""

    tags: tuple[str, ...] = ()
    text: str = ""
    archived: bool = False
    cloned_from: str = ""
    """The model whose weights it began with, as "NAME" or "NAME:12"; "": none."""
    created: float = 0.0
    """Seconds since 1970; 0.0: unknown."""
    shared: bool = False
    """Whether everybody who signs in may take a copy."""
    kind: str = ""
    """The world it was made for; its runs say so themselves."""
    place: str = ""
    picture: str = ""
    """Where it will act and the picture of that, until a run says so; as `parts.Card`."""


@dataclass(frozen=True)
class Model:
    """A model's folder."""

    name: str
    path: Path

    @property
    def is_run(self) -> bool:
        """Whether the folder is itself a run, made by a command."""
        return self.path.parent.name == RUNS

    def runs(self) -> list[Path]:
        """Return its run folders, the oldest first."""
        if self.is_run:
            return [self.path]
        try:
            with os.scandir(self.path / RUNS) as entries:
                found = [Path(entry.path) for entry in entries if entry.is_dir()]
        except OSError:
            return []
        return sorted((run for run in found if (run / JOB).is_file()), key=_number_last)

    def next_run(self) -> str:
        """Return where its next run goes, relative to its folder."""
        numbers = [int(run.name) for run in self.runs() if run.name.isdigit()]
        return f"{RUNS}/{max(numbers, default=0) + 1}"

    def write_files(self, files: Mapping[str, str]) -> None:
        """Write files of these names and texts: its next training reads them.

        Raises:
            OutputFileError: The folder cannot be written.
        """
        for file, text in files.items():
            write_atomic(self.path / file, text)

    def note(self) -> Note:
        """Return what people say of it; a damaged file says nothing."""
        try:
            note = json.loads((self.path / MODEL_FILE).read_text(encoding="utf-8"))
            return Note(
                tags=tuple(str(tag) for tag in note.get("tags", ())),
                text=str(note.get("text", "")),
                archived=bool(note.get("archived", False)),
                shared=bool(note.get("shared", False)),
                cloned_from=str(note.get("cloned_from", "")),
                created=float(note.get("created", 0.0)),
                **{name: str(note.get(name, "")) for name in ("kind", "place", "picture")},
            )
        except (OSError, ValueError, TypeError, AttributeError):
            return Note()

    def write_note(self, note: Note) -> None:
        """Write what people say of it.

        Raises:
            OutputFileError: The folder cannot be written.
        """
        text = json.dumps({"format": FORMAT, "version": VERSION, **asdict(note)}, indent=2) + "\n"
        write_atomic(self.path / MODEL_FILE, text)


@dataclass(frozen=True)
class Workspace:
    """A folder of models."""

    path: Path

    @classmethod
    def open(cls, path: Path) -> Workspace:
        """Return the workspace at a path, made where there is none; old deleted models are removed for good.

        Raises:
            OutputFileError: The folder cannot be made.
        """
        workspace = cls(path.expanduser().resolve())
        for name in (MODELS, DRAFTS, BIN):
            make_folder(workspace.path / name)
        workspace._empty_bin(time.time() - BIN_SECONDS)
        return workspace

    def models(self) -> Iterator[Model]:
        """Yield every model; of two with one name the folder below models/."""
        seen = set()
        for place in (MODELS, RUNS):
            for path in _folders(self.path / place):
                if path.name not in seen and (place == MODELS or (path / JOB).is_file()):
                    seen.add(path.name)
                    yield Model(path.name, path)

    def newest_runs(self) -> dict[str, Path]:
        """Return the newest run of every model that has one, by the model's name."""
        return {model.name: runs[-1] for model in self.models() if (runs := model.runs())}

    def find(self, name: str) -> Model | None:
        """Return the model of a name; None where there is none."""
        if not LEGAL_NAME.fullmatch(name):
            return None
        for path, needed in ((self.path / MODELS / name, ""), (self.path / RUNS / name, JOB)):
            if path.is_dir() and (not needed or (path / needed).is_file()):
                return Model(name, path)
        return None

    def model(self, name: str) -> Model:
        """Return the model of a name.

        Raises:
            WorkspaceError: There is none.
        """
        found = self.find(name)
        if found is None:
            known = nearest(name, [model.name for model in self.models()])
            raise WorkspaceError("{name}: there is no such model. {known}", name=shortened(name, 80), known=known)
        return found

    def create(self, name: str, files: Mapping[str, str], note: Note | None = None) -> Model:
        """Make a model's folder with these files.

        Args:
            name: Of the model; no other may have it.
            files: Text by file name.
            note: What is said of it.

        Raises:
            WorkspaceError: The name is not legal, or taken.
            OutputFileError: The folder cannot be written.
        """
        model = Model(name, self.path / MODELS / self.require_free(name))
        make_folder(model.path)
        try:
            model.write_files(files)
            model.write_note(replace(note or Note(), created=time.time()))
        except OutputFileError:
            shutil.rmtree(model.path)
            raise
        return model

    def require_free(self, name: str) -> str:
        """Return a name that no model has.

        Raises:
            WorkspaceError: It is not legal, or taken.
        """
        if not LEGAL_NAME.fullmatch(name):
            raise WorkspaceError(
                "{name!r} is not a model's name; expected 1 to 64 letters, digits, spaces or . _ + -, "
                "with a letter or digit at both ends.",
                name=shortened(name, 80),
            )
        if self.find(name) is not None:
            raise WorkspaceError(
                "{name}: there is a model of that name; expected another, such as {free}.",
                name=name,
                free=self.free(name),
            )
        return name

    def free(self, base: str) -> str:
        """Return `base`, or where a model has it `base-2`, `base-3` and so on.

        >>> Workspace(Path("/nowhere")).free("first-car")
        'first-car'
        """
        if self.find(base) is None:
            return base
        stem = re.sub(r"-\d+$", "", base)
        number = 2
        while self.find(f"{stem}-{number}") is not None:
            number += 1
        return f"{stem}-{number}"

    def free_folder(self, place: str, name: str) -> Path:
        """Return a folder that is not there yet: of a number the next one, else `name`, `2-name`, `3-name` and so on.

        Args:
            place: TUNINGS or LOGS.
            name: Of the folder.

        >>> Workspace(Path("/nowhere")).free_folder(LOGS, "a.csv").as_posix()
        '/nowhere/logs/a.csv'
        """
        numbered = map(str, itertools.count(int(name))) if name.isdigit() else _numbered(name)
        return next(path for one in numbered if not (path := self.path / place / one).exists())

    def rename(self, model: Model, name: str) -> Model:
        """Give a model another name.

        Raises:
            WorkspaceError: The name is not legal or taken.
        """
        renamed = Model(self.require_free(name), model.path.with_name(name))
        model.path.rename(renamed.path)
        return renamed

    def delete(self, model: Model) -> str:
        """Move a model into the bin and return the name of what lies there, for `restore`."""
        place = f"{model.name}.{model.path.parent.name}.{time.time_ns()}"
        os.rename(model.path, self.path / BIN / place)
        return place

    def restore(self, place: str) -> Model:
        """Take a model out of the bin.

        Raises:
            WorkspaceError: It is not there, or its name is taken.
        """
        match = re.fullmatch(rf"({LEGAL_NAME.pattern})\.({MODELS}|{RUNS})\.(\d+)", place)
        path = self.path / BIN / place
        if match is None or not path.is_dir():
            raise WorkspaceError(
                "{place}: not in the bin; expected a model that was deleted.", place=shortened(place, 80)
            )
        name, parent = self.require_free(match[1]), match[2]
        path.rename(self.path / parent / name)
        return Model(name, self.path / parent / name)

    def bin(self) -> list[tuple[str, str, float]]:
        """Return what lies in the bin, the latest first: its name there, the model's name, when it was deleted."""
        found = []
        for path in _folders(self.path / BIN):
            name, _, deleted = path.name.rpartition(".")
            if deleted.isdigit():
                found.append((path.name, name.rpartition(".")[0], int(deleted) / 1e9))
        return sorted(found, key=lambda one: -one[2])

    def _empty_bin(self, before: float) -> None:
        for place, _, deleted in self.bin():
            if deleted < before:
                shutil.rmtree(self.path / BIN / place, ignore_errors=True)


def _numbered(name: str) -> Iterator[str]:
    """Yield a name, then the name with 2, 3 and so on before it."""
    return itertools.chain([name], (f"{number}-{name}" for number in itertools.count(2)))


def _folders(path: Path) -> list[Path]:
    """Return the folders in a folder by name; links are left out, so that nothing outside is reached."""
    try:
        with os.scandir(path) as entries:
            return sorted(Path(entry.path) for entry in entries if entry.is_dir(follow_symlinks=False))
    except OSError:
        return []


def _number_last(run: Path) -> tuple[int, Any]:
    """Sort numbered runs by number, behind those with names of their own."""
    return (1, int(run.name)) if run.name.isdigit() else (0, run.name)
