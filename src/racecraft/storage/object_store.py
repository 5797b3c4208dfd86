"""Object stores by boto3. Everything else here speaks to an `ObjectStore`.

botocore repeats a request that the network broke off, ever more slowly. s3transfer moves files, large ones in parts.
What stays broken is a `NetworkError`; what is refused is a `BucketError` that says by whom and what to do.
"""

from __future__ import annotations

import contextlib
import glob
import os
import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

from racecraft.contract.errors import MissingExtraError, UserInputError
from racecraft.formats.atomic import OutputFileError, make_folder, output_error
from racecraft.storage.address import Address, BucketError
from racecraft.storage.connection import WHERE_KEYS_ARE, S3Connection
from racecraft.storage.etags import PART_BYTES, is_same

INSTALL = "pip install 'racecraft[s3]'"
CONNECT_SECONDS, READ_SECONDS = 10, 60
"""How long an answer is waited for before the network counts as broken."""
ATTEMPTS = 4
"""How often a request is sent before the network counts as broken: about 4 seconds in all, where nothing answers."""
MAX_LINK_SECONDS = 7 * 24 * 3600
"""Longest that a presigned link of signature version 4 is valid."""
MAX_WAIT_SECONDS = 10.0
"""Between two attempts to fetch an object."""
PARTIAL = ".partial-"
"""Part of the name of a file that has not arrived whole."""
_SIGNED_WRONG = ("InvalidAccessKeyId", "SignatureDoesNotMatch", "InvalidToken", "ExpiredToken", "RequestTimeTooSkewed")
_BUSY = ("SlowDown", "InternalError", "ServiceUnavailable", "RequestTimeout", "OperationAborted", "BadDigest")


class NetworkError(BucketError):
    """A store did not answer, or broke off: the request may be sent again."""


@dataclass(frozen=True)
class StoredObject:
    """What a store tells of an object."""

    size: int
    """Bytes."""
    etag: str
    """Without its quotes."""
    modified: float = 0.0
    """Seconds since 1970 (UTC)."""


class Objects(Protocol):
    """What transfers and mirrors need of a store."""

    def listed(self, place: Address) -> dict[str, StoredObject]:
        """Return the objects below a place, by their name below it."""
        ...

    def find(self, bucket: str, key: str) -> StoredObject | None:
        """Return what is told of one object; None where there is none."""
        ...

    def put(self, bucket: str, key: str, path: Path) -> None:
        """Put a file, whole or not at all."""
        ...

    def get(self, bucket: str, key: str, stored: StoredObject, path: Path) -> None:
        """Fetch an object into a file, whole or not at all."""
        ...

    def write(self, bucket: str, key: str, data: bytes) -> None:
        """Put bytes."""
        ...

    def remove(self, bucket: str, keys: Sequence[str]) -> None:
        """Take objects away; of one that is not there nothing is said."""
        ...


class ObjectStore:
    """A store behind boto3. Errors of every method: `NetworkError`, `BucketError`.

    Args:
        access: Where it is, and who asks.
        attempts: How often a request is sent before the network counts as broken.

    Raises:
        MissingExtraError: boto3 is not installed.
        BucketError: The profile is not known.
    """

    def __init__(self, access: S3Connection, attempts: int = ATTEMPTS) -> None:
        try:
            import boto3
            from boto3.s3.transfer import TransferConfig
            from botocore.config import Config
        except ImportError:
            raise MissingExtraError(
                "boto3 is not installed; expected it for buckets elsewhere. Run: {install}", install=INSTALL
            ) from None
        self.access, self._attempts = access, attempts
        with self._as_our_errors(""):
            session = boto3.Session(
                profile_name=access.profile or None,
                aws_access_key_id=access.key or None,
                aws_secret_access_key=access.secret or None,
                region_name=access.region or None,
            )
            self._s3 = session.client(
                "s3",
                endpoint_url=access.endpoint or None,
                config=Config(
                    signature_version="s3v4",
                    retries={"mode": "standard", "total_max_attempts": attempts},
                    connect_timeout=CONNECT_SECONDS,
                    read_timeout=READ_SECONDS,
                    # stores beside AWS's know no bucket as a host's name, and no trailing checksums
                    s3={"addressing_style": "path"} if access.endpoint else {},
                    request_checksum_calculation="when_required",
                    response_checksum_validation="when_required",
                ),
            )
        self._transfers = TransferConfig(
            multipart_threshold=PART_BYTES + 1,
            multipart_chunksize=PART_BYTES,
            use_threads=False,
        )

    def buckets(self) -> list[str]:
        """Return the names of the buckets that this account sees."""
        with self._as_our_errors(""):
            return [str(one["Name"]) for one in self._s3.list_buckets().get("Buckets", ())]

    def listed(self, place: Address) -> dict[str, StoredObject]:
        """Return the objects below a place, by their name below it; what only stands for a folder is none."""
        found: dict[str, StoredObject] = {}
        pages = self._s3.get_paginator("list_objects_v2")
        with self._as_our_errors(place.bucket):
            for page in pages.paginate(Bucket=place.bucket, Prefix=place.key("")):
                for one in page.get("Contents", ()):
                    name = place.name(str(one["Key"]))
                    if name and not name.endswith("/"):
                        found[name] = _object_of(one, int(one["Size"]))
        return found

    def find(self, bucket: str, key: str) -> StoredObject | None:
        """Return what is told of one object; None where there is none."""
        try:
            with self._as_our_errors(bucket):
                answer = self._s3.head_object(Bucket=bucket, Key=key)
        except NoSuchObjectError:
            return None
        return _object_of(answer, int(answer["ContentLength"]))

    def put(self, bucket: str, key: str, path: Path) -> None:
        """Put a file, as long as it is now; one above 8 MiB in parts of 8 MiB.

        Raises:
            UserInputError: The file cannot be read.
        """
        try:
            with self._as_our_errors(bucket):
                self._s3.upload_file(str(path), bucket, key, Config=self._transfers)
        except OSError as error:
            raise UserInputError(
                "{path}: cannot be read ({strerror}); expected a file to put.", path=path, strerror=error.strerror
            ) from error

    def get(self, bucket: str, key: str, stored: StoredObject, path: Path) -> None:
        """Fetch an object into a file, which takes its place in one move when all of it has come.

        Raises:
            NetworkError: Besides, it changed meanwhile, or what came has another sum.
            OutputFileError: The file cannot be written.
        """
        make_folder(path.parent)
        part = path.with_name(f".{path.name}{PARTIAL}{os.getpid()}")
        try:
            for old in path.parent.glob(f".{glob.escape(path.name)}{PARTIAL}*"):
                old.unlink()  # of a transfer that was broken off
            self._fetch(bucket, key, stored.etag, part)
            if not is_same(part, stored.size, stored.etag) and not self._is_still(bucket, key, stored, part):
                part.unlink()
                raise NetworkError(
                    "s3://{bucket}/{key}: what came is not the object of {size} bytes and ETag {etag}; "
                    "expected an object that stays as it is meanwhile.",
                    bucket=bucket,
                    key=key,
                    size=stored.size,
                    etag=stored.etag,
                )
            os.replace(part, path)
        except OSError as error:
            part.unlink(missing_ok=True)
            raise OutputFileError(output_error(path, error)) from error

    def write(self, bucket: str, key: str, data: bytes) -> None:
        """Put bytes."""
        with self._as_our_errors(bucket):
            self._s3.put_object(Bucket=bucket, Key=key, Body=data)

    def remove(self, bucket: str, keys: Sequence[str]) -> None:
        """Take objects away; of one that is not there nothing is said."""
        with self._as_our_errors(bucket):
            for key in keys:  # not every store knows the request for many at once
                self._s3.delete_object(Bucket=bucket, Key=key)

    def link(self, bucket: str, key: str, seconds: int) -> str:
        """Return a presigned link, by which anybody fetches the object for so many seconds.

        Raises:
            BucketError: Besides, it would be valid for less than a second or more than 7 days.
        """
        if not 1 <= seconds <= MAX_LINK_SECONDS:
            raise BucketError(
                "s3://{bucket}/{key}: a link of {seconds} s; expected 1 to {max_link_seconds} s, which is 7 days: "
                "stores refuse an older signature. Make a new link then.",
                bucket=bucket,
                key=key,
                seconds=seconds,
                max_link_seconds=MAX_LINK_SECONDS,
            )
        with self._as_our_errors(bucket):
            target = {"Bucket": bucket, "Key": key}
            return str(self._s3.generate_presigned_url("get_object", Params=target, ExpiresIn=seconds))

    def _fetch(self, bucket: str, key: str, etag: str, part: Path) -> None:
        """Write the object that has this ETag to a file; anew where the network breaks off on the way."""
        for attempt in range(1, self._attempts + 1):
            try:
                with self._as_our_errors(bucket), open(part, "wb") as file:
                    answer = self._s3.get_object(Bucket=bucket, Key=key, IfMatch=f'"{etag}"')
                    for block in answer["Body"].iter_chunks(PART_BYTES):
                        file.write(block)
                return
            except NetworkError:
                if attempt == self._attempts:
                    part.unlink(missing_ok=True)
                    raise
                time.sleep(min(0.5 * 2.0**attempt, MAX_WAIT_SECONDS))

    def _is_still(self, bucket: str, key: str, stored: StoredObject, part: Path) -> bool:
        """Tell whether the object is what it was, for an ETag that is no sum of its bytes."""
        is_a_sum = len(stored.etag.partition("-")[0]) == 32 and "-" not in stored.etag
        return not is_a_sum and part.stat().st_size == stored.size and self.find(bucket, key) == stored

    @contextlib.contextmanager
    def _as_our_errors(self, bucket: str) -> Iterator[None]:
        """Turn what boto3, botocore and s3transfer raise into our letters; an OSError is about a file of ours."""
        try:
            yield
        except (BucketError, OSError):
            raise
        except Exception as error:  # three libraries' families of errors, with no common parent but this one
            raise _error_of(error, bucket, self.access) from error


class NoSuchObjectError(BucketError):
    """There is no such object, or no such bucket."""


class UnknownRequestError(BucketError):
    """The store does not know what it was asked for."""


def _object_of(answer: Mapping[str, Any], size: int) -> StoredObject:
    moment = answer.get("LastModified")
    return StoredObject(size, str(answer.get("ETag", "")).strip('"'), moment.timestamp() if moment else 0.0)


def _error_of(error: Exception, bucket: str, access: S3Connection) -> BucketError:
    """Return the error about what went wrong."""
    where = access.endpoint or "AWS"
    place = f"s3://{bucket}" if bucket else where
    source = next((one for one in (error, error.__cause__, error.__context__) if hasattr(one, "response")), None)
    response = getattr(source, "response", None) or {}
    details = response.get("Error", {})
    code, status = str(details.get("Code", "")), response.get("ResponseMetadata", {}).get("HTTPStatusCode", 0)
    kind = type(error).__name__
    if kind in ("ProfileNotFound", "NoCredentialsError", "PartialCredentialsError", "CredentialRetrievalError"):
        return BucketError(
            "{where}: who asks is not known ({short}); expected the keys of an account of it. {where_keys_are}",
            where=where,
            short=_short(error),
            where_keys_are=WHERE_KEYS_ARE,
        )
    if kind == "NoRegionError":
        return BucketError(
            "{where}: no region is known; expected --region, AWS_REGION or DR_AWS_APP_REGION.", where=where
        )
    if code == "NoSuchBucket":
        return NoSuchObjectError(
            "{place}: there is no such bucket at {where}; expected one that stands. `racecraft bucket "
            "list{words}` names those that do.",
            place=place,
            where=where,
            words=access.options_text,
        )
    if code in _SIGNED_WRONG:
        return BucketError(
            "{place}: {where} does not take the keys ({code}); expected those of an account of it. "
            "Look at this machine's clock, too. {where_keys_are}",
            place=place,
            where=where,
            code=code,
            where_keys_are=WHERE_KEYS_ARE,
        )
    if status == 403 or code == "AccessDenied":
        return BucketError(
            "{place}: {where} refuses it ({note}); expected the right to "
            "list, read and write there. Look at the profile and at the bucket's policy.",
            place=place,
            where=where,
            note=code if code not in ("", "403") else "forbidden",
        )
    if status == 501 or code == "NotImplemented":
        return UnknownRequestError(
            "{place}: {where} does not know what it was asked for ({short}); expected one that does. What is "
            "asked of a store stands in docs/racing/buckets.md.",
            place=place,
            where=where,
            short=_short(error),
        )
    if status >= 500 or status == 429 or code in _BUSY:
        return NetworkError(
            "{place}: {where} cannot answer just now ({code}); expected an answer.",
            place=place,
            where=where,
            code=code or status,
        )
    if status == 404:
        return NoSuchObjectError("{place}: there is no such object; expected one that stands.", place=place)
    if status == 412:
        return NetworkError(
            "{place}: an object was changed while it was read; expected it to stay as it is.", place=place
        )
    if response:
        return BucketError(
            "{place}: {where} refuses it ({code}: {short}); expected it to be done.",
            place=place,
            where=where,
            code=code or status,
            short=_short(error),
        )
    return NetworkError(
        "{place}: {where} does not answer ({kind}: {short}); expected a store there.",
        place=place,
        where=where,
        kind=kind,
        short=_short(error),
    )


def _short(error: Exception) -> str:
    return " ".join(str(error).split())[:160] or "nothing more is told"
