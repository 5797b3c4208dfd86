"""The user's own circuits: route files that were looked at once and are found by name from then on.

They lie as `NAME.npy` in one folder: what `RACECRAFT_TRACKS` names, or `racecraft/tracks` where this system keeps a
user's data. Begin with `add_track`. A name of the catalogue always means the catalogue's circuit, so no own circuit may
bear one.
"""

from __future__ import annotations

import io
import os
import re
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from racecraft.contract.errors import TrackError
from racecraft.contract.extensions import load_offered
from racecraft.contract.message import Message
from racecraft.formats.atomic import make_folder, write_atomic
from racecraft.formats.user_folder import data_folder
from racecraft.worlds.deepracer.tracks.catalogue import TrackSummary, known_name
from racecraft.worlds.deepracer.tracks.importer import import_track, read_rows, route_file

if TYPE_CHECKING:
    from racecraft.worlds.deepracer.tracks.track import Track

FOLDER_VARIABLE = "RACECRAFT_TRACKS"
OWN_TAG = "own"
LEGAL_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9_-]{0,63}")


def library_folder(environment: Mapping[str, str] = os.environ, system: str = sys.platform) -> Path:
    """Return where own circuits lie; the folder need not exist.

    >>> library_folder({"RACECRAFT_TRACKS": "mine"}).as_posix()
    'mine'
    """
    if named := environment.get(FOLDER_VARIABLE):
        return Path(named)
    return data_folder(environment, system) / "tracks"


def add_track(path: str | Path, name: str = "", *, replace: bool = False) -> Track:
    """Look at every row of a route file and keep it under a name.

    Args:
        path: The `.npy` file: K rows of centre x, y, inner x, y, outer x, y in metres.
        name: What it is called from now on; the file's stem when empty.
        replace: Whether a circuit of that name may be written over.

    Returns:
        The circuit.

    Raises:
        TrackError: The file makes no circuit, with the row where it shows; or the name is not legal, or taken.
        OutputFileError: The library cannot be written.
    """
    track = check_track(path, name, replace=replace)
    table = io.BytesIO()
    np.save(table, read_rows(path), allow_pickle=False)
    _write(track.name, table.getvalue())
    return track


def keep_track(track: Track, path: str | Path, *, replace: bool = False) -> None:
    """Keep a track that was made here under its own name.

    Args:
        track: The circuit.
        path: What it was made of, for messages.
        replace: Whether a circuit of that name may be written over.

    Raises:
        TrackError: The name is not legal, or taken.
        OutputFileError: The library cannot be written.
    """
    _require_legal(track.name, path)
    _require_free(track.name, path, replace)
    _write(track.name, route_file(track))


def _write(name: str, table: bytes) -> None:
    target = library_folder() / f"{name}.npy"
    make_folder(target.parent)
    write_atomic(target, table)


def check_track(path: str | Path, name: str = "", *, replace: bool = False) -> Track:
    """Do all of `add_track` but keep it: return the circuit, or refuse it.

    Raises:
        TrackError: As from `add_track`.
    """
    name = name or Path(path).stem
    _require_legal(name, path)
    _require_free(name, path, replace)
    return import_track(path, name)


def own_names() -> list[str]:
    """Return the names of the user's own circuits, in the order of a reader's alphabet."""
    return sorted((path.stem for path in library_folder().glob("*.npy")), key=str.casefold)


def own_track(name: str) -> Track | None:
    """Return the own circuit of this name, in any case; None where there is none.

    Raises:
        TrackError: Its file no longer makes a circuit.
    """
    spelt = _spelt(name)
    return None if spelt is None else import_track(library_folder() / f"{spelt}.npy", spelt)


def offered_track(name: str) -> Track | None:
    """Return the circuit of this name that an installed package offers; None where none does.

    A package offers a function without arguments that returns the path of a route file.

    Raises:
        SettingError: The package cannot be imported.
        TrackError: The file makes no circuit.
    """
    route_file = load_offered("tracks", name)
    return None if route_file is None else import_track(route_file(), name)


def own_summary(name: str) -> TrackSummary:
    """Return the figures of an own circuit.

    Raises:
        TrackError: There is none of this name, or its file no longer makes a circuit.
    """
    track = own_track(name)
    if track is None:
        raise TrackError(
            name,
            "no circuit of this name in the library",
            Message("one of: {own_names}", own_names=", ".join(own_names()) or "none"),
        )
    return TrackSummary(
        track.name, "", round(track.length, 4), round(track.width_mean, 4), len(track.of_filed_rows()), track.direction,
        (OWN_TAG,),
    )  # fmt: skip


def _spelt(name: str) -> str | None:
    return next((own for own in own_names() if own.casefold() == name.casefold()), None)


def _require_legal(name: str, path: str | Path) -> None:
    if not LEGAL_NAME.fullmatch(name):
        raise TrackError(
            path, Message("the name {name!r}", name=name), "1 to 64 letters, digits, - and _, a letter or digit first",
            "Give another with --name.",
        )  # fmt: skip


def _require_free(name: str, path: str | Path, replace: bool) -> None:
    if (known := known_name(name)) is not None:
        raise TrackError(
            path,
            Message("the name {name!r} is the catalogue's {known}", name=name, known=known),
            "a name of your own",
            "Give another with --name.",
        )
    if (own := _spelt(name)) is not None and not (replace and own == name):
        hint = Message("Give another with --name, or write over it with --name {own} --replace.", own=own)
        raise TrackError(
            path,
            Message(
                "the name {name!r} is taken by {library_folder}.npy", name=name, library_folder=library_folder() / own
            ),
            "a new name",
            hint,
        )
