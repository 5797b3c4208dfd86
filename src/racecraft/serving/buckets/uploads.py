"""Uploads in parts: each part a file in the bucket's folder for what arrives, until they are made one. See `Uploads`.

    .racecraft-arriving/upload-ID/key      what the object will be called
    .racecraft-arriving/upload-ID/N.MD5    part N and the digest of its bytes

They are files, so that an upload outlives the server and goes on after it has been started again.
"""

from __future__ import annotations

import contextlib
import os
import re
import secrets
import shutil
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from racecraft.serving.buckets.bucket_folder import ARRIVING, BucketFolder
from racecraft.serving.buckets.xml import S3Error

MOST_PARTS = 10_000
_PART = re.compile(r"(\d{1,5})\.([0-9a-f]{32})")
_ID = re.compile(r"[0-9a-f]{32}")
_BLOCK = 1 << 20


@dataclass(frozen=True)
class Part:
    """A part that has arrived."""

    number: int
    etag: str
    path: Path

    @property
    def size(self) -> int:
        """Bytes."""
        return self.path.stat().st_size


@dataclass(frozen=True)
class Upload:
    """An upload that is under way."""

    name: str
    key: str
    begun: float
    """Seconds since 1970 (UTC)."""


class Uploads:
    """The uploads of one bucket.

    Args:
        bucket: The bucket.
    """

    def __init__(self, bucket: BucketFolder) -> None:
        self._bucket = bucket

    def begin(self, key: str) -> str:
        """Begin one; return its name.

        Raises:
            S3Error: The key cannot be a file here.
        """
        self._bucket.require_key(key)
        name = secrets.token_hex(16)
        place = self._place(name)
        place.mkdir(parents=True)
        (place / "key").write_text(key, encoding="utf-8")
        return name

    def all(self, prefix: str) -> list[Upload]:
        """Return those of keys that begin so, by key and then by age."""
        found = []
        for place in (self._bucket.path / ARRIVING).glob("upload-*"):
            with contextlib.suppress(OSError):
                key = (place / "key").read_text(encoding="utf-8")
                if key.startswith(prefix):
                    found.append(Upload(place.name.removeprefix("upload-"), key, (place / "key").stat().st_mtime))
        return sorted(found, key=lambda upload: (upload.key, upload.begun))

    def write_part(self, name: str, key: str, number: int, pieces: Iterable[bytes], md5: str) -> str:
        """Put a part, in the place of an earlier one of that number; return its ETag.

        Raises:
            S3Error: There is no such upload, the number is none, or the body broke off.
        """
        place = self._require(name, key)
        if not 1 <= number <= MOST_PARTS:
            raise S3Error(400, "InvalidArgument", f"Part {number}; expected 1 to {MOST_PARTS}.")
        with self._bucket.arriving() as file:
            etag = self._bucket.fill(file, pieces, md5)
            for older in self._parts(place):
                if older.number == number:
                    older.path.unlink()
            os.replace(file, place / f"{number}.{etag}")
        return etag

    def parts(self, name: str, key: str) -> list[Part]:
        """Return the parts that have arrived.

        Raises:
            S3Error: There is no such upload.
        """
        return self._parts(self._require(name, key))

    def complete(self, name: str, key: str, listed: Sequence[tuple[int, str]]) -> str:
        """Make the object of the parts that are listed, by number and ETag; return its ETag.

        Raises:
            S3Error: There is no such upload, or a part that is listed has not arrived.
        """
        place = self._require(name, key)
        arrived = {part.number: part for part in self._parts(place)}
        numbers = [number for number, _ in listed]
        if not listed or numbers != sorted(set(numbers)):
            raise S3Error(400, "InvalidPartOrder", "Parts are to be listed once each, by their numbers.")
        for number, etag in listed:
            if number not in arrived or (etag and arrived[number].etag != etag):
                raise S3Error(400, "InvalidPart", f"Part {number} has not arrived, or it was another.")
        made = self._bucket.write(key, _bytes_of([arrived[number].path for number in numbers]))
        self._forget(place)
        return made

    def abort(self, name: str, key: str) -> None:
        """Take an upload away.

        Raises:
            S3Error: There is no such upload.
        """
        self._forget(self._require(name, key))

    def _forget(self, place: Path) -> None:
        shutil.rmtree(place, ignore_errors=True)
        with contextlib.suppress(OSError):
            place.parent.rmdir()

    def _require(self, name: str, key: str) -> Path:
        place = self._place(name) if _ID.fullmatch(name) else None
        with contextlib.suppress(OSError):
            if place is not None and (place / "key").read_text(encoding="utf-8") == key:
                return place
        raise S3Error(404, "NoSuchUpload", f"There is no upload {name[:40]!r} of {key!r}.")

    def _place(self, name: str) -> Path:
        return self._bucket.path / ARRIVING / f"upload-{name}"

    @staticmethod
    def _parts(place: Path) -> list[Part]:
        found = [(path, _PART.fullmatch(path.name)) for path in place.iterdir()]
        parts = [Part(int(match[1]), match[2], path) for path, match in found if match]
        return sorted(parts, key=lambda part: part.number)


def _bytes_of(paths: Sequence[Path]) -> Iterator[bytes]:
    for path in paths:
        with open(path, "rb") as file:
            while block := file.read(_BLOCK):
                yield block
