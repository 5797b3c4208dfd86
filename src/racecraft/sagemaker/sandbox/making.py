"""A plan becomes folders: the buckets among this account's, the notebooks in a folder of their own. Begin with `make`.

    FOLDER/NOTEBOOK/…      what the start-up scripts bring, as far as copies of it lie here
    FOLDER/sandbox.json    what was asked, what became of each resource, the outputs
    JOBS/buckets/NAME/     a bucket; what stands in it already stays
    JOBS/stacks/NAME.json  a copy of sandbox.json, by which boto3's names find the stack inside `racecraft run`

The folder arrives whole or not at all.
"""

from __future__ import annotations

import contextlib
import json
import os
import shutil
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any
from urllib.parse import urlparse

from racecraft.contract.errors import UserInputError
from racecraft.formats.archive import ArchiveError, Limits, unpack
from racecraft.formats.whole import OutputFileError, make_folder, output_letter, write_whole
from racecraft.jobs.home import JobHome
from racecraft.sagemaker.cloudformation.start_script import Fetched, Unpacked, Written
from racecraft.sagemaker.container import local_path
from racecraft.sagemaker.sandbox.addresses import localised
from racecraft.sagemaker.sandbox.stack import Notebook, Plan, Told
from racecraft.sagemaker.session import buckets_of

FORMAT, VERSION, RECORD = "racecraft sandbox", 1, "sandbox.json"
LIMITS = Limits(max_bytes=4 * 2**30)
"""Bytes that one archive may come to."""


class SandboxError(UserInputError):
    """A sandbox cannot be made at a place or under a name."""


@dataclass
class NotebookFiles:
    """What came into a notebook's folder."""

    laid: list[str] = field(default_factory=list)
    missing: dict[str, str] = field(default_factory=dict)
    """Files of which no copy lies here → where AWS would have brought them from."""
    left: list[str] = field(default_factory=list)
    """Lines of the scripts that were not run."""


@dataclass(frozen=True)
class Sandbox:
    """What was made."""

    plan: Plan
    folder: Path
    buckets: Mapping[str, Path]
    kept_buckets: tuple[str, ...]
    """Those that stood already."""
    notebooks: Mapping[str, Path]
    files: Mapping[str, NotebookFiles]
    outputs: tuple[Told, ...]
    """With addresses of this machine."""

    def as_dictionary(self) -> dict[str, Any]:
        """Return plain values: what sandbox.json and --json hold."""
        return {
            "format": FORMAT,
            "version": VERSION,
            "stack": self.plan.name,
            "template": str(self.plan.template.path),
            "description": self.plan.template.description,
            "folder": str(self.folder),
            "parameters": dict(self.plan.parameters),
            "buckets": {name: str(path) for name, path in self.buckets.items()},
            "notebooks": {
                name: {"folder": str(path), **vars(self.files[name])} for name, path in self.notebooks.items()
            },
            "resources": [vars(fate) for fate in self.plan.fates],
            "outputs": [vars(told) for told in self.outputs],
            "notes": list(self.plan.notes),
        }


def stacks_of(home: JobHome) -> Path:
    """Return the folder that tells which stacks were made."""
    return home.path / "stacks"


def recorded_stacks(home: JobHome) -> Iterator[dict[str, Any]]:
    """Yield what sandbox.json says of every stack whose folder still stands, by name."""
    for path in sorted(stacks_of(home).glob("*.json")):
        with contextlib.suppress(OSError, ValueError):
            told = json.loads(path.read_text(encoding="utf-8"))
            if isinstance(told, dict) and Path(str(told.get("folder"))).is_dir():
                yield told


def make(plan: Plan, folder: Path, home: JobHome, copies: Sequence[Path] = ()) -> Sandbox:
    """Make what a plan says.

    Args:
        plan: From `stack.plan`.
        folder: Where the notebooks' folders go; must not stand, or be empty.
        home: Whose buckets are meant.
        copies: Folders in which copies of the named files may lie; the template's own is looked into last.

    Raises:
        SandboxError: The folder or the stack's name is taken, or a named archive cannot be unpacked.
        OutputFileError: The disk is full, or a place cannot be written.
    """
    folder = folder.absolute()
    _require_free(plan, folder, home)
    notebooks = {one.name: folder / one.name for one in plan.notebooks}
    outputs = tuple(_localised(told, notebooks) for told in plan.outputs)
    places = [*(path.absolute() for path in copies), plan.template.path.absolute().parent]
    with _in_one_move(folder) as part:
        files = {one.name: _Laying(part / one.name, notebooks, places, home).lay(one) for one in plan.notebooks}
        buckets = {name: buckets_of(home) / name for name in plan.buckets}
        kept = tuple(name for name, path in buckets.items() if path.is_dir())
        made = Sandbox(plan, folder, buckets, kept, notebooks, files, outputs)
        record = json.dumps(made.as_dictionary(), indent=2, ensure_ascii=False) + "\n"
        write_whole(part / RECORD, record)
        for path in (*buckets.values(), stacks_of(home)):
            make_folder(path)
    write_whole(stacks_of(home) / f"{plan.name}.json", record)
    return made


def _require_free(plan: Plan, folder: Path, home: JobHome) -> None:
    if folder.exists() and not (folder.is_dir() and not any(folder.iterdir())):
        raise SandboxError(f"{folder}: stands already; expected a new folder. Name another one, or take it away first.")
    for told in recorded_stacks(home):
        if told["stack"] == plan.name:
            raise SandboxError(
                f"stack '{plan.name}' stands already in {told['folder']}; expected a name of its own. "
                "Give --stack-name, or take that folder away first."
            )


@contextlib.contextmanager
def _in_one_move(folder: Path) -> Iterator[Path]:
    """Yield a folder beside the wanted one, which takes its place in the end, or nothing does."""
    make_folder(folder.parent)
    try:
        part = Path(tempfile.mkdtemp(prefix=f".{folder.name}.", dir=folder.parent))
    except OSError as error:
        raise OutputFileError(output_letter(folder, error)) from error
    try:
        yield part
        part.chmod(0o755)
        if folder.is_dir():
            folder.rmdir()
        os.replace(part, folder)
    except shutil.Error as error:  # several files at once
        raise OutputFileError(f"{folder}: cannot be filled ({str(error)[:200]}).") from error
    except OSError as error:
        raise OutputFileError(output_letter(folder, error)) from error
    finally:
        shutil.rmtree(part, ignore_errors=True)


def _localised(told: Told, notebooks: Mapping[str, Path]) -> Told:
    if told.value is None:
        return told
    value = localised(told.value, notebooks)
    has_address_here = value != told.value and not value.startswith("https:")
    return Told(told.name, value, told.description, () if has_address_here else told.rests_on)


class _Laying:
    """Lays what the start-up scripts bring into one notebook's folder."""

    def __init__(self, folder: Path, notebooks: Mapping[str, Path], places: Sequence[Path], home: JobHome) -> None:
        self._folder, self._notebooks, self._places, self._home = folder, notebooks, places, home
        self._files = NotebookFiles()

    def lay(self, notebook: Notebook) -> NotebookFiles:
        make_folder(self._folder)
        for script in notebook.scripts:
            for act in script.acts:
                if isinstance(act, Fetched):
                    self._fetch(act)
                elif isinstance(act, Unpacked):
                    self._unpack(act)
                else:
                    self._write(act)
            self._files.left += script.left
        self._files.laid = sorted(
            path.relative_to(self._folder).as_posix() for path in self._folder.rglob("*") if path.is_file()
        )
        return self._files

    def _fetch(self, act: Fetched) -> None:
        found = self._copy_of(act)
        target = self._folder / act.path
        if found is None:
            self._files.missing[act.path] = act.source
        elif act.is_folder:
            shutil.copytree(found, target, dirs_exist_ok=True, ignore=shutil.ignore_patterns(".git"))
        else:
            make_folder(target.parent)
            shutil.copy2(found, target)

    def _copy_of(self, act: Fetched) -> Path | None:
        """Return where a copy lies: in a bucket of this machine, else by the longest end of its address."""
        if act.source.startswith("s3://"):
            in_bucket = local_path(act.source, buckets_of(self._home))
            if _is(in_bucket, act.is_folder):
                return in_bucket
        parts = [part for part in urlparse(act.source).path.split("/") if part not in ("", ".", "..")]
        parts = [*parts[:-1], parts[-1].removesuffix(".git")] if parts else []
        for start in range(len(parts)):
            for place in self._places:
                if _is(place.joinpath(*parts[start:]), act.is_folder):
                    return place.joinpath(*parts[start:])
        return None

    def _unpack(self, act: Unpacked) -> None:
        archive = self._folder / act.path
        if not archive.is_file():
            self._files.left.append(f"unzip {act.path}")
            return
        target = (self._folder / act.into).resolve()
        try:
            unpack(archive, target, "a zip file of a notebook's files", LIMITS)
        except ArchiveError as cause:
            raise SandboxError(f"{act.path}: {cause.found}; expected {cause.expected}. {cause.cure}") from cause

    def _write(self, act: Written) -> None:
        target = self._folder / act.path
        make_folder(target.parent)
        with open(target, "a" if act.appends else "w", encoding="utf-8", newline="\n") as file:
            file.write(localised(act.text, self._notebooks))


def _is(path: Path, is_folder: bool) -> bool:
    return path.is_dir() if is_folder else path.is_file()
