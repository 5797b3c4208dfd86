"""Drawn maps: walls, rivers, start squares and food squares, read from `layouts.toml`."""

from __future__ import annotations

import functools
import tomllib
from collections import Counter
from dataclasses import dataclass
from importlib import resources
from typing import Any

from racecraft.worlds.battlesnake.env.board import Point


@dataclass(frozen=True)
class Layout:
    """What is drawn of one map."""

    width: int
    height: int
    hazards: tuple[tuple[Point, int], ...]
    """Squares with the number of hazards stacked on them."""
    starts: tuple[tuple[int, tuple[Point, ...]], ...] = ()
    """(Most players, squares): the first entry that holds all players is shuffled and dealt out."""
    extra_starts: tuple[Point, ...] = ()
    """Squares of the snakes beyond the last entry of `starts`, in order."""
    quadrants: tuple[tuple[Point, ...], ...] = ()
    """Start squares by quadrant, in the order in which the quadrants are visited."""
    food: tuple[Point, ...] = ()
    """The only squares where food falls; empty: anywhere."""

    def hazard_counts(self) -> Counter[Point]:
        """Return the hazards as a fresh counter."""
        return Counter(dict(self.hazards))


@functools.cache
def layout(name: str) -> Layout:
    """Return a drawn map by name.

    >>> layout("hz_castle_wall").food
    ((2, 5), (5, 2), (5, 8), (8, 5))
    """
    return _read(_tables()[name])


@functools.cache
def _tables() -> dict[str, Any]:
    return tomllib.loads((resources.files(__package__) / "layouts.toml").read_text(encoding="utf-8"))


def _read(table: dict[str, Any]) -> Layout:
    rows = table["board"].split()[::-1]
    hazards = tuple(((x, y), int(c)) for y, row in enumerate(rows) for x, c in enumerate(row) if c != ".")
    return Layout(
        width=len(rows[0]),
        height=len(rows),
        hazards=hazards,
        starts=tuple((most, _points(squares)) for most, squares in table.get("starts", [])),
        extra_starts=_points(table.get("extra_starts", [])),
        quadrants=tuple(_points(squares) for squares in table.get("quadrants", [])),
        food=_points(table.get("food", [])),
    )


def _points(pairs: list[list[int]]) -> tuple[Point, ...]:
    return tuple((x, y) for x, y in pairs)
