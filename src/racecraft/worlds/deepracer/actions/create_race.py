"""Make a race of cars."""

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
from racecraft.worlds.deepracer.actions.mishap_options import MishapOptions

TYPES = ("TIME_TRIAL", "OBJECT_AVOIDANCE", "HEAD_TO_BOT", "HEAD_TO_MODEL")
DONE = ("any", "all")
ONLY_OF = {
    "boxes": "OBJECT_AVOIDANCE", "box_positions": "OBJECT_AVOIDANCE", "bots": "HEAD_TO_BOT",
    "bot_speed": "HEAD_TO_BOT", "bot_lane_change": "HEAD_TO_BOT", "done_condition": "HEAD_TO_MODEL",
    "race_seconds": "TIME_TRIAL",
}  # fmt: skip
"""Options that say something in one type of race alone."""


@dataclass(frozen=True, kw_only=True)
class DrivingOptions(Request):
    """How the race is driven; None: the default of `CarRules`."""

    PANEL: ClassVar[str] = "Driving"
    type: str | None = option(None, "Empty road (default), boxes, bots, or other cars.", choices=TYPES)
    laps: int | None = option(None, "Laps of a drive; 3 by default.", low=1, high=1000)
    is_continuous: bool | None = option(None, "Laps of one drive, as by default, or each from the start line.")
    reverse: bool | None = option(None, "In the opposite direction to the track's own.")
    race_seconds: float | None = option(None, "Most laps within this simulated time win (--ranking laps).", low=10)
    boxes: int | None = option(None, "Boxes of OBJECT_AVOIDANCE, 6 by default.", low=1)
    box_positions: str | None = option(None, 'Listed places "share,lane;…"; by default every drive has its own.')
    bots: int | None = option(None, "Bots of HEAD_TO_BOT, 3 by default.", low=1)
    bot_speed: float | None = option(None, "Their speed, 0.2 m/s by default.", low=0)
    bot_lane_change: bool | None = option(None, "Bots change lanes.")
    done_condition: str | None = option(None, "A meeting ends with the first that finishes, or all.", choices=DONE)


@dataclass(frozen=True, kw_only=True)
class CarOptions(Request):
    """What a car must be to enter; None: the default of `CarRules`."""

    PANEL: ClassVar[str] = "The car"
    generations: tuple[str, ...] = option((), "Vehicle profiles that may enter: v4, v5-classic, v6 (all by default).")
    sensors: tuple[str, ...] = option((), "Sensors that a car may have; any by default.")
    max_speed: float | None = option(None, "Highest speed that a car may command, 4 m/s by default.", low=0.1)
    min_actions: int | None = option(None, "Fewest actions of a discrete action space.", low=1)
    max_actions: int | None = option(None, "Most of them.", low=1)
    continuous: bool | None = option(None, "Continuous action spaces may enter, as by default.")


@dataclass(frozen=True, kw_only=True)
class CreateRaceRequest(LeagueOptions):
    """A new race of cars."""

    title: str = argument("Of the race, for people.", metavar="TITLE")
    track: tuple[str, ...] = option(("reinvent_base",), "Name of a track, or a file of one; several make a cup.")
    driving: DrivingOptions = group(DrivingOptions)
    mishaps: MishapOptions = group(MishapOptions)
    car: CarOptions = group(CarOptions)
    ranking: RankingOptions = group(RankingOptions)
    entries: DeadlineOptions = group(DeadlineOptions)


@action
def create_race(request: CreateRaceRequest, progress: Progress = quiet) -> ChangedRace:
    """Make a race of cars: where, how it is driven, which cars may enter, what decides it.

    Examples:

        racecraft league create "Club evening" --track Oval_track --closes +3h

        racecraft league create "Boxes" --type OBJECT_AVOIDANCE --boxes 3 --ranking average --laps 5 --window 3

        racecraft league create "Duel" --type HEAD_TO_MODEL --format bracket --laps 2

        racecraft league create "Cup" --track Oval_track --track reinvent_base --ranking total

    Raises:
        UserInputError: No such track, or a rule that cannot be.
    """
    from racecraft.worlds.deepracer.league.rules import CarRules
    from racecraft.worlds.deepracer.tracks.catalogue import known_name, load_track
    from racecraft.worlds.deepracer.tracks.importer import route_file

    meets = request.ranking.format != "solo"
    values = {
        name: value
        for part in (request.driving, request.mishaps, request.car)
        for name, value in part.values().items()
        if value not in (None, ())
    }
    if meets:
        values.setdefault("type", "HEAD_TO_MODEL")
    rules = CarRules(**values)
    for name, type in ONLY_OF.items():
        if name in values and rules.type != type:
            raise SettingError("--{name} is of --type {type}, and this race is {found}; expected one of both.",
                               name=name.replace("_", "-"), type=type, found=rules.type)  # fmt: skip
    if rules.is_meeting != meets:
        raise SettingError(
            "--type {type} and --format {format} do not fit; expected HEAD_TO_MODEL with round_robin or bracket, any "
            "other type with solo.",
            type=rules.type,
            format=request.ranking.format,
        )
    if (request.ranking.ranking == "laps") != (rules.race_seconds is not None):
        raise SettingError("--ranking laps and --race-seconds go together; expected both or neither.")
    tracks = [load_track(name) for name in request.track]
    own_tracks = {f"{one.name}.npy": route_file(one) for one in tracks if known_name(one.name) is None}
    race = make_race(
        request.league, request.title, "deepracer", [one.name for one in tracks], rules.laps, rules.as_dictionary(),
        request.ranking, request.entries, own_tracks=own_tracks,
    )  # fmt: skip
    return ChangedRace(race)
