"""Addresses of objects, and which of their keys may become files of this machine.

Keys are any text; files are not. A key that would leave its folder, that two systems read differently, or that clashes
with another one on this disk is refused by name, before anything is written.
"""

from __future__ import annotations

import os
import re
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path, PurePosixPath

from racecraft.contract.errors import UserInputError

SCHEME = "s3://"
_BUCKET = re.compile(r"[A-Za-z0-9][A-Za-z0-9._-]{1,62}")
_DRIVE = re.compile(r"[A-Za-z]:")
_CONTROL = re.compile(r"[\x00-\x1f\x7f]")


class BucketError(UserInputError):
    """An address, a bucket or an object in it cannot be used."""


@dataclass(frozen=True)
class Address:
    """A bucket and a place in it.

    >>> Address.parse("s3://models/fast-car-1/")
    Address(bucket='models', prefix='fast-car-1')
    >>> str(Address("models", ""))
    's3://models/'
    """

    bucket: str
    prefix: str
    """What keys begin with, without the slash behind it; empty: the whole bucket."""

    @classmethod
    def parse(cls, text: str) -> Address:
        """Read s3://bucket/prefix.

        Raises:
            BucketError: It is none.
        """
        bucket, _, prefix = text.removeprefix(SCHEME).partition("/")
        if not text.startswith(SCHEME) or not _BUCKET.fullmatch(bucket):
            raise BucketError(
                "{text!r}: is no address of a bucket; expected s3://BUCKET/PREFIX, such as s3://models/fast-car-1.",
                text=text,
            )
        prefix = prefix.rstrip("/")
        if prefix and (why := _why_hostile(prefix)):
            raise BucketError("{text!r}: {why}; expected a prefix such as fast-car-1.", text=text, why=why)
        return cls(bucket, prefix)

    def __str__(self) -> str:
        return f"{SCHEME}{self.bucket}/{self.prefix}"

    def key(self, name: str) -> str:
        """Return the key of an object by its name below the prefix."""
        return f"{self.prefix}/{name}" if self.prefix else name

    def name(self, key: str) -> str | None:
        """Return the name of a key below the prefix; None where it lies elsewhere."""
        if not self.prefix:
            return key
        return key.removeprefix(self.prefix + "/") if key.startswith(self.prefix + "/") else None

    def below(self, prefix: str) -> Address:
        """Return a place further down."""
        return Address(self.bucket, self.key(prefix.strip("/")))


def is_address(text: str) -> bool:
    """Tell whether a text means a bucket and not a path."""
    return text.startswith(SCHEME)


def file_of(folder: Path, name: str) -> Path:
    """Return the file of an object.

    Args:
        folder: Where the prefix's objects become files.
        name: The object's name below the prefix.

    Raises:
        BucketError: It would be no file below that folder.
    """
    if why := _why_hostile(name):
        raise BucketError(
            "object {name!r}: {why}; nothing of it is written. Rename the object, or take it away.", name=name, why=why
        )
    return folder / name


def require_files(names: Iterable[str]) -> None:
    """Refuse names that cannot all be files of one folder here: hostile ones, and two that are one file.

    Names that differ in case only are one file where disks do not tell them apart, so they are refused everywhere.

    Raises:
        BucketError: Says which.
    """
    names = sorted(names)
    by_folded: dict[str, str] = {}
    folders: dict[str, str] = {}
    for name in names:
        file_of(Path(), name)
        if (other := by_folded.setdefault(name.casefold(), name)) != name:
            raise BucketError(
                "objects {other!r} and {name!r}: differ in case only, and many disks take them for one file; "
                "expected names that differ otherwise. Rename one of them.",
                other=other,
                name=name,
            )
        for parent in PurePosixPath(name).parents:
            written = folders.setdefault(str(parent).casefold(), str(parent))
            if written != str(parent):
                raise BucketError(
                    "objects below {written!r} and {parent!r}: differ in case only, and many disks take them "
                    "for one folder; expected names that differ otherwise. Rename one of them.",
                    written=written,
                    parent=str(parent),
                )
    for folded in folders:
        if folded in by_folded:
            raise BucketError(
                "object {by_folded!r}: others lie below it as if it were a folder; a disk cannot hold both. "
                "Rename it, or take it away.",
                by_folded=by_folded[folded],
            )


def _why_hostile(name: str) -> str:
    """Return why a name is no file below its folder; empty where it is one.

    >>> [bool(_why_hostile(name)) for name in ("a/b-2.json", "2026-03-06T18:33:59Z/a", "../a", "/a", "a//b", "C:a")]
    [False, False, True, True, True, True]
    """
    parts = name.split("/")
    if ".." in parts:
        return "would leave its folder"
    if name.startswith("/") or _DRIVE.match(name):
        return "begins like a path of a disk"
    if "" in parts or "." in parts:
        return "holds an empty part"
    if "\\" in name:
        return "holds a backslash, which is a folder on some systems"
    if _CONTROL.search(name):
        return "holds a control character"
    if os.name == "nt" and (":" in name or any(part[-1] in " ." for part in parts)):
        return "is no file name of this system"
    if any(len(part.encode()) > 250 for part in parts):
        return "holds a part of more than 250 bytes"
    return ""
