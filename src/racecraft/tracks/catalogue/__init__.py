"""The circuits that come with racecraft, found by name. Begin with `load_track`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from racecraft.tracks.track import Track


def load_track(name_or_path: str | Path) -> Track:
    """Return a circuit: a catalogue name, or the path of a route file (`.npy`).

    Raises:
        TrackError: No such name or file, or rows that make no circuit.
    """
    from racecraft.tracks.importer import import_track

    return import_track(name_or_path)
