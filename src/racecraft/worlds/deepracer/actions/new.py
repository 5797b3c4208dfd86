"""Make a folder with a car to begin with."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from racecraft.actions.action import action
from racecraft.contract.errors import SettingError
from racecraft.contract.progress import Progress, quiet
from racecraft.settings.request import Request, argument, option


@dataclass(frozen=True, kw_only=True)
class NewRequest(Request):
    """Which folder."""

    folder: Path = argument("A new or empty folder.")
    reward: str | None = option(
        None, "A sample of `racecraft reward samples`, or one of an installed package, in place of the example."
    )
    files: Path | None = option(
        None,
        "Take the racer's files of an archive (.tar.gz, .zip), a folder or a reward function (.py), weights or none, "
        "in place of the examples.",
    )


@dataclass(frozen=True)
class NewFolder:
    """The folder that was made, and the names of its files."""

    folder: Path
    files: list[str]
    notes: list[str]
    """Of `--files`: what is missing and which default is taken, what was taken for what, a clause each."""
    has_logs: bool
    """Whether logs lie beside those files; `racecraft logs` reads them there."""


@action
def new(request: NewRequest, progress: Progress = quiet) -> NewFolder:
    """Make a folder with a reward function, two JSON files and a page that explains them, ready to edit.

    Examples:

        racecraft new my-car

        racecraft new my-car --files ~/Downloads/club-model.zip
    """
    from racecraft.worlds.deepracer.training.new_model import model_of_files, new_model

    if request.files is None:
        made = [path.name for path in new_model(request.folder, request.reward)]
        return NewFolder(request.folder, made, [], has_logs=False)
    if request.reward is not None:
        raise SettingError("--reward and --files were given; expected one of them. Each brings a reward function.")
    paths, notes = model_of_files(request.folder, request.files)
    return NewFolder(request.folder, [path.name for path in paths], notes, _has_logs(request.files))


def _has_logs(files: Path) -> bool:
    """Tell whether logs lie in an archive or folder."""
    from racecraft.formats.archive import ArchiveError
    from racecraft.worlds.deepracer.logs.errors import LogError
    from racecraft.worlds.deepracer.logs.sources import find_sources

    try:
        return files.suffix != ".py" and bool(find_sources(files))
    except (LogError, ArchiveError):
        return False
