"""Enter a race, or take an entry back."""

from __future__ import annotations

import time
from dataclasses import dataclass
from pathlib import Path

from racecraft.actions.action import action
from racecraft.actions.league.options import RaceNamed, user_name
from racecraft.contract.progress import Progress, quiet
from racecraft.league.race import Entry, Race
from racecraft.settings.request import argument, option


@dataclass(frozen=True, kw_only=True)
class EnterRequest(RaceNamed):
    """Which model enters, and under which name."""

    model: str = argument("RUN[:best|last|N], an archive of one, or another program's model.", metavar="MODEL")
    racer: str | None = option(None, "Name on the board; by default your account's.")
    model_name: str | None = option(None, "What the board calls the model; by default the name of its folder or file.")
    person: str = option("", "Who owns the entry, as the console knows people.", is_hidden=True)


@dataclass(frozen=True)
class Entered:
    """An entry of a race."""

    race: str
    entry: Entry
    submissions_left: int | None
    """How often this racer may still enter; None: any number of times."""


@action
def enter_race(request: EnterRequest, progress: Progress = quiet) -> Entered:
    """Enter a model: it is copied as it is now, checked against the race's rules, and waits to be judged.

    Examples:

        racecraft league enter club-evening runs/oval-1 --racer Mia

        racecraft league enter club-evening ~/Downloads/old-model.tar.gz

    Raises:
        UserInputError: The race takes no entry, or its rules refuse the model; the message says why.
    """
    from racecraft.league.entering import admit

    league = request.open()
    race = league.race(request.race)
    racer = user_name() if request.racer is None else request.racer
    entry = admit(league, race, request.model, racer, time.time(), request.person, request.model_name)
    own = sum(one.racer == entry.racer for one in league.entries(race.id).values())
    return Entered(race.id, entry, None if race.max_submissions is None else race.max_submissions - own)


@dataclass(frozen=True, kw_only=True)
class WithdrawRequest(RaceNamed):
    """Which entry is taken back."""

    entry: int = argument("Its number.", metavar="ENTRY")


@dataclass(frozen=True)
class Withdrawn:
    """An entry that was taken back."""

    race: str
    entry: int
    kept: Path
    """Where its files are."""


@action
def withdraw_entry(request: WithdrawRequest, progress: Progress = quiet) -> Withdrawn:
    """Take an entry and its result off the board; its files are kept.

    Example: racecraft league withdraw club-evening 3
    """
    league = request.open()
    race: Race = league.race(request.race)
    league.withdraw(race.id, request.entry)
    return Withdrawn(race.id, request.entry, league.folder(race.id) / "withdrawn" / f"{request.entry:05}")
