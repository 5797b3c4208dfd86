"""Which installation of DeepRacer for Cloud a dr- command is about: options that all of them share."""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path

from racecraft.contract.progress import Progress
from racecraft.settings.request import Request, group, option
from racecraft.worlds.deepracer.files.drfc_folder import DrfcFolder, open_drfc_folder

EXPERIMENT = "RACECRAFT_DR_EXPERIMENT"
"""Variable of the shell in which `bin/activate.sh -e NAME` leaves the name."""


@dataclass(frozen=True, kw_only=True)
class Installation(Request):
    """An installation as it is named."""

    folder: Path = option(Path("."), "The installation: a folder with run.env.", variable="DR_DIR")
    config: Path | None = option(None, "The run.env that counts.", variable="DR_CONFIG")
    experiment: str | None = option(None, "A folder below experiments/ whose files come first.", variable=EXPERIMENT)

    def open(self) -> DrfcFolder:
        """Read its settings; variables of the shell come before those of the files.

        Raises:
            UserInputError: There is none, or its files cannot be used.
        """
        return open_drfc_folder(self.folder, self.config, self.experiment, os.environ)

    def open_files(self) -> DrfcFolder:
        """Read its settings as the files have them, without the shell."""
        return open_drfc_folder(self.folder, self.config, self.experiment)


@dataclass(frozen=True, kw_only=True)
class InstallationRequest(Request):
    """Which installation."""

    installation: Installation = group(Installation)

    def open(self, progress: Progress) -> DrfcFolder:
        """Read the installation and report what was noticed.

        Raises:
            UserInputError: There is none, or its files cannot be used.
        """
        drfc = self.installation.open()
        for note in drfc.notes:
            progress(f"- {note}")
        return drfc
