"""Buckets of S3 and MinIO: up, down, what is in them, links."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from racecraft.actions.action import action
from racecraft.actions.stores import BucketOptions
from racecraft.contract.progress import Progress, quiet
from racecraft.settings.request import Request, argument, group, option

if TYPE_CHECKING:
    from racecraft.storage.object_store import StoredObject
    from racecraft.storage.transfer import Transfer


@dataclass(frozen=True, kw_only=True)
class PushRequest(Request):
    """What is put where."""

    source: Path = argument("A run folder, any other folder, or a file.")
    address: str = argument("An address, such as s3://models/fast-car-1.", metavar="S3://BUCKET/PREFIX")
    dry_run: bool = option(False, "Say what would be moved, and move nothing.", "--dry-run", "--dryrun")
    way: BucketOptions = group(BucketOptions)


@dataclass(frozen=True, kw_only=True)
class PullRequest(Request):
    """What is fetched where."""

    address: str = argument("An address, such as s3://models/fast-car-1.", metavar="S3://BUCKET/PREFIX")
    target: Path = argument("The folder that it becomes, or in which a single object is laid.")
    dry_run: bool = option(False, "Say what would be moved, and move nothing.", "--dry-run", "--dryrun")
    way: BucketOptions = group(BucketOptions)


@dataclass(frozen=True)
class Transferred:
    """What was moved, or would be."""

    source: str
    target: str
    done: Transfer
    dry_run: bool

    def as_dictionary(self) -> dict[str, Any]:
        """Return the counts by name."""
        done = self.done
        return {"moved": done.moved, "skipped": done.skipped, "bytes": done.bytes, "dry_run": self.dry_run}


@action
def push(request: PushRequest, progress: Progress = quiet) -> Transferred:
    """Put a folder into a bucket; what stands there already is passed over.

    Examples:

        racecraft bucket push runs/reinvent_base-1 s3://models/fast-car-1

        racecraft bucket push runs/reinvent_base-1 s3://models/fast-car-1 --endpoint-url http://localhost:9000
    """
    from racecraft.storage.address import Address
    from racecraft.storage.transfer import push as push_folder

    target = Address.parse(request.address)
    store = request.way.open(target)
    done = push_folder(store, request.source, target, dry_run=request.dry_run, on_message=progress)
    return Transferred(str(request.source), str(target), done, request.dry_run)


@action
def pull(request: PullRequest, progress: Progress = quiet) -> Transferred:
    """Fetch a prefix of a bucket into a folder; what stands there already is passed over.

    Example: racecraft bucket pull s3://models/fast-car-1 runs/fast-car-1
    """
    from racecraft.storage.address import Address
    from racecraft.storage.transfer import pull as pull_folder

    source = Address.parse(request.address)
    store = request.way.open(source)
    done = pull_folder(store, source, request.target, dry_run=request.dry_run, on_message=progress)
    return Transferred(str(source), str(request.target), done, request.dry_run)


@dataclass(frozen=True, kw_only=True)
class ListRequest(Request):
    """What is listed."""

    address: str | None = argument("By default the buckets themselves.", None, metavar="[S3://BUCKET/PREFIX]")
    recursive: bool = option(False, "Everything below, not only the next level.")
    way: BucketOptions = group(BucketOptions)


@dataclass(frozen=True)
class Listing:
    """The buckets, or the objects of one."""

    buckets: list[str] | None = None
    """None: objects were listed."""
    objects: Mapping[str, StoredObject] = field(default_factory=dict)
    """By their name below the prefix."""
    recursive: bool = False

    def as_dictionary(self) -> dict[str, Any]:
        """Return the buckets, or size in bytes and ETag of each object."""
        if self.buckets is not None:
            return {"buckets": self.buckets}
        return {"objects": {name: {"size": one.size, "etag": one.etag} for name, one in self.objects.items()}}


@action
def list_bucket(request: ListRequest, progress: Progress = quiet) -> Listing:
    """List buckets, or what is in one.

    Examples:

        racecraft bucket list --endpoint-url http://localhost:9000

        racecraft bucket list s3://models/fast-car-1 --recursive
    """
    from racecraft.storage.address import Address, BucketError

    if request.address is None:
        return Listing(buckets=list(request.way.open(None).buckets()))
    place = Address.parse(request.address)
    found = request.way.open(place).listed(place)
    if not found and place.prefix:
        raise BucketError("{place}: there is nothing; expected a prefix that holds objects.", place=place)
    return Listing(objects=found, recursive=request.recursive)


@dataclass(frozen=True, kw_only=True)
class LinkRequest(Request):
    """Which object, for how long."""

    address: str = argument("One object.", metavar="S3://BUCKET/KEY")
    hours: float = option(24.0, "Valid for so long; at most 168, which is 7 days.")
    way: BucketOptions = group(BucketOptions)


@dataclass(frozen=True)
class Link:
    """A presigned link."""

    url: str


@action
def link(request: LinkRequest, progress: Progress = quiet) -> Link:
    """Print a presigned link, by which anybody fetches one object without a key.

    Example: racecraft bucket link s3://models/fast-car-1/report.html --hours 48
    """
    from racecraft.storage.address import Address, BucketError

    place = Address.parse(request.address)
    store = request.way.open(place)
    if not place.prefix or store.find(place.bucket, place.prefix) is None:
        raise BucketError("{place}: there is no such object; expected the key of one.", place=place)
    url = store.link(place.bucket, place.prefix, round(request.hours * 3600))
    return Link(url)
