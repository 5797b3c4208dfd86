"""Tracks as the cards of a gallery: one a circuit, whose directions and surfaces are choices within it.

Begin with `circuits`.
"""

from __future__ import annotations

import re
from functools import cache
from typing import Any

from racecraft.worlds.deepracer.driving.known_laps import best_known_lap
from racecraft.worlds.deepracer.tracks.catalogue import TrackSummary, names, summary
from racecraft.worlds.deepracer.tracks.library import own_names, own_summary

CAR, TOP_SPEED_MPS = "v6", 2.5
"""Of the default car: the best known lap that a track's card shows is of this car."""
YEAR = re.compile(r"20\d\d")


def own_circuits() -> list[dict[str, Any]]:
    """Return the same as `circuits` of the user's own tracks, of which no lap is known."""
    return [_card(name, [own_summary(name)], None) for name in own_names()]


@cache
def circuits() -> list[dict[str, Any]]:
    """Return the cards of the catalogue, the shortest circuit first and open roads last.

    Each has title, length and width in m, best known lap in s, year ("": its names tell none), directions, the words
    that it is found by, and its tracks as (name, what distinguishes it).
    """
    by_title: dict[str, list[TrackSummary]] = {}
    for one in map(summary, names()):
        by_title.setdefault(one.title.partition(" (")[0], []).append(one)
    cards = [
        _card(title, tracks, best_known_lap(tracks[0].name, CAR, TOP_SPEED_MPS)) for title, tracks in by_title.items()
    ]
    return sorted(cards, key=lambda card: ("open" in card["directions"], card["length"]))


@cache
def track_choices() -> list[tuple[str, str]]:
    """Return the name and the title of every track of the catalogue, in a reader's order."""
    return [(name, summary(name).title) for name in names()]


def _card(title: str, tracks: list[TrackSummary], known: float | None) -> dict[str, Any]:
    words = " ".join([title, *(track.title for track in tracks), *(track.name for track in tracks)])
    year = YEAR.search(words)
    return {
        "title": title, "length": tracks[0].length, "width": tracks[0].width, "known": known,
        "year": year[0] if year else "", "directions": sorted({track.direction for track in tracks}),
        "words": words.casefold(), "tracks": [(track.name, _distinction(track)) for track in tracks],
    }  # fmt: skip


def _distinction(track: TrackSummary) -> str:
    """Return what a track is among those of its circuit.

    >>> _distinction(summary("reinvent_wood")), _distinction(summary("reinvent_base"))
    ('wood', 'plain')
    """
    return track.title.partition(" (")[2].removesuffix(")") or "plain"
