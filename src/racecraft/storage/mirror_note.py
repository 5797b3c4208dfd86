"""Where a run folder is kept as well, so that whoever goes on with it goes on keeping it there: `mirror.json` in it."""

from __future__ import annotations

import json
from dataclasses import dataclass, field
from pathlib import Path

from racecraft.contract.errors import UserInputError
from racecraft.formats.atomic import write_atomic
from racecraft.formats.json_text import parse_json
from racecraft.formats.user_file import read_regular
from racecraft.storage.address import Address, BucketError
from racecraft.storage.connection import WHERE_KEYS_ARE, S3Connection
from racecraft.storage.transfer import MIRROR

_NAMED = ("endpoint", "profile", "region")


@dataclass(frozen=True)
class MirrorLocation:
    """A place in a bucket, and how it is reached."""

    address: Address
    access: S3Connection = field(default_factory=S3Connection)
    installation: str = ""
    """The DeepRacer-for-Cloud folder whose files say how it is reached, keys among it; empty: none."""

    @property
    def command(self) -> str:
        """What follows the words of a command: the address, then the options."""
        return f"{self.address}{self.access.options_text}"


def write_note(run: Path, place: MirrorLocation) -> None:
    """Note where a run is kept as well. Keys are not noted, but the installation that holds them is.

    Raises:
        OutputFileError: The file cannot be written.
    """
    known = {name: getattr(place.access, name) for name in _NAMED}
    note = {"address": str(place.address), **known, "installation": place.installation}
    write_atomic(run / MIRROR, json.dumps(note, indent=2) + "\n")


def noted_place(run: Path) -> MirrorLocation | None:
    """Return where a run is kept as well; None: nowhere.

    Raises:
        BucketError: Somebody wrote keys into the note, or an endpoint that holds some.
        UserInputError: The note is damaged, or the installation that it names says something that cannot be used.
    """
    path = run / MIRROR
    if not path.is_file():
        return None
    try:
        noted = parse_json(read_regular(path))
        _require_no_keys(path, noted)
        access = S3Connection(**{name: str(noted[name]) for name in _NAMED})
        return MirrorLocation(Address.parse(str(noted["address"])), access, str(noted["installation"]))
    except BucketError:
        raise
    except (ValueError, KeyError, TypeError, OSError) as error:
        raise UserInputError(
            "{path}: damaged ({error}); expected what racecraft wrote. Take the file away: the run is then kept in no "
            "bucket, until --mirror names one.",
            path=path,
            error=error,
        ) from error


def _require_no_keys(path: Path, noted: object) -> None:
    """Refuse a note that somebody wrote more into than stands there."""
    more = sorted(set(noted) - {"address", "installation", *_NAMED}) if isinstance(noted, dict) else []
    if more:
        raise BucketError(
            "{path}: holds '{more}', which is not read there; expected address, installation, {named}. "
            "{where_keys_are}",
            path=path,
            more=more[0],
            named=", ".join(_NAMED),
            where_keys_are=WHERE_KEYS_ARE,
        )
