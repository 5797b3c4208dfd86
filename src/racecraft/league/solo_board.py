"""The rows of a race in which each drives alone: ranked at once, made when they are looked at. See `SoloRows`.

A page shows some rows of thousands, and after every result most of them have another place.
"""

from __future__ import annotations

import math
from bisect import bisect_left
from collections.abc import Collection, Mapping, Sequence
from typing import overload

from racecraft.league.board_row import BoardRow, figures_of
from racecraft.league.heats import remaining, solo_heat
from racecraft.league.race import Entry, Race, Result
from racecraft.league.ranking import Ranking
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
        before: The rows of this race a moment ago.
        racers: Whose entries or results came since; without `before` it does not count.
    """

    def __init__(
        self,
        race: Race,
        entries: Mapping[int, Entry],
        results: Mapping[str, Result],
        before: SoloRows | None = None,
        racers: Collection[str] = (),
    ) -> None:
        self._race, self._entries, self._results = race, entries, results
        own: dict[str, list[int]] = {}
        for number, entry in entries.items():
            if before is None or entry.racer in racers:
                own.setdefault(entry.racer, []).append(number)
        best = {racer: self._best(numbers) for racer, numbers in own.items()}
        self._own: Mapping[str, list[int]] = own if before is None else {**before._own, **own}
        self._ranking: Ranking[Ranked] = Ranking(best) if before is None else before._ranking.changed(best)

    @property
    def waiting(self) -> int:
        """How many entries have no result."""
        return remaining(self._race, self._entries, self._results)

    def of(self, racer: str) -> BoardRow | None:
        """Return a racer's row; None: nobody of that name has entered."""
        return self._row(self._ranking.index(racer)) if racer in self._ranking.best else None

    def __len__(self) -> int:
        return len(self._ranking.order)

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
            result = self._result(number)
            score = None if result is None else score_of(self._race, result)
            if score is not None and (score.key, number) < best[:2]:
                best = (score.key, number, score)
        return best

    def _row(self, index: int) -> BoardRow:
        order = self._ranking.order
        key, number, score = order[index]
        entry = self._entries[number]
        own = self._own[entry.racer]
        newest = self._result(own[-1])
        return BoardRow(
            place=None if score is None else 1 + bisect_left(order, (key,)),  # equal scores share it
            racer=entry.racer,
            model=entry.model,
            entry=number,
            score=None if score is None else score.value,
            gap=_difference(score, order[0][2]),
            interval=_difference(score, order[max(0, index - 1)][2]),
            submissions=len(own),
            failure="" if newest is None else newest.failure,
            waiting=sum(self._result(one) is None for one in own),
            **figures_of(self._result(number), 0),
        )

    def _result(self, entry: int) -> Result | None:
        return self._results.get(solo_heat(entry))


def _difference(score: Score | None, other: Score | None) -> float | None:
    return None if score is None or other is None else round(abs(score.value - other.value), 6)
