"""Copy a model from one bucket of a DeepRacer-for-Cloud folder to another."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from racecraft.contract.errors import UserInputError
from racecraft.contract.progress import Progress
from racecraft.worlds.deepracer.actions.drfc.sync import require_free, send, wipe

if TYPE_CHECKING:
    from racecraft.storage.mirror_note import MirrorLocation
    from racecraft.worlds.deepracer.files.drfc_folder import DrfcFolder


@dataclass(frozen=True, kw_only=True)
class ModelCopy:
    """A model that is to be copied."""

    source: Path
    target: Path
    which: str | None
    """Its only checkpoint that goes along; None: all."""
    place: MirrorLocation | None = None
    """Where the copy is kept in S3; None: nowhere."""

    def description(self) -> str:
        """Return what is copied where, after a look at the model.

        Raises:
            UserInputError: There is no such model or checkpoint, or it would be copied onto itself.
        """
        from racecraft.formats.checkpoint_ranking import find_checkpoint
        from racecraft.formats.run_folder import RunFolder

        run = RunFolder.open(self.source)
        if self.target.resolve() == self.source.resolve():
            raise UserInputError(
                "{target}: is the model itself; expected another place to copy it to.", target=self.target
            )
        chosen = None if self.which is None else find_checkpoint(run, self.which)
        what = "all checkpoints" if chosen is None else f"checkpoint: {chosen.iteration} ({chosen.steps} steps)"
        return f"{self.source} to {self.target}, {what}"

    def copy(self, wipes: bool, progress: Progress) -> None:
        """Copy the model, and put the copy into its place in S3.

        Args:
            wipes: Whether what stands at the target is taken away first.
            progress: Receives messages.

        Raises:
            UserInputError: The target is not free, or the network fails.
        """
        from racecraft.formats.run_folder import RunFolder
        from racecraft.worlds.deepracer.files.model_copy import copy_model, require_empty, wipe_model

        description = self.description()
        if wipes:
            wipe_model(self.target)
            wipe(self.place, progress)
        require_empty(self.target)
        require_free(self.place)
        copy_model(RunFolder.open(self.source), self.target, self.which)
        progress(f"copied {description}")
        send(self.target, self.place, progress)


def raise_upload_prefix(drfc: DrfcFolder, dry_run: bool = False) -> str:
    """Raise the number at the end of DR_UPLOAD_S3_PREFIX in run.env; return the new prefix."""
    from racecraft.worlds.deepracer.files.run_env import edit_run_env, next_prefix

    raised = next_prefix(drfc.text("DR_UPLOAD_S3_PREFIX"))
    if not dry_run:
        edit_run_env(drfc.config, {"DR_UPLOAD_S3_PREFIX": raised})
    return raised
