"""Population-based training: members train side by side, and the bad ones take over from the good. Begin with `train`.

Source: Jaderberg et al., "Population based training of neural networks", 2017. After each round

* exploit: a member of the worst quarter takes over the weights of one of the best quarter (truncation selection);
* explore: it then changes that one's settings: each is made a fifth larger or smaller, or drawn anew now and then.

All others go on with their own run, settings and optimiser, as if nothing had happened. Who takes over weights begins
a run of its own with `--from`: weights are taken, the optimiser's own figures and the counts begin anew, which the
paper copies too. Everything stands in `population.json` (formats), so that a broken-off population goes on.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any, Protocol

import numpy as np

from racecraft.contract.errors import SettingError
from racecraft.contract.random_streams import generator
from racecraft.formats.population import MemberRound, PopulationRecord, read_population, write_population
from racecraft.formats.tuning import COMPLETE, FAILED
from racecraft.jobs.tuning.search import LOOK_SECONDS, Trial
from racecraft.jobs.tuning.space import CategoricalParameter, IntegerParameter, Parameter
from racecraft.jobs.tuning.study import TuningError

QUARTER = 0.25
"""Share of the members that take over, and of those that are taken from; one at least."""
FACTORS = (0.8, 1.2)
"""What a setting is multiplied by."""
ANEW = 0.25
"""How likely a setting is drawn anew instead."""


class MemberTrial(Trial, Protocol):
    """A member's round under way."""

    def last_iteration(self) -> int | None:
        """Return the iteration of its last checkpoint; None without one."""


Launch = Callable[[MemberRound, MemberRound | None], MemberTrial]
"""Begins a member's round, or goes on with it; the second is whose weights it takes over, as they stood."""
RoundCallback = Callable[[MemberRound], None]


def train(
    folder: Path,
    record: PopulationRecord,
    parameters: Mapping[str, Parameter],
    launch: Launch,
    parallel: int,
    on_round: RoundCallback,
) -> PopulationRecord:
    """Train a population to the end of its last round; one that lies there is gone on with.

    Args:
        folder: Where it lies or will lie.
        record: What is asked; without members.
        parameters: What may be varied, by name.
        launch: Begins a member's round.
        parallel: How many at a time.
        on_round: Hears of every member's round that ends.

    Raises:
        TuningError: Another population lies there, or every member of a round failed.
    """
    record = _started(folder, record)
    for number in range(record.rounds):
        for one in _members_of(record, number, parameters):
            record = record.with_member(one)
        write_population(folder, record)
        record = _round(folder, record, number, launch, parallel, on_round)
        if all(one.state == FAILED for one in record.of_round(number)):
            raise TuningError(
                "every member of round {number} failed. Last: {note}; "
                "{folder} holds their runs, and `racecraft jobs logs` says what they said.",
                number=number,
                note=record.of_round(number)[-1].note,
                folder=folder,
            )
    return record


def check_population(size: int, rounds: int) -> None:
    """Refuse what is no population.

    Raises:
        SettingError: Too few members or rounds.
    """
    if size < 2 or rounds < 2:
        raise SettingError(
            "{size} members, {rounds} rounds; expected at least 2 of each: who is worse takes over.",
            size=size,
            rounds=rounds,
        )


def first_values(parameters: Mapping[str, Parameter], rng: np.random.Generator) -> dict[str, Any]:
    """Draw settings evenly over their ranges."""
    return {name: _drawn(one, rng) for name, one in parameters.items()}


def explore(values: Mapping[str, Any], parameters: Mapping[str, Parameter], rng: np.random.Generator) -> dict[str, Any]:
    """Return settings near others, within their bounds: each a fifth larger or smaller, or drawn anew.

    A whole number moves by one at least, and one of several words to a neighbour in the list.
    """
    return {
        name: _drawn(one, rng) if rng.random() < ANEW else _moved(values[name], one, rng)
        for name, one in parameters.items()
    }


def _started(folder: Path, record: PopulationRecord) -> PopulationRecord:
    there = read_population(folder)
    if there is None:
        return record
    if replace(there, members=(), rounds=record.rounds) != record:
        raise TuningError(
            "{folder}: another population lies here ({size} members of {command} over "
            "{parameters}); expected the same, to go on with it, or more rounds. Give another --run.",
            folder=folder,
            size=there.size,
            command=" ".join(there.command),
            parameters=", ".join(there.parameters),
        )
    return replace(there, rounds=max(there.rounds, record.rounds))


def _members_of(record: PopulationRecord, number: int, parameters: Mapping[str, Parameter]) -> list[MemberRound]:
    """Return a round's members as they begin; those that the record has already, as they stand there."""
    if stands := record.of_round(number):
        return stands
    rng = generator(record.seed, f"population round {number}")
    if number == 0:
        return [
            MemberRound(0, member, first_values(parameters, rng), f"{member}-0", 0) for member in range(record.size)
        ]
    before = record.best_first(record.of_round(number - 1))
    count = max(1, math.floor(QUARTER * record.size))
    worst = {one.member for one in before[-count:]} | {one.member for one in before if one.state == FAILED}
    best = [one for one in before[:count] if one.member not in worst]
    members = []
    for one in sorted(before, key=lambda member: member.member):
        taken = best[int(rng.integers(len(best)))] if one.member in worst and best else None
        members.append(_next_round(one, taken, number, parameters, rng))
    return members


def _next_round(
    one: MemberRound,
    taken: MemberRound | None,
    number: int,
    parameters: Mapping[str, Parameter],
    rng: np.random.Generator,
) -> MemberRound:
    if taken is None:
        return MemberRound(number, one.member, one.values, one.run, one.begun)
    values = explore(taken.values, parameters, rng)
    return MemberRound(number, one.member, values, f"{one.member}-{number}", number, parent=taken.member)


def _round(
    folder: Path, record: PopulationRecord, number: int, launch: Launch, parallel: int, on_round: RoundCallback
) -> PopulationRecord:
    """Train every member that has not ended its round, so many at a time; who takes over weights is first."""
    before = {one.member: one for one in record.of_round(number - 1)}
    waiting = [one for one in record.of_round(number) if not one.state]
    waiting.sort(key=lambda one: one.parent is None)
    under_way: dict[int, tuple[MemberRound, MemberTrial, float]] = {}
    try:
        while waiting or under_way:
            while waiting and len(under_way) < parallel:
                one = waiting.pop(0)
                trial = launch(one, None if one.parent is None else before[one.parent])
                under_way[one.member] = one, trial, time.monotonic()
            time.sleep(LOOK_SECONDS)
            for member, (one, trial, since) in list(under_way.items()):
                standing = trial.poll()
                if not standing.ended:
                    continue
                del under_way[member]
                score = standing.scores[-1][1] if standing.scores and not standing.failure else None
                ended = replace(
                    one, score=score, iteration=trial.last_iteration(), state=FAILED if score is None else COMPLETE,
                    seconds=time.monotonic() - since,
                    note="" if score is not None else standing.failure or "it ended without a score",
                )  # fmt: skip
                record = record.with_member(ended)
                write_population(folder, record)
                on_round(ended)
    finally:
        for _, trial, _ in under_way.values():
            trial.stop()
    return record


def _drawn(one: Parameter, rng: np.random.Generator) -> Any:
    if isinstance(one, CategoricalParameter):
        return one.values[int(rng.integers(len(one.values)))]
    share = float(rng.random())
    if one.is_log:
        value = math.exp(math.log(one.min_value) + share * (math.log(one.max_value) - math.log(one.min_value)))
    else:
        value = one.min_value + share * (one.max_value - one.min_value)
    return _within(value, one)


def _moved(value: Any, one: Parameter, rng: np.random.Generator) -> Any:
    up = bool(rng.integers(2))
    if isinstance(one, CategoricalParameter):
        at = list(one.values).index(value) + (1 if up else -1)
        return one.values[min(max(at, 0), len(one.values) - 1)]
    moved = value * FACTORS[up]
    if isinstance(one, IntegerParameter) and round(moved) == value:
        moved = value + (1 if up else -1)
    return _within(moved, one)


def _within(value: float, one: Any) -> Any:
    held = min(max(value, one.min_value), one.max_value)
    return round(held) if isinstance(one, IntegerParameter) else float(held)
