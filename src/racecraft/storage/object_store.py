"""The one door to object stores: s3fs, and behind it botocore. Everything else here speaks to an `ObjectStore`.

A call is one request and is not repeated here: s3fs and botocore are told to try once, so that there is one patience
(`retrying.py`) and not three that multiply. What the network did is a `NetworkError`; what was refused is a
`BucketError` that says by whom and what to do.
"""

from __future__ import annotations

import contextlib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Protocol

from racecraft.contract.errors import MissingExtraError
from racecraft.storage.access import WHERE_KEYS_ARE, Access
from racecraft.storage.address import Address, BucketError
from racecraft.storage.retrying import NetworkError

INSTALL = "pip install 'racecraft[s3]'"
CONNECT_SECONDS, READ_SECONDS = 10, 60
"""How long an answer is waited for before the network counts as broken."""
_SIGNED_WRONG = ("InvalidAccessKeyId", "SignatureDoesNotMatch", "InvalidToken", "ExpiredToken", "RequestTimeTooSkewed")
_BUSY = ("SlowDown", "InternalError", "ServiceUnavailable", "RequestTimeout", "OperationAborted", "BadDigest")


@dataclass(frozen=True)
class StoredObject:
    """What a store tells of an object."""

    size: int
    """Bytes."""
    etag: str
    """Without its quotes."""
    modified: float = 0.0
    """Seconds since 1970 (UTC)."""


@dataclass(frozen=True)
class StoredPart:
    """A part of an upload that is not complete yet."""

    number: int
    """Counted from 1."""
    etag: str
    size: int


class Objects(Protocol):
    """What is asked of a store."""

    def listed(self, place: Address) -> dict[str, StoredObject]:
        """Return the objects below a place, by their name below it."""
        ...

    def find(self, bucket: str, key: str) -> StoredObject | None:
        """Return what is told of one object; None where there is none."""
        ...

    def read(self, bucket: str, key: str, begin: int, end: int, etag: str) -> bytes:
        """Return bytes from `begin` up to `end` of the object that has this ETag still."""
        ...

    def write(self, bucket: str, key: str, data: bytes) -> None:
        """Put an object in one piece."""
        ...

    def remove(self, bucket: str, keys: Sequence[str]) -> None:
        """Take objects away; of one that is not there nothing is said."""
        ...

    def begun_upload(self, bucket: str, key: str) -> str | None:
        """Return the latest upload of a key that was begun and not completed."""
        ...

    def begin_upload(self, bucket: str, key: str) -> str:
        """Begin an upload in parts; return its name."""
        ...

    def parts(self, bucket: str, key: str, upload: str) -> dict[int, StoredPart]:
        """Return the parts that have arrived, by number."""
        ...

    def write_part(self, bucket: str, key: str, upload: str, number: int, data: bytes) -> StoredPart:
        """Put one part."""
        ...

    def complete_upload(self, bucket: str, key: str, upload: str, parts: Sequence[StoredPart]) -> None:
        """Make the object of its parts."""
        ...


class ObjectStore:
    """A store behind s3fs. Errors of every method: `NetworkError`, `BucketError`.

    Args:
        access: Where it is, and who asks.

    Raises:
        MissingExtraError: s3fs is not installed.
        BucketError: The profile is not known.
    """

    def __init__(self, access: Access) -> None:
        try:
            from s3fs import S3FileSystem
        except ImportError:
            raise MissingExtraError(
                f"s3fs is not installed; expected it for buckets elsewhere. Run: {INSTALL}"
            ) from None
        self.access = access
        named = {"endpoint_url": access.endpoint, "profile": access.profile, "key": access.key, "secret": access.secret}
        self._s3 = S3FileSystem(
            **{name: value for name, value in named.items() if value},
            client_kwargs={"region_name": access.region} if access.region else {},
            config_kwargs={
                "retries": {"total_max_attempts": 1},
                "connect_timeout": CONNECT_SECONDS,
                "read_timeout": READ_SECONDS,
                # stores beside AWS's know no bucket as a host's name, and no trailing checksums
                "s3": {"addressing_style": "path"} if access.endpoint else {},
                "request_checksum_calculation": "when_required",
                "response_checksum_validation": "when_required",
            },
            skip_instance_cache=True,
            use_listings_cache=False,
        )
        self._s3.retries = 1

    def buckets(self) -> list[str]:
        """Return the buckets that are to be seen."""
        answer = self._ask("", "list_buckets")
        return [str(one["Name"]) for one in answer.get("Buckets", ())]

    def listed(self, place: Address) -> dict[str, StoredObject]:
        """Return the objects below a place, by their name below it; what only stands for a folder is none."""
        found: dict[str, StoredObject] = {}
        for page in self._pages("list_objects_v2", place.bucket, place.key("")):
            for one in page.get("Contents", ()):
                name = place.name(str(one["Key"]))
                if name and not name.endswith("/"):
                    found[name] = _told(one, int(one["Size"]))
        return found

    def find(self, bucket: str, key: str) -> StoredObject | None:
        """Return what is told of one object; None where there is none."""
        try:
            answer = self._ask(bucket, "head_object", Key=key)
        except NoSuchObjectError:
            return None
        return _told(answer, int(answer["ContentLength"]))

    def read(self, bucket: str, key: str, begin: int, end: int, etag: str) -> bytes:
        """Return bytes from `begin` up to `end` of the object that has this ETag still."""
        from fsspec.asyn import sync

        async def fetch() -> bytes:
            asked = {"Bucket": bucket, "Key": key, "Range": f"bytes={begin}-{end - 1}", "IfMatch": f'"{etag}"'}
            answer = await self._s3._call_s3("get_object", **asked)  # its body can only be read where it was asked
            async with answer["Body"] as body:
                return bytes(await body.read())

        with self._letters(bucket):
            data = bytes(sync(self._s3.loop, fetch))
        if len(data) != end - begin:
            raise NetworkError(f"s3://{bucket}/{key}: {len(data)} bytes of {end - begin} came; expected all of them.")
        return data

    def write(self, bucket: str, key: str, data: bytes) -> None:
        """Put an object in one piece."""
        self._ask(bucket, "put_object", Key=key, Body=data)

    def remove(self, bucket: str, keys: Sequence[str]) -> None:
        """Take objects away; of one that is not there nothing is said."""
        for key in keys:  # the request for many at once is one that not every store knows
            self._ask(bucket, "delete_object", Key=key)

    def begun_upload(self, bucket: str, key: str) -> str | None:
        """Return the latest upload of a key that was begun and not completed."""
        try:
            answer = self._ask(bucket, "list_multipart_uploads", Prefix=key)
        except (UnknownRequestError, NoSuchObjectError):  # cannot say what it has, or says "none" so (rclone's)
            return None
        ours = [one for one in answer.get("Uploads", ()) if one["Key"] == key]
        return str(max(ours, key=lambda one: one["Initiated"])["UploadId"]) if ours else None

    def begin_upload(self, bucket: str, key: str) -> str:
        """Begin an upload in parts; return its name."""
        return str(self._ask(bucket, "create_multipart_upload", Key=key)["UploadId"])

    def parts(self, bucket: str, key: str, upload: str) -> dict[int, StoredPart]:
        """Return the parts that have arrived, by number."""
        found: dict[int, StoredPart] = {}
        marker: dict[str, Any] = {}
        while True:
            answer = self._ask(bucket, "list_parts", Key=key, UploadId=upload, **marker)
            for one in answer.get("Parts", ()):
                number = int(one["PartNumber"])
                found[number] = StoredPart(number, str(one["ETag"]).strip('"'), int(one["Size"]))
            if not answer.get("IsTruncated"):
                return found
            marker = {"PartNumberMarker": answer["NextPartNumberMarker"]}

    def write_part(self, bucket: str, key: str, upload: str, number: int, data: bytes) -> StoredPart:
        """Put one part."""
        answer = self._ask(bucket, "upload_part", Key=key, UploadId=upload, PartNumber=number, Body=data)
        return StoredPart(number, str(answer["ETag"]).strip('"'), len(data))

    def complete_upload(self, bucket: str, key: str, upload: str, parts: Sequence[StoredPart]) -> None:
        """Make the object of its parts."""
        listed = [{"PartNumber": part.number, "ETag": f'"{part.etag}"'} for part in parts]
        self._ask(bucket, "complete_multipart_upload", Key=key, UploadId=upload, MultipartUpload={"Parts": listed})

    def _pages(self, request: str, bucket: str, prefix: str) -> Iterator[Mapping[str, Any]]:
        more: dict[str, Any] = {}
        while True:
            page = self._ask(bucket, request, Prefix=prefix, **more)
            yield page
            if not page.get("IsTruncated"):
                return
            more = {"ContinuationToken": page["NextContinuationToken"]}

    def _ask(self, bucket: str, request: str, **asked: Any) -> Mapping[str, Any]:
        with self._letters(bucket):
            if bucket:
                asked["Bucket"] = bucket
            answer: Mapping[str, Any] = self._s3.call_s3(request, **asked)
            return answer

    @contextlib.contextmanager
    def _letters(self, bucket: str) -> Iterator[None]:
        """Turn what s3fs, botocore and aiohttp raise into our letters."""
        try:
            yield
        except BucketError:
            raise
        except Exception as error:  # three libraries' families of errors, with no common parent but this one
            raise _letter(error, bucket, self.access) from error


class NoSuchObjectError(BucketError):
    """There is no such object, or no such bucket."""


class UnknownRequestError(BucketError):
    """The store does not know what it was asked for."""


def _told(answer: Mapping[str, Any], size: int) -> StoredObject:
    moment = answer.get("LastModified")
    return StoredObject(size, str(answer.get("ETag", "")).strip('"'), moment.timestamp() if moment else 0.0)


def _letter(error: Exception, bucket: str, access: Access) -> BucketError:
    """Return the letter about what went wrong."""
    where = access.endpoint or "AWS"
    place = f"s3://{bucket}" if bucket else where
    response = getattr(error.__cause__, "response", None) or getattr(error, "response", None) or {}
    told = response.get("Error", {})
    code, status = str(told.get("Code", "")), response.get("ResponseMetadata", {}).get("HTTPStatusCode", 0)
    kind = type(error).__name__
    if kind in ("ProfileNotFound", "NoCredentialsError", "PartialCredentialsError", "CredentialRetrievalError"):
        return BucketError(
            f"{where}: who asks is not known ({_short(error)}); expected the keys of an account of it. {WHERE_KEYS_ARE}"
        )
    if kind == "NoRegionError":
        return BucketError(f"{where}: no region is known; expected --region, AWS_REGION or DR_AWS_APP_REGION.")
    if code == "NoSuchBucket":
        return NoSuchObjectError(
            f"{place}: there is no such bucket at {where}; expected one that stands. `racecraft bucket "
            f"list{access.words}` names those that do."
        )
    if code in _SIGNED_WRONG:
        return BucketError(
            f"{place}: {where} does not take the keys ({code}); expected those of an account of it. "
            f"Look at this machine's clock, too. {WHERE_KEYS_ARE}"
        )
    if status == 403 or code == "AccessDenied" or isinstance(error, PermissionError):
        return BucketError(
            f"{place}: {where} refuses it ({code if code not in ('', '403') else 'forbidden'}); expected the right to "
            "list, read and write there. Look at the profile and at the bucket's policy."
        )
    if status == 501 or code == "NotImplemented":
        return UnknownRequestError(
            f"{place}: {where} does not know what it was asked for ({_short(error)}); expected one that does. What is "
            "asked of a store stands in docs/racing/buckets.md."
        )
    if status >= 500 or status == 429 or code in _BUSY:
        return NetworkError(f"{place}: {where} cannot answer just now ({code or status}); expected an answer.")
    if isinstance(error, FileNotFoundError) or status == 404:
        return NoSuchObjectError(f"{place}: there is no such object; expected one that stands.")
    if status == 412:
        return NetworkError(f"{place}: an object was changed while it was read; expected it to stay as it is.")
    if response:
        return BucketError(f"{place}: {where} refuses it ({code or status}: {_short(error)}); expected it to be done.")
    return NetworkError(f"{place}: {where} does not answer ({kind}: {_short(error)}); expected a store there.")


def _short(error: Exception) -> str:
    return " ".join(str(error).split())[:160] or "nothing more is told"
