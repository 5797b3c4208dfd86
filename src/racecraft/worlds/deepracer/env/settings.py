"""Settings of a race, of what stands or drives in its way, and of the frame that a car's policy sees."""

from __future__ import annotations

from dataclasses import dataclass

from racecraft.settings.composition import Settings
from racecraft.settings.table import check_group, setting
from racecraft.worlds.deepracer.env.objects import BOX_TYPES, read_positions

TIME_TRIAL, OBJECT_AVOIDANCE, HEAD_TO_BOT, HEAD_TO_MODEL = RACE_TYPES = (
    "TIME_TRIAL",
    "OBJECT_AVOIDANCE",
    "HEAD_TO_BOT",
    "HEAD_TO_MODEL",
)
"""What a race is about, in AWS's words."""
MAX_CARS = 8
"""In one race."""


@dataclass(frozen=True)
class RaceConfig:
    """The race: which car, how episodes start and end."""

    type: str = setting(
        TIME_TRIAL,
        "What the race is about: an empty road, boxes to drive round (the group boxes), bots to overtake (bots), or "
        "other cars (against).",
        choices=RACE_TYPES,
    )
    car: str = setting(
        "v6",
        "Vehicle profile: the console's car until mid-2022, its later one, today's (ROS 2), today's without limits of "
        "grip, acceleration and speed, or the ideal bicycle.",
        choices=("v4", "v5-classic", "v6", "v6-unlimited", "kinematic"),
    )
    max_episode_seconds: float | None = setting(
        None,
        "An episode is cut after this much simulated time, times the laps it may have; by default 100 s, or as long "
        "as a lap at 0.4 m/s takes where that is more, or 100 000 ticks with fidelity aws.",
        unit="s",
        low=1.0,
    )
    max_training_seconds: float | None = setting(
        None,
        "In training a car that completes a lap drives on, and is put back to a standing start after this much "
        "simulated time since the last one; by default as long as 1.2 laps at its fastest command take or, where that "
        "is longer, one at the speeds it can hold along the centre line. Judging keeps its laps, and so does training "
        "with fidelity aws, on an open track and against others.",
        unit="s",
        low=1.0,
    )
    practice_seconds: float | None = setting(
        None,
        "In training four of five drives of a car are over after this much simulated time, so that it practises more "
        "standing starts. By default every drive is a whole one, as it always is in judging, with fidelity aws, on an "
        "open track and against others.",
        unit="s",
        low=1.0,
    )
    start_offset: float = setting(
        0.0,
        "Where on the lap the first start lies; cars side by side are spread from there.",
        unit="lap",
        low=0.0,
        high=1.0,
    )
    start_advance: float = setting(
        0.05, "How far round the next start of a car lies after each training episode.", unit="lap", low=0.0, high=1.0
    )
    change_start: bool = setting(True, "Whether training starts advance round the track at all.")
    reverse: bool = setting(False, "Drive the track in the opposite direction.")
    waypoints: str = setting(
        "as_filed",
        "Whether a row that a route file repeats (59 of AWS's do) counts as a waypoint: as_filed, in all of AWS's logs "
        "of 2020 to 2026; distinct, in the code of simapp 6.0.5.",
        choices=("as_filed", "distinct"),
    )
    reward_seconds: float = setting(
        5.0, "A call of the reward function that lasts longer ends the training with an error.", unit="s", low=0.01
    )
    fidelity: str = setting(
        "sane",
        "Whose habits the world has where the original's are bugs: "
        "`racecraft.worlds.deepracer.env.fidelity` lists each.",
        choices=("sane", "aws"),
    )

    def __post_init__(self) -> None:
        check_group(self)


@dataclass(frozen=True)
class BoxesConfig:
    """What stands on the road in a race of OBJECT_AVOIDANCE."""

    number: int = setting(6, "Boxes on the lap; where positions are listed, they say how many.", low=0, high=100)
    min_distance: float = setting(
        2.0, "Least distance between boxes along the centre line; with fidelity aws it slips.", unit="m", low=0.0
    )
    random: bool = setting(True, "Every episode has places of its own; otherwise they are spread evenly, lane by lane.")
    type: str = setting("box_obstacle", "How a box is built and painted.", choices=BOX_TYPES)
    as_cars: bool = setting(False, "Cars that stand instead of boxes.")
    positions: str = setting(
        "",
        'Listed places "share,lane;share,lane": share of the lap from 0 to 1, lane -1 is the outer, 1 the inner one.',
    )

    def __post_init__(self) -> None:
        check_group(self)
        read_positions(self.positions)


@dataclass(frozen=True)
class BotsConfig:
    """The cars that drive on rails in a race of HEAD_TO_BOT."""

    number: int = setting(3, "Bots on the lap.", low=0, high=100)
    min_distance: float = setting(
        2.0, "Least distance between bots along the centre line where they begin.", unit="m", low=0.0
    )
    random: bool = setting(False, "Every episode has places of its own; otherwise bots begin spread evenly.")
    speed: float = setting(0.2, "How fast bots drive along the centre line.", unit="m/s", low=0.0, high=6.0)
    lane_change: bool = setting(False, "Bots change lanes.")
    lane_change_after_low: float = setting(3.0, "Least time that a bot keeps a lane.", unit="s", low=0.0)
    lane_change_after_high: float = setting(5.0, "Most time that a bot keeps a lane.", unit="s", low=0.0)
    lane_change_distance: float = setting(1.0, "Way that a change of lanes takes.", unit="m", low=0.1)
    penalty: float = setting(
        5.0, "All bots stand for so long after one of them ran into a car from behind.", unit="s", low=0.0
    )

    def __post_init__(self) -> None:
        check_group(self)


@dataclass(frozen=True)
class AgainstConfig:
    """Whom a learning car meets in a race of HEAD_TO_MODEL."""

    cars: int = setting(2, "Cars in each race, the learner's own among them.", low=2, high=MAX_CARS)
    chosen_share: float = setting(
        0.5, "Share of the races against chosen models, where itself is met besides them.", low=0.0, high=1.0
    )
    pool_share: float = setting(
        0.5, "Share of the other races that is against past selves from the pool, not itself.", low=0.0, high=1.0
    )
    pool_size: int = setting(8, "Past selves in the pool; the oldest leave it.", low=1, high=100)
    pool_every: int = setting(10, "A self enters the pool after every so many iterations.", unit="iterations", low=1)
    slowest: float = setting(
        0.5,
        "Cars of past selves drive at a share of the speed that they are told: from this one to all of it, spread over "
        "their races, so that there is somebody to overtake; 1: all as fast as told.",
        low=0.1,
        high=1.0,
    )
    start_ahead: float = setting(
        1.5,
        "A car that is put back starts so far ahead of another car of its race, behind it where that one is slower, so "
        "that they meet again at once; 0: where its own next start lies.",
        unit="m",
        low=0.0,
        high=20.0,
    )

    def __post_init__(self) -> None:
        check_group(self)


@dataclass(frozen=True)
class CameraConfig:
    """The frame the policy sees; same optics at every size."""

    width: int = setting(40, "Pixels across.", unit="px", low=8, high=640)
    height: int = setting(30, "Pixels down.", unit="px", low=6, high=480)
    light: str = setting(
        "car",
        "Year of the original whose light falls on the circuit; car: 2021 for classic cars, 2026 for today's.",
        choices=("car", "2019", "2021", "2026"),
    )
    grass: bool = setting(False, "The field has the grain of grass, as in the original, instead of one plain colour.")

    def __post_init__(self) -> None:
        check_group(self)


def race_groups(race_type: str) -> dict[str, BoxesConfig | BotsConfig | AgainstConfig]:
    """Return the groups of settings that a type of race brings along, with their defaults.

    >>> list(race_groups("OBJECT_AVOIDANCE")), list(race_groups("TIME_TRIAL"))
    (['boxes'], [])
    """
    if race_type == OBJECT_AVOIDANCE:
        return {"boxes": BoxesConfig()}
    if race_type == HEAD_TO_BOT:
        return {"bots": BotsConfig()}
    return {"against": AgainstConfig()} if race_type == HEAD_TO_MODEL else {}


def objects_in(race_type: str) -> BoxesConfig | BotsConfig | None:
    """Return what stands or drives in the way where nothing else is asked; other cars are no objects."""
    own = next(iter(race_groups(race_type).values()), None)
    return own if isinstance(own, BoxesConfig | BotsConfig) else None


def objects_of(settings: Settings) -> BoxesConfig | BotsConfig | None:
    """Return what stands or drives in the way of a race with these settings."""
    found = next((getattr(settings, name) for name in race_groups(settings.race.type) if name in settings), None)
    return found if isinstance(found, BoxesConfig | BotsConfig) else None


def with_race_groups(settings: Settings) -> Settings:
    """Return the settings without the groups of other types of race, and with those of its own."""
    wanted = race_groups(settings.race.type)
    for race_type in RACE_TYPES:
        for name, group in race_groups(race_type).items():
            if name not in wanted:
                settings = settings.without(name)
            elif name not in settings:
                settings = settings.with_group(name, group)
    return settings
