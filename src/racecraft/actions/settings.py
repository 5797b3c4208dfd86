"""List settings: of a training, or of a user's folder."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from racecraft.actions.action import action
from racecraft.contract.errors import SettingError
from racecraft.contract.progress import Progress, quiet
from racecraft.settings.request import Request, argument, option

if TYPE_CHECKING:
    from racecraft.settings.composition import Settings
    from racecraft.settings.table import Setting


@dataclass(frozen=True, kw_only=True)
class SettingsRequest(Request):
    """Which training, or which folder."""

    folder: Path | None = argument("A racer's folder: its run.env, variable by variable, and what each does.", None)
    world: str = option("deepracer", "Whose defaults, such as deepracer or gymnasium.")
    algorithm: str = option("ppo", "What learns; `racecraft algorithms` lists them.")


@dataclass(frozen=True)
class DefaultSettings:
    """What a training runs with where nothing is said."""

    settings: Settings

    def rows(self) -> list[tuple[Setting, Any]]:
        """Return every setting with its default there."""
        from racecraft.settings.table import rows_of

        groups = ((name, getattr(self.settings, name)) for name in self.settings)
        return [(row, getattr(group, row.name)) for name, group in groups for row in rows_of(group, name)]

    def as_dictionary(self) -> dict[str, Any]:
        """Return the values by group and name."""
        from racecraft.settings.overrides import as_dictionary

        return as_dictionary(self.settings)


@dataclass(frozen=True)
class FolderVariable:
    """A variable of a user's folder, and what it does here."""

    name: str
    title: str
    """Heading that it stands below: what becomes of it."""
    value: str
    effect: str
    place: str
    """FILE:LINE where it is set; empty: nowhere."""


@dataclass(frozen=True)
class FolderSettings:
    """What a user's folder sets."""

    variables: list[FolderVariable]
    figures: dict[str, Any]
    """As `--json` prints it."""

    def as_dictionary(self) -> dict[str, Any]:
        """Return the variables."""
        return self.figures


@action
def settings(request: SettingsRequest, progress: Progress = quiet) -> DefaultSettings | FolderSettings:
    """List every setting that `--set group.name=value` takes in one kind of training, with its default there.

    Of a folder of DeepRacer for Cloud: every variable, its value, its default, and what it does here or why not.

    Examples:

        racecraft settings --world gymnasium --algorithm ppo

        racecraft settings my-folder

    Raises:
        UserInputError: No installed world reads folders, or the folder cannot be used.
    """
    from racecraft.algorithms.registry import find_algorithm
    from racecraft.contract.kinds import kinds
    from racecraft.training.worlds import training_in

    if request.folder is None:
        return DefaultSettings(training_in(request.world).default_settings(find_algorithm(request.algorithm)))
    for kind in kinds():
        if kind.folder_settings:
            found: FolderSettings = kind.piece("folder_settings")(request.folder)
            return found
    raise SettingError(
        "{folder}: no installed world reads folders; expected one that does, such as deepracer.", folder=request.folder
    )
