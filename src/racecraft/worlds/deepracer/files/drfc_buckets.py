"""Which buckets of a DeepRacer-for-Cloud folder are S3, and where. Begin with `local_bucket` and `upload_bucket`.

A bucket is a folder of this machine until the files name something else. The local one is S3 where

    an endpoint is named      DR_LOCAL_S3_ENDPOINT_URL, DR_MINIO_URL, or with DR_CLOUD=remote DR_REMOTE_MINIO_URL
    a profile of one's own    DR_LOCAL_S3_PROFILE, other than those of the templates, `default` and `minio`
    the bucket is an address  DR_LOCAL_S3_BUCKET=s3://my-bucket

and the one for uploads by DR_UPLOAD_S3_PROFILE and DR_UPLOAD_S3_BUCKET alike. A folder then stands for it still, under
the bucket's name: it is what this machine has of it.

Source: facts: deepracer-systems.md A2 (names, templates).
"""

from __future__ import annotations

from racecraft.storage.address import Address, BucketError, is_address
from racecraft.storage.connection import WHERE_KEYS_ARE, S3Connection, require_endpoint
from racecraft.storage.mirror_note import MirrorLocation
from racecraft.worlds.deepracer.files.drfc_folder import DrfcFolder


def local_bucket(drfc: DrfcFolder) -> MirrorLocation | None:
    """Return where the local bucket is; None: it is a folder.

    Raises:
        RunEnvError: A value cannot be used; the message names file, line and variable.
    """
    if not drfc.local_is_s3:
        return None
    endpoint = _endpoint(drfc, drfc.endpoint_variable) if drfc.endpoint_variable else ""
    key, secret = drfc.text("DR_LOCAL_ACCESS_KEY_ID"), drfc.text("DR_LOCAL_SECRET_ACCESS_KEY")
    if bool(key) != bool(secret):
        name = "DR_LOCAL_ACCESS_KEY_ID" if not key else "DR_LOCAL_SECRET_ACCESS_KEY"
        raise drfc.error_at(name, "both halves of the pair of keys, or none", found="it has no value")
    by_role = drfc.text("DR_LOCAL_S3_AUTH_MODE") == "role"
    access = S3Connection(
        endpoint, "" if by_role or key else _own(drfc, "DR_LOCAL_S3_PROFILE"), _region(drfc), key, secret
    )
    return _place(drfc, "DR_LOCAL_S3_BUCKET", access)


def upload_bucket(drfc: DrfcFolder) -> MirrorLocation | None:
    """Return where the bucket for uploads is; None: it is a folder, or none is named.

    Raises:
        RunEnvError: A value cannot be used.
    """
    if not drfc.upload_is_s3:
        return None
    access = S3Connection(profile=_own(drfc, "DR_UPLOAD_S3_PROFILE"), region=_region(drfc))
    return _place(drfc, "DR_UPLOAD_S3_BUCKET", access)


def place_of(drfc: DrfcFolder, bucket: MirrorLocation, name: str) -> MirrorLocation:
    """Return the place of a prefix that a variable such as DR_LOCAL_S3_MODEL_PREFIX names.

    Raises:
        RunEnvError: It is no prefix.
    """
    try:
        whole = Address.parse(f"{bucket.address}{'/' if bucket.address.prefix else ''}{drfc.text(name)}")
    except BucketError as error:
        raise drfc.error_at(name, "a prefix of the bucket, such as my-model-2") from error
    return MirrorLocation(whole, bucket.access, bucket.installation)


def _place(drfc: DrfcFolder, name: str, access: S3Connection) -> MirrorLocation:
    written = drfc.text(name)
    try:
        address = Address.parse(written if is_address(written) else f"s3://{written}")
    except BucketError as error:
        raise drfc.error_at(name, "the name of a bucket, such as my-models or s3://my-models") from error
    if address.prefix:
        raise drfc.error_at(name, "a bucket without a prefix", "DR_LOCAL_S3_MODEL_PREFIX and its like say where in it.")
    return MirrorLocation(address, access, str(drfc.path.absolute()))


def _endpoint(drfc: DrfcFolder, name: str) -> str:
    text = drfc.text(name)
    if "@" in text:
        found = "keys stand before its '@', which would be printed and written down"
        raise drfc.error_at(name, "the address alone, such as http://localhost:9000", WHERE_KEYS_ARE, found=found)
    try:
        return require_endpoint(text, name)
    except BucketError as error:
        raise drfc.error_at(name, "the address of a store, such as http://localhost:9000") from error


def _own(drfc: DrfcFolder, name: str) -> str:
    """Return the profile to ask for; `default` is what botocore takes by itself, where it stands."""
    profile = drfc.text(name)
    return "" if profile == "default" else profile


def _region(drfc: DrfcFolder) -> str:
    return drfc.text("DR_AWS_APP_REGION")
