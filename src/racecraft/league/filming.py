"""Films of judged drives. Begin with `film`."""

from __future__ import annotations

from pathlib import Path

from racecraft.contract.errors import SettingError
from racecraft.league.race import Race, Result
from racecraft.league.store import League
from racecraft.league.world_part import DriveOrder, league_world


def film(league: League, race: Race, entry: int, video: Path, heat: str | None = None, track: int = 1) -> Result:
    """Film what an entry drove; return the result that was filmed.

    Args:
        league: Where the race is.
        race: Which.
        entry: Number of the entry; it is seen, or sees.
        video: The file to write, .mp4.
        heat: Name of the heat; None: the entry's newest.
        track: Of a cup, which track, from 1.

    Raises:
        UserInputError: Nothing of it was judged, or its files are missing or damaged.
    """
    result = _result(league, race, entry, heat)
    if not 1 <= track <= len(result.drives):
        raise SettingError("{race} has {count} tracks, and no number {track}.", race=race.id, count=len(result.drives),
                           track=track)  # fmt: skip
    drive, entries = result.drives[track - 1], league.entries(race.id)
    order = DriveOrder(
        rules=race.rules,
        track=league.track(race.id, drive.track),
        seed=drive.seed,
        models=tuple(str(league.model(race.id, number)) for number in result.entries),
        names=tuple(entries[number].racer for number in result.entries),
    )
    folder = league.folder(race.id) / drive.folder
    league_world(race.kind).film(order, folder, video, result.entries.index(entry))
    return result


def _result(league: League, race: Race, entry: int, heat: str | None) -> Result:
    standing = league.entries(race.id).keys()
    of_it = (one for one in league.results(race.id).values() if entry in one.entries and heat in (None, one.heat))
    own = [one for one in of_it if one.drives and standing >= set(one.entries)]
    if not own:
        raise SettingError(
            "{race} has no judged drive of entry {entry} that still stands; "
            "expected one that `racecraft league board {race} --json` names.",
            race=race.id,
            entry=entry,
        )
    return max(own, key=lambda one: one.judged)
