"""Settings of a race and of the frame that a car's policy sees."""

from __future__ import annotations

from dataclasses import dataclass

from racecraft.settings.table import check_group, setting


@dataclass(frozen=True)
class RaceConfig:
    """The race: which car, how episodes start and end."""

    car: str = setting(
        "v6",
        "Vehicle profile: the console's car until mid-2022, its later one, today's (ROS 2), or the ideal bicycle.",
        choices=("v4", "v5-classic", "v6", "kinematic"),
    )
    max_episode_seconds: float | None = setting(
        None,
        "An episode is cut after this much simulated time; by default 100 s, or 100 000 ticks with fidelity aws.",
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
        5.0, "A call of the reward function that lasts longer ends the training with a letter.", unit="s", low=0.01
    )
    fidelity: str = setting(
        "sane",
        "Whose habits the world has where the original's are bugs: `racecraft.envs.deepracer.fidelity` lists each.",
        choices=("sane", "aws"),
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
