"""The rows of a race in which each drives alone: ranked at once, made when they are looked at. See `SoloRows`.

A page shows some rows of thousands, and after every result most of them have another place.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from typing import overload

from racecraft.league.board_row import BoardRow, figures_of
from racecraft.league.race import Entry, Race, Result
from racecraft.league.scoring import Score, score_of

Ranked = tuple[tuple[float, ...], int, Score | None]
"""What a racer is ranked by, the number of the best entry, and its score."""
UNRANKED = (math.inf,)


class SoloRows(Sequence[BoardRow]):
    """Racers by the best of all their entries; of equals the one that was entered first stands above.

    Args:
        race: The race.
        entries: Its entries by number.
        results: Its results by heat.
    """

    def __init__(self, race: Race, entries: Mapping[int, Entry], results: Mapping[str, Result]) -> None:
        self._race, self._entries = race, entries
        self._results = {result.entries[0]: result for result in results.values()}
        self._own: dict[str, list[int]] = {}
        for number, entry in entries.items():
            self._own.setdefault(entry.racer, []).append(number)
        self._ranked = sorted(map(self._best, self._own.values()), key=lambda one: one[:2])
        self._places = list(_places(self._ranked))

    @property
    def waiting(self) -> int:
        """How many entries have no result."""
        return sum(number not in self._results for number in self._entries)

    def __len__(self) -> int:
        return len(self._ranked)

    @overload
    def __getitem__(self, index: int) -> BoardRow: ...
    @overload
    def __getitem__(self, index: slice) -> tuple[BoardRow, ...]: ...
    def __getitem__(self, index: int | slice) -> BoardRow | tuple[BoardRow, ...]:
        if isinstance(index, slice):
            return tuple(map(self._row, range(*index.indices(len(self)))))
        return self._row(range(len(self))[index])

    def _best(self, own: Sequence[int]) -> Ranked:
        """Return a racer's best entry; the newest one where none has a score."""
        best: Ranked = (UNRANKED, own[-1], None)
        for number in own:
            result = self._results.get(number)
            score = None if result is None else score_of(self._race, result)
            if score is not None and (score.key, number) < best[:2]:
                best = (score.key, number, score)
        return best

    def _row(self, index: int) -> BoardRow:
        _, number, score = self._ranked[index]
        entry = self._entries[number]
        own = self._own[entry.racer]
        newest = self._results.get(own[-1])
        return BoardRow(
            place=self._places[index],
            racer=entry.racer,
            model=entry.model,
            entry=number,
            score=None if score is None else score.value,
            gap=_difference(score, self._ranked[0][2]),
            interval=_difference(score, self._ranked[max(0, index - 1)][2]),
            submissions=len(own),
            failure="" if newest is None else newest.failure,
            waiting=sum(one not in self._results for one in own),
            **figures_of(self._results.get(number), 0),
        )


def _places(ranked: Iterable[Ranked]) -> Iterable[int | None]:
    """Yield places, counted from 1; equal scores share one."""
    before, place = None, 0
    for position, (key, _, score) in enumerate(ranked, start=1):
        place, before = (place if key == before else position), key
        yield None if score is None else place


def _difference(score: Score | None, other: Score | None) -> float | None:
    return None if score is None or other is None else round(abs(score.value - other.value), 6)
