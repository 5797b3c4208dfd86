"""How a bucket is reached: as is given, else as a DeepRacer-for-Cloud folder says, else the environment."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Protocol

from racecraft.settings.request import Request, option

if TYPE_CHECKING:
    from racecraft.storage.address import Address
    from racecraft.storage.connection import S3Connection
    from racecraft.storage.mirror_note import MirrorLocation
    from racecraft.storage.object_store import ObjectStore


@dataclass(frozen=True, kw_only=True)
class BucketOptions(Request):
    """How a store is reached; what is not given is as a DeepRacer-for-Cloud folder or the environment says."""

    endpoint: str = option("", "Address of a store that is not AWS's; else AWS_ENDPOINT_URL.", "--endpoint-url")
    profile: str = option("", "Profile of ~/.aws; else AWS_PROFILE.")
    region: str = option("", "Region of AWS; else AWS_REGION.")
    folder: Path | None = option(None, "Where it is reached as the system.env of this folder says.", variable="DR_DIR")

    def open(self, address: Address | None) -> ObjectStore:
        """Open the store of an address; None: no certain one.

        Raises:
            UserInputError: Something written cannot be used.
        """
        return open_store(reach(address, self.folder, self.endpoint, self.profile, self.region))


def reach(
    address: Address | None, folder: Path | None, endpoint: str = "", profile: str = "", region: str = ""
) -> S3Connection:
    """Return how an address is reached.

    Args:
        address: Its bucket chooses between the folder's two; None: no certain one.
        folder: A DeepRacer-for-Cloud folder; None, or one without a run.env: none.
        endpoint: As typed; it counts before the folder, like the two behind it.
        profile: As typed.
        region: As typed.

    Raises:
        UserInputError: Something written cannot be used.
    """
    from racecraft.storage.connection import access_of_environment

    installation = installation_at(folder)
    known = None if installation is None else installation.access(address)
    if known is None:
        return access_of_environment(endpoint, profile, region)
    typed = {"endpoint": endpoint, "profile": profile, "region": region}
    changed = {name: value for name, value in typed.items() if value}
    return replace(known, **changed, **({"key": "", "secret": ""} if profile else {}))


def open_store(access: S3Connection) -> ObjectStore:
    """Open a store.

    Raises:
        MissingExtraError: boto3 is not installed; the message says how.
        BucketError: The profile is not known.
    """
    from racecraft.storage.object_store import ObjectStore

    return ObjectStore(access)


class Installation(Protocol):
    """A user's folder of another program that names its buckets; a world opens it (`WorldKind.installation`)."""

    def access(self, address: Address | None) -> S3Connection | None:
        """Return how an address is reached; None: the folder does not say."""
        ...

    def mirror(self, tell: Callable[[str], None]) -> MirrorLocation | None:
        """Fetch what a training lacks, and return where its run is kept as well; None: nowhere."""
        ...

    def folders(self) -> dict[str, Path]:
        """Return the folders of this machine that stand for its buckets, by the bucket's name."""
        ...


def installation_at(folder: Path | None) -> Installation | None:
    """Return the installation of another program that stands in a folder; None where there is none."""
    if folder is None:
        return None
    from racecraft.contract.kinds import kinds

    for kind in kinds():
        opened = kind.piece("installation")
        found: Installation | None = opened(folder) if opened else None
        if found is not None:
            return found
    return None
