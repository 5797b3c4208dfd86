"""How a model comes into a race. Begin with `admit`."""

from __future__ import annotations

from pathlib import Path

from racecraft.contract.errors import SettingError
from racecraft.league.race import Entry, Race
from racecraft.league.snapshot import snapshot_of
from racecraft.league.store import League
from racecraft.league.world_part import league_world

MAX_NAME = 64


def admit(
    league: League, race: Race, source: str, racer: str, now: float, person: str = "", model: str | None = None
) -> Entry:
    """Copy and check a model, and add it to a race.

    Args:
        league: Where the race is.
        race: Which.
        source: The model, as the race's world takes it.
        racer: Name on the board.
        now: Seconds since 1970.
        person: Who owns the entry; "": the only user of the machine.
        model: What the board calls it; None: as the world does.

    Raises:
        UserInputError: The race takes no entry of this racer, or its rules refuse the model.
    """
    racer = require_name(racer, "the racer's name")
    model = model and require_name(model, "the model's name")
    _require_open(race, now)
    _require_submissions(league, race, racer, person)
    _require_qualified(league, race, racer)
    world = league_world(race.kind)

    def fill(folder: Path) -> Entry:
        facts = world.admit(source, folder, race.rules)
        return Entry(
            number=0, racer=racer, model=model or world.name_of(source), entered=now, person=person, facts=facts
        )

    return league.add_entry(race.id, fill)


def require_name(text: str, what: str) -> str:
    """Return a name as boards show it.

    Args:
        text: The name.
        what: Whose, for the message.

    Raises:
        SettingError: It is empty, too long, or holds characters that cannot be shown.
    """
    name = " ".join(text.split())
    if not name or len(name) > MAX_NAME or not name.isprintable():
        raise SettingError(
            "{what} is {text!r}; expected 1 to {most} printable characters.", what=what, text=text, most=MAX_NAME
        )
    return name


def _require_open(race: Race, now: float) -> None:
    if race.is_open(now):
        return
    if race.opens is not None and now < race.opens:
        raise SettingError("{race} is not open yet; expected an entry after its opening.", race=race.id)
    raise SettingError("{race} is closed; expected an open race.", race=race.id)


def _require_submissions(league: League, race: Race, racer: str, person: str) -> None:
    """Refuse a racer who has used up the submissions, and a name that is another person's."""
    own = [entry for entry in league.entries(race.id).values() if entry.racer == racer]
    if any(entry.person != person for entry in own):
        raise SettingError("{racer} is another racer's name in {race}; expected one of your own.", racer=racer,
                           race=race.id)  # fmt: skip
    if race.max_submissions is not None and len(own) >= race.max_submissions and not race.is_practice:
        raise SettingError(
            "{racer} has entered {race} {count} times; expected at most {most}.",
            racer=racer,
            race=race.id,
            count=len(own),
            most=race.max_submissions,
        )


def _require_qualified(league: League, race: Race, racer: str) -> None:
    if not race.qualifier:
        return
    before = league.race(race.qualifier)
    row = snapshot_of(league, before).board.row_of(racer)
    place = row.place if row else None
    if place is None or place > race.qualified:
        raise SettingError(
            "{racer} has place {place} in {qualifier}; expected one of the first {count}.",
            racer=racer,
            place="none" if place is None else place,
            qualifier=before.id,
            count=race.qualified,
        )
