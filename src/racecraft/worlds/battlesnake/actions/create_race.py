"""Make a race of snakes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from racecraft.actions.action import action
from racecraft.actions.league.making import DeadlineOptions, RankingOptions, make_race
from racecraft.actions.league.managing import ChangedRace
from racecraft.actions.league.options import LeagueOptions
from racecraft.contract.errors import SettingError
from racecraft.contract.progress import Progress, quiet
from racecraft.settings.request import Request, argument, group, option

MAX_SNAKES = 8


@dataclass(frozen=True, kw_only=True)
class SnakeOptions(Request):
    """How games are played, and who may enter."""

    PANEL: ClassVar[str] = "Games"
    snakes: int = option(2, "Snakes at a board; more than two in a ladder alone.", low=2, high=MAX_SNAKES)
    width: int = option(11, "Squares from left to right.", "--width", "-W")
    height: int = option(11, "Squares from bottom to top.", "--height", "-H")
    ruleset: str = option("standard", "Rules: standard, royale, constrictor, …", "--gametype", "-g")
    timeout_ms: int = option(500, "Milliseconds for an answer.", "--timeout", "-t", low=1)
    most_turns: int = option(1000, "A longer game is a draw.", low=1)
    files: bool = option(True, "A FILE.py may enter; it can compute and nothing else.")
    addresses: bool = option(True, "Servers may enter by their address.")
    file_memory: int = option(512, "MB of memory a FILE.py may use.", low=64)


@dataclass(frozen=True, kw_only=True)
class CreateSnakeRaceRequest(LeagueOptions):
    """A new race of snakes."""

    title: str = argument("Of the race, for people.", metavar="TITLE")
    map_name: tuple[str, ...] = option(("standard",), "Map: standard, royale, arcade_maze, …", "--map", "-m")
    games: SnakeOptions = group(SnakeOptions)
    ranking: RankingOptions = group(RankingOptions)
    entries: DeadlineOptions = group(DeadlineOptions)


@action
def create_snake_race(request: CreateSnakeRaceRequest, progress: Progress = quiet) -> ChangedRace:
    """Make a race of snakes: which games, who may enter, who meets whom. By default it is a ladder that ratings decide.

    Examples:

        racecraft league create-snakes "Snake evening" --closes +3h

        racecraft league create-snakes "Fours" --snakes 4 --meetings 20

        racecraft league create-snakes "Cup" --format bracket --map standard --map royale

    Raises:
        UserInputError: No such map or rules, or a rule that cannot be.
    """
    from racecraft.league.race import LADDER, SOLO
    from racecraft.worlds.battlesnake.league.race_rules import SnakeRules
    from racecraft.worlds.battlesnake.league.races import SnakeLeague

    values = request.games.values()
    snakes = values.pop("snakes")
    rules = SnakeRules(**values)
    ranking = request.ranking if request.ranking.format != SOLO else RankingOptions(
        format=LADDER, meetings=request.ranking.meetings
    )  # fmt: skip
    if snakes > 2 and ranking.format != LADDER:
        raise SettingError("--snakes {snakes} and --format {format} do not fit; expected 2, or a ladder.",
                           snakes=snakes, format=ranking.format)  # fmt: skip
    maps = [SnakeLeague().canonical_track(name) for name in request.map_name]
    for name in maps:
        rules.game(name, snakes)
    race = make_race(
        request.league, request.title, "battlesnake", maps, 1, rules.as_dictionary(), ranking, request.entries, snakes
    )
    return ChangedRace(race)
