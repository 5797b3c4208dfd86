"""The rules of a car race, and what a car must be to enter it. Begin with `CarRules`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

from racecraft.contract.errors import Faults, SettingError, nearest
from racecraft.league.world_part import require_known_rules
from racecraft.settings.table import setting
from racecraft.worlds.deepracer.env.settings import (
    HEAD_TO_BOT,
    HEAD_TO_MODEL,
    OBJECT_AVOIDANCE,
    RACE_TYPES,
    TIME_TRIAL,
    BotsConfig,
    BoxesConfig,
    RaceConfig,
)
from racecraft.worlds.deepracer.evaluation.head_to_head import DONE_CONDITIONS, HeadToHead
from racecraft.worlds.deepracer.evaluation.mishap_rules import MishapRules
from racecraft.worlds.deepracer.evaluation.trial_race import TrialRaceRules
from racecraft.worlds.deepracer.files.sensor_names import CAMERAS, LIDARS

GENERATIONS = ("v4", "v5-classic", "v6")
"""Cars that exist; `v6-unlimited` and `kinematic` are for experiments."""
SENSORS = (*CAMERAS, *LIDARS)


@dataclass(frozen=True)
class CarRules(MishapRules):
    """How a race is driven, and which cars may enter."""

    type: str = setting(TIME_TRIAL, "An empty road, boxes, bots, or other cars.", choices=RACE_TYPES)
    laps: int = setting(3, "Laps of a drive.", low=1, high=1000)
    is_continuous: bool = setting(True, "Laps of one drive, instead of each from the start line.")
    reverse: bool = setting(False, "In the opposite direction to the track's own.")
    race_seconds: float | None = setting(
        None, "Simulated time of a race in which most laps win; None: laps alone end it.", unit="s", low=10.0,
        high=1000.0,
    )  # fmt: skip
    boxes: int = setting(6, "Boxes of OBJECT_AVOIDANCE.", low=1, high=100)
    box_positions: str = setting("", 'Listed places "share,lane;…"; by default every drive has places of its own.')
    bots: int = setting(3, "Bots of HEAD_TO_BOT.", low=1, high=100)
    bot_speed: float = setting(0.2, "How fast bots drive.", unit="m/s", low=0.0, high=6.0)
    bot_lane_change: bool = setting(False, "Bots change lanes.")
    done_condition: str = setting("all", "A meeting ends with the first car that finishes, or the last.",
                                  choices=DONE_CONDITIONS)  # fmt: skip
    generations: tuple[str, ...] = setting(GENERATIONS, "Vehicle profiles that may enter.")
    sensors: tuple[str, ...] = setting(SENSORS, "Sensors that a car may have.")
    max_speed: float = setting(4.0, "Highest speed that a car may command.", unit="m/s", low=0.1, high=10.0)
    min_actions: int = setting(1, "Fewest actions of a discrete action space.", low=1)
    max_actions: int | None = setting(None, "Most actions of a discrete action space; None: any number.", low=1)
    continuous: bool = setting(True, "Continuous action spaces may enter.")

    def __post_init__(self) -> None:
        super().__post_init__()
        for name in self.generations:
            if name not in (*GENERATIONS, "v6-unlimited", "kinematic"):
                raise SettingError("there is no car {name!r}. {hint}", name=name, hint=nearest(name, GENERATIONS))
        for name in self.sensors:
            if name not in SENSORS:
                raise SettingError("there is no sensor {name!r}. {hint}", name=name, hint=nearest(name, SENSORS))
        if self.max_actions is not None and self.max_actions < self.min_actions:
            fields = {"setting": "CarRules.min_actions", "found": self.min_actions, "most": self.max_actions}
            raise SettingError("{setting} is {found}; expected at most {most}, the most actions.", **fields)
        if self.type == OBJECT_AVOIDANCE:
            self.objects()

    @classmethod
    def from_dictionary(cls, values: Mapping[str, Any]) -> CarRules:
        """Return the rules that `as_dictionary` wrote.

        Raises:
            SettingError: An unknown rule, or a value out of its range.
        """
        require_known_rules(cls, values)
        plain: dict[str, Any] = {
            name: tuple(value) if isinstance(value, list) else value for name, value in values.items()
        }
        return cls(**plain)

    def as_dictionary(self) -> dict[str, Any]:
        """Return every rule by name, fit for JSON."""
        return {name: list(value) if isinstance(value, tuple) else value for name, value in asdict(self).items()}

    def trial_rules(self) -> TrialRaceRules:
        """Return how a car alone is judged."""
        laps = self.laps if self.race_seconds is None else int(self.race_seconds)
        return TrialRaceRules(
            number_of_trials=laps,
            is_continuous=self.is_continuous or self.race_seconds is not None,
            race_seconds=self.race_seconds,
            **self.mishaps(),
        )

    def meeting_rules(self) -> HeadToHead:
        """Return how cars that meet each other are judged; each stands once on every place of the grid."""
        return HeadToHead(laps=self.laps, done_condition=self.done_condition, **self.mishaps())

    def race_config(self, car: str) -> RaceConfig:
        """Return the race as a world takes it: nothing of it is the racer's choice but the car.

        Args:
            car: The car's vehicle profile.
        """
        seconds = None if self.race_seconds is None else self.race_seconds / int(self.race_seconds)
        return RaceConfig(
            type=self.type, car=car, reverse=self.reverse, change_start=False, max_episode_seconds=seconds
        )

    def objects(self) -> BoxesConfig | BotsConfig | None:
        """Return what stands or drives in the way."""
        if self.type == OBJECT_AVOIDANCE:
            return BoxesConfig(number=self.boxes, random=not self.box_positions, positions=self.box_positions)
        if self.type == HEAD_TO_BOT:
            return BotsConfig(number=self.bots, speed=self.bot_speed, lane_change=self.bot_lane_change)
        return None

    @property
    def is_meeting(self) -> bool:
        """Whether cars meet each other."""
        return self.type == HEAD_TO_MODEL

    def describe(self) -> list[str]:
        """Return the rules, a line each."""
        drive = f"{self.laps} lap{'s' * (self.laps > 1)}" if self.race_seconds is None else f"{self.race_seconds:g} s"
        if not self.is_continuous and self.race_seconds is None:
            drive += ", each from the start line"
        lines = [f"{self.type.replace('_', ' ').lower()}, {drive}{', reverse direction' if self.reverse else ''}"]
        if self.type == OBJECT_AVOIDANCE:
            lines.append(f"{self.boxes} boxes" if not self.box_positions else f"boxes at {self.box_positions}")
        if self.type == HEAD_TO_BOT:
            lanes = ", they change lanes" if self.bot_lane_change else ""
            lines.append(f"{self.bots} bots at {self.bot_speed:g} m/s{lanes}")
        lines.append(
            f"off the road: {self.off_track_penalty:g} s; collision: {self.collision_penalty:g} s; "
            f"{self.max_resets} reset{'s' * (self.max_resets != 1)} at most"
        )
        lines.append(f"cars: {', '.join(self.generations)}; up to {self.max_speed:g} m/s; {self._actions_text()}")
        if set(self.sensors) != set(SENSORS):
            lines.append(f"sensors: {', '.join(self.sensors)}")
        return lines

    def check(self, facts: Mapping[str, Any]) -> None:
        """Refuse a car that the rules do not allow.

        Args:
            facts: What `entry.facts_of` found.

        Raises:
            UserInputError: Every reason, with what was found and what is expected.
        """
        faults = Faults()
        for refusal in self._refusals(facts):
            with faults.collect():
                raise refusal
        faults.raise_found()

    def _refusals(self, facts: Mapping[str, Any]) -> list[SettingError]:
        found = []
        if facts["car"] not in self.generations:
            found.append(_refusal("its car is {found}", facts["car"], ", ".join(self.generations)))
        for sensor in facts["sensors"]:
            if sensor not in self.sensors:
                found.append(_refusal("it has the sensor {found}", sensor, _sentence(self.sensors)))
        if facts["max_speed_mps"] > self.max_speed + 1e-9:
            found.append(
                _refusal("it commands {found:g} m/s", facts["max_speed_mps"], f"at most {self.max_speed:g} m/s")
            )
        count = facts["actions"]
        if count is None and not self.continuous:
            found.append(_refusal("its actions are {found}", "continuous", "a discrete action space"))
        if count is not None and not self.min_actions <= count <= (self.max_actions or count):
            found.append(_refusal("it has {found} actions", count, self._actions_text()))
        return found

    def _actions_text(self) -> str:
        if self.max_actions is None:
            low = f"{self.min_actions} actions or more" if self.min_actions > 1 else "any number of actions"
            return low
        return f"{self.min_actions} to {self.max_actions} actions"


def _refusal(found_text: str, found: Any, expected: str) -> SettingError:
    return SettingError("this race refuses the car: " + found_text + "; expected {expected}.", found=found,
                        expected=expected)  # fmt: skip


def _sentence(names: Sequence[str]) -> str:
    return f"one of {', '.join(names)}"
