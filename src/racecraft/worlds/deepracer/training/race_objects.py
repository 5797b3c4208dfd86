"""What run.env says of boxes and bots, as settings. Begin with `objects_overrides`.

The variables of a race that is not run are kept and named like any other that changes nothing here.
"""

from __future__ import annotations

from racecraft.contract.errors import SettingError
from racecraft.contract.message import Message
from racecraft.worlds.deepracer.env.objects import BOX_TYPES, read_positions
from racecraft.worlds.deepracer.env.settings import HEAD_TO_BOT, OBJECT_AVOIDANCE, TIME_TRIAL
from racecraft.worlds.deepracer.files.run_env import RunEnv

PREFIXES = {"DR_OA_": OBJECT_AVOIDANCE, "DR_H2B_": HEAD_TO_BOT}
"""Which race the variables of a family belong to; others belong to every race."""

MOST = 100
"""Objects on a lap, at most."""
LONGEST_M, LONGEST_S, FASTEST_MPS = 1000.0, 1000.0, 6.0

FLAGS = {
    "DR_OA_RANDOMIZE_OBSTACLE_LOCATIONS": "boxes.random",
    "DR_OA_IS_OBSTACLE_BOT_CAR": "boxes.as_cars",
    "DR_H2B_IS_LANE_CHANGE": "bots.lane_change",
    "DR_H2B_RANDOMIZE_BOT_CAR_LOCATIONS": "bots.random",
}
COUNTS = {"DR_OA_NUMBER_OF_OBSTACLES": "boxes.number", "DR_H2B_NUMBER_OF_BOT_CARS": "bots.number"}
AMOUNTS = {
    "DR_OA_MIN_DISTANCE_BETWEEN_OBSTACLES": ("boxes.min_distance", 0.0, LONGEST_M),
    "DR_H2B_MIN_DISTANCE_BETWEEN_BOT_CARS": ("bots.min_distance", 0.0, LONGEST_M),
    "DR_H2B_BOT_CAR_SPEED": ("bots.speed", 0.0, FASTEST_MPS),
    "DR_H2B_LOWER_LANE_CHANGE_TIME": ("bots.lane_change_after_low", 0.0, LONGEST_S),
    "DR_H2B_UPPER_LANE_CHANGE_TIME": ("bots.lane_change_after_high", 0.0, LONGEST_S),
    "DR_H2B_LANE_CHANGE_DISTANCE": ("bots.lane_change_distance", 0.1, LONGEST_M),
    "DR_H2B_BOT_CAR_PENALTY": ("bots.penalty", 0.0, LONGEST_S),
}
"""Which setting each variable is, and within which limits."""


def belongs_to(name: str, race: str) -> bool:
    """Tell whether a variable says something in a type of race."""
    return next((PREFIXES[prefix] == race for prefix in PREFIXES if name.startswith(prefix)), True)


def objects_overrides(env: RunEnv, race: str) -> tuple[str, ...]:
    """Return the settings that the variables of a race stand for.

    Raises:
        RunEnvError: A value cannot be used; the message names file and line.
    """
    if race == TIME_TRIAL:
        return ()
    names = [name for name in env.values if belongs_to(name, race)]
    found = [f"race.type={race}"]
    found += [f"{FLAGS[name]}={str(env.flag(name)).lower()}" for name in names if name in FLAGS]
    found += [f"{COUNTS[name]}={_count(env, name)}" for name in names if name in COUNTS]
    for name in names:
        if name in AMOUNTS:
            setting, low, high = AMOUNTS[name]
            found.append(f"{setting}={env.number(name, low, low, high):g}")
    if "DR_OA_OBSTACLE_TYPE" in names:
        found.append(f"boxes.type={env.choice('DR_OA_OBSTACLE_TYPE', BOX_TYPES[0], BOX_TYPES)}")
    if "DR_OA_OBJECT_POSITIONS" in names:
        found.append(f"boxes.positions={_positions(env, 'DR_OA_OBJECT_POSITIONS')}")
    return tuple(found)


def _count(env: RunEnv, name: str) -> int:
    number = env.number(name, 0.0, 0.0, MOST)
    if number != int(number):
        raise env.error_at(name, Message("a whole number from 0 to {most}", most=MOST))
    return int(number)


def _positions(env: RunEnv, name: str) -> str:
    try:
        read_positions(env.values[name])
    except SettingError as error:
        raise env.error_at(name, 'places such as "0.23,-1;0.46,1"', str(error)) from error
    return env.values[name]
