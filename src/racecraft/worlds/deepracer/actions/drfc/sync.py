"""A DeepRacer-for-Cloud folder and its buckets where they are S3: folders here are what this machine has of them."""

from __future__ import annotations

import shlex
from pathlib import Path
from typing import TYPE_CHECKING

from racecraft.actions.stores import open_store
from racecraft.contract.progress import Progress

if TYPE_CHECKING:
    from racecraft.storage.mirror_note import MirrorLocation
    from racecraft.worlds.deepracer.files.drfc_folder import DrfcFolder

CUSTOM, MODEL, UPLOAD = "DR_LOCAL_S3_CUSTOM_FILES_PREFIX", "DR_LOCAL_S3_MODEL_PREFIX", "DR_UPLOAD_S3_PREFIX"


def send_custom_files(drfc: DrfcFolder, progress: Progress) -> None:
    """Put the racer's files into the bucket, where it is S3.

    Raises:
        UserInputError: The store refuses it, or the network fails.
    """
    if (place := _local(drfc, CUSTOM)) is not None:
        _send(drfc.custom_prefix, place, progress)


def fetch_custom_files(drfc: DrfcFolder, progress: Progress) -> None:
    """Fetch the racer's files into the folder that stands for the bucket, where it is S3.

    Raises:
        UserInputError: There are none, or the network fails.
    """
    if (place := _local(drfc, CUSTOM)) is not None:
        _fetch(place, drfc.custom_prefix, progress)


def fetch_for_training(drfc: DrfcFolder, progress: Progress) -> None:
    """Fetch what a training reads, where the bucket is S3.

    Raises:
        UserInputError: Something is not there, or the network fails.
    """
    if not drfc.local_is_s3:
        return
    from racecraft.worlds.deepracer.actions.installation import bring_in
    from racecraft.worlds.deepracer.files.drfc_buckets import local_bucket

    if (bucket := local_bucket(drfc)) is not None:
        bring_in(drfc, bucket, drfc.bucket, progress)


def place_of_model(drfc: DrfcFolder) -> MirrorLocation | None:
    """Return where the model is kept beside its run folder; None: nowhere."""
    return _local(drfc, MODEL)


def place_in_bucket(drfc: DrfcFolder, prefix: str) -> MirrorLocation | None:
    """Return where a prefix that was typed is kept beside its folder; None: nowhere."""
    from racecraft.storage.mirror_note import MirrorLocation
    from racecraft.worlds.deepracer.files.drfc_buckets import local_bucket

    bucket = local_bucket(drfc)
    return None if bucket is None else MirrorLocation(bucket.address.below(prefix), bucket.access, bucket.installation)


def require_free(place: MirrorLocation | None) -> None:
    """Refuse a prefix of S3 that holds objects.

    Raises:
        BucketError: It does.
    """
    from racecraft.storage.address import BucketError

    if place is not None and (found := open_store(place.access).listed(place.address)):
        raise BucketError(
            "{address}: holds {count} objects already; expected a free prefix. Give another, or wipe it with -w.",
            address=place.address,
            count=len(found),
        )


def wipe(place: MirrorLocation | None, progress: Progress) -> None:
    """Take all objects of a prefix of S3 away.

    Raises:
        UserInputError: The store refuses it, or the network fails.
    """
    if place is None:
        return
    store = open_store(place.access)
    found = store.listed(place.address)
    if found:
        store.remove(place.address.bucket, [place.address.key(name) for name in found])
        progress(f"{place.address}: wiped, {len(found)} objects")


def place_of_upload(drfc: DrfcFolder, local: bool) -> MirrorLocation | None:
    """Return where an upload goes beside its folder; None: nowhere.

    Args:
        drfc: The installation.
        local: Whether it goes into the local bucket.
    """
    from racecraft.worlds.deepracer.files.drfc_buckets import place_of, upload_bucket

    if local:
        return _local(drfc, UPLOAD)
    bucket = upload_bucket(drfc)
    return None if bucket is None else place_of(drfc, bucket, UPLOAD)


def send(folder: Path, place: MirrorLocation | None, progress: Progress) -> None:
    """Put a folder into its place in S3, where there is one; what the network did not take, an error tells.

    Raises:
        UserInputError: The store refuses it, or the network fails.
    """
    if place is not None:
        _send(folder, place, progress)


def fetched_model(drfc: DrfcFolder, source: str, progress: Progress) -> Path:
    """Return the folder of a model that is named by its address, fetched first where its bucket is S3.

    Raises:
        UserInputError: There is no such model, or the network fails.
    """
    from racecraft.storage.address import Address
    from racecraft.storage.mirror_note import MirrorLocation
    from racecraft.worlds.deepracer.files.drfc_buckets import local_bucket, upload_bucket

    if not (drfc.local_is_s3 or drfc.upload_is_s3):
        return drfc.in_bucket(source)
    address = Address.parse(source)
    for bucket in (local_bucket(drfc), upload_bucket(drfc)):
        if bucket is not None and bucket.address.bucket == address.bucket:
            folder = drfc.in_bucket(source)
            _fetch(MirrorLocation(address, bucket.access), folder, progress)
            return folder
    return drfc.in_bucket(source)


def _local(drfc: DrfcFolder, name: str) -> MirrorLocation | None:
    if not drfc.local_is_s3:
        return None
    from racecraft.worlds.deepracer.files.drfc_buckets import local_bucket, place_of

    bucket = local_bucket(drfc)
    return None if bucket is None else place_of(drfc, bucket, name)


def _send(folder: Path, place: MirrorLocation, progress: Progress) -> None:
    from racecraft.storage.object_store import NetworkError
    from racecraft.storage.transfer import push

    try:
        done = push(open_store(place.access), folder, place.address)
    except NetworkError as error:
        hint = f"racecraft bucket push {shlex.quote(str(folder))} {place.command}"
        raise NetworkError(
            "{error} {folder} is whole; `{hint}` brings the rest there.", error=error, folder=folder, hint=hint
        ) from error
    progress(f"{place.address}: {len(done.moved)} files put, {done.skipped} stood there already")


def _fetch(place: MirrorLocation, folder: Path, progress: Progress) -> None:
    from racecraft.storage.transfer import pull

    done = pull(open_store(place.access), place.address, folder)
    progress(f"{place.address}: {len(done.moved)} files fetched into {folder}, {done.skipped} stood there already")
