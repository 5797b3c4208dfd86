"""The circuits that come with racecraft, found by name. Begin with `load_track`.

    index.json   one line per name: shape, title, figures, look
    rows.npz     rows of each shape: int32 (K, 6), centre x, y, inner x, y, outer x, y in micrometres (reading one of
                 these arrays takes 1 ms; a Parquet file would import Polars first, for 0.2 s)

Names are the ones racers know from AWS, in any case; the titles of the posters ("re:Invent 2018") are understood too.
"""

from __future__ import annotations

import json
import os
import zipfile
import zlib
from dataclasses import asdict, dataclass
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from racecraft.contract.errors import TrackError, nearest
from racecraft.contract.message import Message

if TYPE_CHECKING:
    from racecraft.worlds.deepracer.tracks.track import Track

FOLDER = Path(__file__).parent
SHORTEST_BEGINNING = 3
"""Letters of a name that say what was meant by how it begins, where it is no name itself."""


@dataclass(frozen=True, slots=True)
class TrackSummary:
    """What `racecraft tracks` tells about a circuit without building it."""

    name: str
    title: str
    length: float
    """Centre line once around, m."""
    width: float
    """Mean width between the borders, m."""
    rows: int
    """Waypoints as the route file counts them, a loop's closing one and a repeated one included."""
    direction: str
    """"ccw", "cw" or "open"."""
    tags: tuple[str, ...]

    def as_dictionary(self) -> dict[str, Any]:
        """Return the figures by name, ready for JSON."""
        return asdict(self)


def load_track(name_or_path: str | Path) -> Track:
    """Return a circuit: a name or title of the catalogue, another name that is known here, or a route file's (`.npy`).

    Known besides are the user's own library and the tracks of installed packages.

    Raises:
        TrackError: No such name or file, or rows that make no circuit.

    >>> load_track("re:Invent 2018").name
    'reinvent_base'
    """
    if _is_path(name_or_path):
        from racecraft.worlds.deepracer.tracks.importer import import_track

        return import_track(name_or_path)
    name = str(name_or_path)
    if known_name(name) is None:
        from racecraft.worlds.deepracer.tracks.library import offered_track, own_track

        for find in (own_track, offered_track):
            if (own := find(name)) is not None:
                return own
    return _build(resolve(name))


def names() -> list[str]:
    """Return the names of all circuits, in the order of a reader's alphabet."""
    return list(_index())


def summary(name: str) -> TrackSummary:
    """Return the figures of a circuit; cheap, no rows are read.

    Raises:
        TrackError: No such name.

    >>> summary("reinvent_base").rows
    119
    """
    name = resolve(name)
    entry = _index()[name]
    rows = entry["rows"] + len(entry.get("repeated_rows", ()))
    return TrackSummary(
        name, entry["title"], entry["length"], entry["width"], rows, entry["direction"], tuple(entry["tags"])
    )


def known_name(name: str) -> str | None:
    """Return the catalogue's own spelling of a name, title or base name; None where it knows none.

    >>> known_name("Oval Track"), known_name("garage")
    ('Oval_track', None)
    """
    return _spellings().get(_folded(name))


def resolve(name: str) -> str:
    """Return the catalogue's own spelling of a name, title or base name; of two directions, counter-clockwise.

    Raises:
        TrackError: With the shortest name that begins so, else the nearest.

    >>> resolve("REINVENT_BASE"), resolve("Smile Speedway"), resolve("2024_reinvent_champ")
    ('reinvent_base', 'reInvent2019_track', '2024_reinvent_champ_ccw')
    """
    if (known := known_name(name)) is not None:
        return known
    from racecraft.worlds.deepracer.tracks.library import own_names

    every = [*_index(), *(entry["title"] for entry in _index().values()), *own_names()]
    matches = [one for one in every if len(name) >= SHORTEST_BEGINNING and one.casefold().startswith(name.casefold())]
    hint = f"Did you mean '{min(matches, key=len)}'?" if matches else nearest(name, every)
    if not hint.startswith("Did"):
        hint = "`racecraft tracks list` shows all names."
    expected = Message("one of the catalogue's {count}, one of your own, or a .npy file", count=len(_index()))
    raise TrackError(name, "no circuit of this name", expected, hint)


@cache
def _build(name: str) -> Track:
    from racecraft.worlds.deepracer.tracks.style import TrackStyle
    from racecraft.worlds.deepracer.tracks.track import Track

    entry = _index()[name]
    rows = _rows_m(entry["shape"])
    return Track.from_rows(
        name,
        rows,
        look=TrackStyle.from_record(entry["look"]),
        title=entry["title"],
        tags=tuple(entry["tags"]),
        repeated_rows=tuple(entry.get("repeated_rows", ())),
    )


def _rows_m(shape: str) -> np.ndarray:
    """Return the rows (K, 6) of a shape in metres.

    Raises:
        TrackError: The file of rows is damaged.
    """
    path = FOLDER / "rows.npz"
    try:
        with open(path, "rb") as file, np.load(file, allow_pickle=False) as shapes:
            return shapes[shape] / 1e6
    except (OSError, ValueError, KeyError, EOFError, zipfile.BadZipFile, zlib.error) as error:
        raise TrackError(
            path,
            Message("not readable ({error!r})", error=error),
            "the rows of every shape",
            "Install racecraft again.",
        ) from error


@cache
def _index() -> dict[str, dict[str, Any]]:
    return json.loads((FOLDER / "index.json").read_text(encoding="utf-8"))


@cache
def _spellings() -> dict[str, str]:
    """Map every folded spelling to a name; real names win over base names, those over titles."""
    spellings: dict[str, str] = {}
    for name, entry in _index().items():
        spellings.setdefault(_folded(entry["title"]), name)
        spellings.setdefault(_folded(entry["title"].split(" (")[0]), name)
    for name in _index():
        if name.endswith("_ccw"):
            spellings[_folded(name.removesuffix("_ccw"))] = name
    return spellings | {_folded(name): name for name in _index()}


def _folded(name: str) -> str:
    return "".join(letter for letter in name.casefold() if letter.isalnum())


def _is_path(name_or_path: str | Path) -> bool:
    text = os.fspath(name_or_path)
    return isinstance(name_or_path, Path) or text.endswith(".npy") or "/" in text or os.sep in text
