"""A plan becomes folders: the buckets among this account's, the notebooks in a folder of their own. Begin with `make`.

    FOLDER/NOTEBOOK/       the notebooks that its start-up script fetches and a world here brings; else empty
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
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from racecraft.contract.errors import UserInputError
from racecraft.contract.kinds import kinds
from racecraft.formats.atomic import OutputFileError, make_folder, output_error, write_atomic
from racecraft.jobs.job_paths import JobPaths
from racecraft.sagemaker.sandbox.addresses import localised
from racecraft.sagemaker.sandbox.stack import Plan, StackOutput
from racecraft.sagemaker.session import buckets_of

FORMAT, VERSION, RECORD = "racecraft sandbox", 1, "sandbox.json"


class SandboxError(UserInputError):
    """A sandbox cannot be made at a place or under a name."""


@dataclass(frozen=True)
class Sandbox:
    """What was made."""

    plan: Plan
    folder: Path
    buckets: Mapping[str, Path]
    kept_buckets: tuple[str, ...]
    """Those that stood already."""
    notebooks: Mapping[str, Path]
    outputs: tuple[StackOutput, ...]
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
            "notebooks": {name: str(path) for name, path in self.notebooks.items()},
            "resources": [vars(fate) for fate in self.plan.fates],
            "outputs": [vars(output) for output in self.outputs],
            "notes": list(self.plan.notes),
        }


def stacks_of(home: JobPaths) -> Path:
    """Return the folder that tells which stacks were made."""
    return home.path / "stacks"


def recorded_stacks(home: JobPaths) -> Iterator[dict[str, Any]]:
    """Yield what sandbox.json says of every stack whose folder still stands, by name."""
    for path in sorted(stacks_of(home).glob("*.json")):
        with contextlib.suppress(OSError, ValueError):
            stack = json.loads(path.read_text(encoding="utf-8"))
            if isinstance(stack, dict) and Path(str(stack.get("folder"))).is_dir():
                yield stack


def make(plan: Plan, folder: Path, home: JobPaths) -> Sandbox:
    """Make what a plan says.

    Args:
        plan: From `stack.plan`.
        folder: Where the notebooks' folders go; must not stand, or be empty.
        home: Whose buckets are meant.

    Raises:
        SandboxError: The folder or the stack's name is taken.
        OutputFileError: The disk is full, or a place cannot be written.
    """
    folder = folder.absolute()
    _require_free(plan, folder, home)
    notebooks = {name: folder / name for name in plan.notebooks}
    outputs = tuple(_localised(output, notebooks) for output in plan.outputs)
    with _in_one_move(folder) as part:
        for name in plan.notebooks:
            make_folder(part / name)
            for kind in kinds():
                if write := kind.piece("notebooks"):
                    write(part / name, plan.notebook_files[name])
        buckets = {name: buckets_of(home) / name for name in plan.buckets}
        kept = tuple(name for name, path in buckets.items() if path.is_dir())
        made = Sandbox(plan, folder, buckets, kept, notebooks, outputs)
        record = json.dumps(made.as_dictionary(), indent=2, ensure_ascii=False) + "\n"
        write_atomic(part / RECORD, record)
        for path in (*buckets.values(), stacks_of(home)):
            make_folder(path)
    write_atomic(stacks_of(home) / f"{plan.name}.json", record)
    return made


def _require_free(plan: Plan, folder: Path, home: JobPaths) -> None:
    if folder.exists() and not (folder.is_dir() and not any(folder.iterdir())):
        raise SandboxError(
            "{folder}: stands already; expected a new folder. Name another one, or take it away first.", folder=folder
        )
    for stack in recorded_stacks(home):
        if stack["stack"] == plan.name:
            raise SandboxError(
                "stack '{name}' stands already in {told}; expected a name of its own. "
                "Give --stack-name, or take that folder away first.",
                name=plan.name,
                told=stack["folder"],
            )


@contextlib.contextmanager
def _in_one_move(folder: Path) -> Iterator[Path]:
    """Yield a folder beside the wanted one, which takes its place in the end, or nothing does."""
    make_folder(folder.parent)
    try:
        part = Path(tempfile.mkdtemp(prefix=f".{folder.name}.", dir=folder.parent))
    except OSError as error:
        raise OutputFileError(output_error(folder, error)) from error
    try:
        yield part
        part.chmod(0o755)
        if folder.is_dir():
            folder.rmdir()
        os.replace(part, folder)
    except shutil.Error as error:  # several files at once
        raise OutputFileError("{folder}: cannot be filled ({error}).", folder=folder, error=str(error)[:200]) from error
    except OSError as error:
        raise OutputFileError(output_error(folder, error)) from error
    finally:
        shutil.rmtree(part, ignore_errors=True)


def _localised(output: StackOutput, notebooks: Mapping[str, Path]) -> StackOutput:
    if output.value is None:
        return output
    value = localised(output.value, notebooks)
    has_address_here = value != output.value and not value.startswith("https:")
    return StackOutput(output.name, value, output.description, () if has_address_here else output.rests_on)
