"""Racers by what is best of each; a few changes cost little. See `Ranking`."""

from __future__ import annotations

from bisect import bisect_left, insort
from collections.abc import Mapping
from typing import Any, Generic, TypeVar

Item = TypeVar("Item", bound=tuple[Any, ...])


class Ranking(Generic[Item]):
    """Racers in order; it never changes.

    Args:
        best: What is best of each racer; the smaller one stands above.
    """

    def __init__(self, best: Mapping[str, Item]) -> None:
        self.best = best
        self.order = sorted(best.values())

    def changed(self, best: Mapping[str, Item]) -> Ranking[Item]:
        """Return the ranking in which some racers have other items."""
        made = Ranking[Item]({})
        made.best, made.order = {**self.best, **best}, list(self.order)
        for racer, item in best.items():
            if racer in self.best:
                del made.order[bisect_left(made.order, self.best[racer])]
            insort(made.order, item)
        return made

    def index(self, racer: str) -> int:
        """Return where a racer stands, from 0."""
        return bisect_left(self.order, self.best[racer])
