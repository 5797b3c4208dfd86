"""How a command reaches a bucket: what was typed, then a DeepRacer-for-Cloud folder, then the environment."""

from __future__ import annotations

import functools
import inspect
from collections.abc import Callable
from dataclasses import dataclass, fields, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Protocol, get_type_hints

import typer

if TYPE_CHECKING:
    from racecraft.storage.access import Access
    from racecraft.storage.address import Address
    from racecraft.storage.mirror_note import Place
    from racecraft.storage.object_store import ObjectStore


@dataclass(frozen=True)
class Way:
    """How a store is reached, as it was typed: each field is an option."""

    endpoint: Annotated[
        str, typer.Option("--endpoint-url", help="Address of a store that is not AWS's; else AWS_ENDPOINT_URL.")
    ] = ""
    profile: Annotated[str, typer.Option("--profile", help="Profile of ~/.aws; else AWS_PROFILE.")] = ""
    region: Annotated[str, typer.Option("--region", help="Region of AWS; else AWS_REGION.")] = ""
    folder: Annotated[
        Path | None,
        typer.Option("--folder", envvar="DR_DIR", help="Where it is reached as the system.env of this folder says."),
    ] = None

    def open(self, address: Address | None) -> ObjectStore:
        """Open the store of an address; None: no certain one.

        Raises:
            UserInputError: Something written cannot be used.
        """
        return open_store(reach(address, self.folder, self.endpoint, self.profile, self.region))


def says_the_way(command: Callable[..., None]) -> Callable[..., None]:
    """Give a command the options of `Way`, in the place of its parameter `way`."""
    hints = get_type_hints(Way, include_extras=True)
    options = [
        inspect.Parameter(one.name, inspect.Parameter.KEYWORD_ONLY, default=one.default, annotation=hints[one.name])
        for one in fields(Way)
    ]
    own = [
        one.replace(kind=inspect.Parameter.KEYWORD_ONLY)
        for one in inspect.signature(command, eval_str=True).parameters.values()
    ]
    at = [one.name for one in own].index("way")
    typed = [*own[:at], *options, *own[at + 1 :]]

    @functools.wraps(command)
    def with_way(**words: Any) -> None:
        way = Way(**{one.name: words.pop(one.name) for one in options})
        command(**words, way=way)

    with_way.__signature__ = inspect.Signature(typed)  # type: ignore[attr-defined]
    with_way.__annotations__ = {one.name: one.annotation for one in typed}
    return with_way


def reach(
    address: Address | None, folder: Path | None, endpoint: str = "", profile: str = "", region: str = ""
) -> Access:
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
    from racecraft.storage.access import access_of_environment

    installation = installation_at(folder)
    known = None if installation is None else installation.access(address)
    if known is None:
        return access_of_environment(endpoint, profile, region)
    typed = {"endpoint": endpoint, "profile": profile, "region": region}
    changed = {name: value for name, value in typed.items() if value}
    return replace(known, **changed, **({"key": "", "secret": ""} if profile else {}))


def open_store(access: Access) -> ObjectStore:
    """Open a store.

    Raises:
        MissingExtraError: boto3 is not installed; the letter says how.
        BucketError: The profile is not known.
    """
    from racecraft.storage.object_store import ObjectStore

    return ObjectStore(access)


class Installation(Protocol):
    """A user's folder of another program that names its buckets; a world opens it (`WorldKind.installation`)."""

    def access(self, address: Address | None) -> Access | None:
        """Return how an address is reached; None: the folder does not say."""
        ...

    def mirror(self, tell: Callable[[str], None]) -> Place | None:
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
