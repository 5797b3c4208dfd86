"""A folder of DeepRacer for Cloud to begin with, or what one that stands needs to go on without Docker."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from racecraft.contract.errors import UserInputError
from racecraft.formats.atomic import make_folder, write_atomic
from racecraft.worlds.deepracer.files.drfc_folder import CUSTOM_FILES, RUN_ENV, SYSTEM_ENV
from racecraft.worlds.deepracer.files.model_metadata import default_model_metadata, write_model_metadata
from racecraft.worlds.deepracer.files.reward_file import default_reward_source
from racecraft.worlds.deepracer.files.run_env import run_env_text
from racecraft.worlds.deepracer.training.activation import MARK, shell_file
from racecraft.worlds.deepracer.training.new_model import HYPERPARAMETERS

ACTIVATE, OURS = "bin/activate", "bin/activate-racecraft"
"""Where the shell's file goes, and where if DeepRacer for Cloud's own stands there."""


@dataclass(frozen=True)
class Installation:
    """What came of making one."""

    made: tuple[Path, ...]
    kept: tuple[Path, ...]
    """Files that stood there already."""
    activate: str
    """The file for bash and zsh, from the folder."""


def new_installation(folder: Path) -> Installation:
    """Write what is not there yet.

    Raises:
        UserInputError: A file stands in the folder's place.
        OutputFileError: It cannot be written.
    """
    if folder.exists() and not folder.is_dir():
        raise UserInputError(
            "{folder}: is a file; expected a folder, or a new name. Choose another name.", folder=folder
        )
    activate = {suffix: _free_activate(folder, suffix) for suffix in ("sh", "ps1")}
    files: dict[str, Callable[[Path], None]] = {
        SYSTEM_ENV: lambda path: write_atomic(path, run_env_text("system")),
        RUN_ENV: lambda path: write_atomic(path, run_env_text("run")),
        f"{CUSTOM_FILES}/reward_function.py": lambda path: write_atomic(path, default_reward_source()),
        f"{CUSTOM_FILES}/hyperparameters.json": lambda path: write_atomic(path, HYPERPARAMETERS),
        f"{CUSTOM_FILES}/model_metadata.json": lambda path: write_model_metadata(default_model_metadata(), path),
    }
    made, kept = [], []
    for name, write in files.items():
        path = folder / name
        if path.exists():
            kept.append(path)
            continue
        make_folder(path.parent)
        write(path)
        made.append(path)
    for suffix, shell in (("sh", "sh"), ("ps1", "powershell")):
        path = folder / activate[suffix]
        make_folder(path.parent)
        write_atomic(path, shell_file(shell))
        made.append(path)
    return Installation(tuple(made), tuple(kept), activate["sh"])


def _free_activate(folder: Path, suffix: str) -> str:
    """Return the name of the shell's file: another where one that is not ours has it."""
    path = folder / f"{ACTIVATE}.{suffix}"
    try:
        is_ours = not path.exists() or path.read_text(encoding="utf-8").startswith(MARK)
    except (OSError, UnicodeDecodeError):
        is_ours = False
    return f"{ACTIVATE if is_ours else OURS}.{suffix}"
