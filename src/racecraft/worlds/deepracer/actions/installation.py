"""A DeepRacer-for-Cloud folder as the installation whose buckets a command uses. Begin with `open_installation`."""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from racecraft.actions.mirroring import is_needed_to_drive
from racecraft.actions.stores import open_store
from racecraft.storage.address import Address, is_address
from racecraft.storage.connection import S3Connection
from racecraft.storage.mirror_note import MirrorLocation
from racecraft.worlds.deepracer.files.drfc_buckets import local_bucket, place_of, upload_bucket
from racecraft.worlds.deepracer.files.drfc_folder import RUN_ENV, DrfcFolder, open_drfc_folder

Tell = Callable[[str], None]


@dataclass(frozen=True)
class DrfcInstallation:
    """The buckets of a DeepRacer-for-Cloud folder, as `actions.stores.Installation`."""

    drfc: DrfcFolder

    def access(self, address: Address | None) -> S3Connection | None:
        """Return how an address is reached: as that of its two buckets whose name it has, else as the local one."""
        local = local_bucket(self.drfc)
        for place in (local, upload_bucket(self.drfc)):
            if place is not None and address is not None and place.address.bucket == address.bucket:
                return place.access
        return None if local is None else local.access

    def mirror(self, tell: Tell) -> MirrorLocation | None:
        """Fetch what a training lacks from the local bucket, and return where the model is kept; None: in no S3.

        Raises:
            UserInputError: Something is not there, or the network fails.
        """
        bucket = local_bucket(self.drfc)
        if bucket is None:
            return None
        bring_in(self.drfc, bucket, self.drfc.path, tell, missing_only=True)
        return place_of(self.drfc, bucket, "DR_LOCAL_S3_MODEL_PREFIX")

    def folders(self) -> dict[str, Path]:
        """Return the folders that stand for its buckets, by the bucket's name."""
        drfc = self.drfc
        found = {drfc.bucket.name: drfc.bucket}
        if drfc.text("DR_UPLOAD_S3_BUCKET"):
            found.setdefault(drfc.upload_bucket.name, drfc.upload_bucket)
        return found


def open_installation(folder: Path) -> DrfcInstallation | None:
    """Return the DeepRacer-for-Cloud folder that stands there; None where there is none.

    Raises:
        UserInputError: A file in it cannot be used.
    """
    if not (folder / RUN_ENV).is_file():
        return None
    return DrfcInstallation(open_drfc_folder(folder, shell=os.environ))


def bring_in(drfc: DrfcFolder, bucket: MirrorLocation, into: Path, tell: Tell, missing_only: bool = False) -> None:
    """Fetch what a training reads: the racer's files, and the model it begins with.

    Args:
        drfc: The installation.
        bucket: Where its local bucket is.
        into: The folder that stands for it.
        tell: Says a line.
        missing_only: Whether racer's files that stand in the folder stay as they are.

    Raises:
        UserInputError: Something is not there, or the network fails.
    """
    from racecraft.storage.transfer import pull

    store = open_store(bucket.access)
    files = place_of(drfc, bucket, "DR_LOCAL_S3_CUSTOM_FILES_PREFIX").address
    target = into / files.prefix
    there = {path.relative_to(target).as_posix() for path in target.rglob("*")} if missing_only else set()
    if store.listed(files) or not missing_only:
        done = pull(store, files, target, chosen=lambda name: name not in there)
        tell(f"{files}: {len(done.moved)} files fetched, {done.skipped} as they are here")
    if drfc.flag("DR_LOCAL_S3_PRETRAINED"):
        written = drfc.text("DR_LOCAL_S3_PRETRAINED_PREFIX")
        model = Address.parse(written) if is_address(written) else bucket.address.below(written)
        if store.listed(model):  # else it is a path of this machine
            done = pull(store, model, into / model.prefix, chosen=is_needed_to_drive)
            tell(f"{model}: the model to begin with, {len(done.moved)} files fetched, {done.skipped} as they are here")
