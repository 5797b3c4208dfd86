"""Which heats of a race are still to be judged: a function of its entries and results alone. Begin with `next_heat`."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

from racecraft.league.ladder import meetings_left, next_meeting
from racecraft.league.race import BRACKET, LADDER, SOLO, Entry, Race, Result


@dataclass(frozen=True)
class Heat:
    """Entries that are driven together."""

    name: str
    """Name of its result."""
    entries: tuple[int, ...]
    round: int = 0


def solo_heat(entry: int) -> str:
    """Return the heat of an entry that drives alone."""
    return f"{entry:05}"


def next_heat(race: Race, entries: Mapping[int, Entry], results: Mapping[str, Result]) -> Heat | None:
    """Return the heat to be judged next; None where nothing is left to do.

    A bracket and a round robin need all entries: they wait until the race is closed, which the caller checks.
    """
    if race.format == SOLO:
        heats = (Heat(solo_heat(number), (number,)) for number in entries)
        return next((heat for heat in heats if heat.name not in results), None)
    field = latest_of_each(entries)
    if race.format == BRACKET:
        return _bracket_heat(field, results)
    if race.format == LADDER:
        group = next_meeting(race, field, entries, results)
        return None if group is None else Heat(_free_name(results), tuple(group))
    return next((heat for heat in _pairs(field) if heat.name not in results), None)


def remaining(race: Race, entries: Mapping[int, Entry], results: Mapping[str, Result]) -> int:
    """Return how many heats are still to be judged."""
    if race.format == SOLO:
        return sum(solo_heat(number) not in results for number in entries)
    field = latest_of_each(entries)
    if race.format == LADDER:
        return meetings_left(race, field, results)
    if race.format == BRACKET:
        return max(0, len(field) - 1 - len(results))
    return sum(heat.name not in results for heat in _pairs(field))


def latest_of_each(entries: Mapping[int, Entry]) -> list[int]:
    """Return the newest entry of each racer, in the order of their numbers."""
    return sorted({entry.racer: number for number, entry in sorted(entries.items())}.values())


def _pairs(field: Sequence[int]) -> Iterator[Heat]:
    return (Heat(f"{a:05}-{b:05}", (a, b)) for a, b in itertools.combinations(field, 2))


def _free_name(results: Mapping[str, Result]) -> str:
    names = (f"meeting-{number:05}" for number in itertools.count(len(results) + 1))
    return next(name for name in names if name not in results)


def _bracket_heat(field: Sequence[int], results: Mapping[str, Result]) -> Heat | None:
    for number, round_ in enumerate(bracket(field, results), start=1):
        for index, pair in enumerate(round_):
            if len(pair) == 2 and winner_of(number, index, results) is None:
                return Heat(_bracket_name(number, index), (pair[0], pair[1]), number)
    return None


def bracket(field: Sequence[int], results: Mapping[str, Result]) -> list[list[tuple[int, ...]]]:
    """Return the rounds of a bracket as far as they are known, each a list of meetings; one alone moves on.

    The first entries meet the last ones, so that the order of entry seeds the bracket and byes go to the first.

    >>> bracket([1, 2, 3], {})
    [[(1,), (2, 3)]]
    """
    if not field:
        return []
    size = 2 ** max(0, math.ceil(math.log2(len(field))))
    slots = [field[seed] if seed < len(field) else None for seed in _seeding(size)]
    rounds: list[list[tuple[int, ...]]] = []
    while True:
        pairs = [
            tuple(one for one in pair if one is not None) for pair in zip(slots[::2], slots[1::2], strict=True)
        ] if len(slots) > 1 else []  # fmt: skip
        if not pairs:
            return rounds
        rounds.append(pairs)
        winners = [
            pair[0] if len(pair) == 1 else winner_of(len(rounds), index, results)
            for index, pair in enumerate(pairs)
        ]  # fmt: skip
        if None in winners:
            return rounds
        slots = winners


def winner_of(number: int, index: int, results: Mapping[str, Result]) -> int | None:
    """Return the entry that won a meeting of a bracket; of equals the one that was entered first. None: not yet."""
    result = results.get(_bracket_name(number, index))
    return None if result is None else standing_of(result)[0]


def standing_of(result: Result) -> list[int]:
    """Return a heat's entries, the winner first; over several tracks by the sum of places, then of seconds."""
    sums = [
        (
            sum(drive.outcomes[index].place for drive in result.drives),
            sum(drive.outcomes[index].total_seconds for drive in result.drives),
            entry,
        )
        for index, entry in enumerate(result.entries)
    ]
    return [entry for *_, entry in sorted(sums)]


def _bracket_name(number: int, index: int) -> str:
    return f"round-{number}-{index + 1:03}"


def _seeding(size: int) -> list[int]:
    """Return seeds in the order of the slots.

    >>> _seeding(4)
    [0, 3, 1, 2]
    """
    order = [0]
    while len(order) < size:
        order = [seed for one in order for seed in (one, 2 * len(order) - 1 - one)]
    return order
