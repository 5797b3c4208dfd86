"""Action tables by a short text: "7x1.5,2.5" is seven angles from -30° to 30°, each at 1.5 and at 2.5 m/s.

Coarse tables cost almost no lap time, since a car that chooses 15 times a second mixes its angles; a slow top speed
does, and so does a slowest speed that is too fast for the tightest turn. Begin with `default_table`.
"""

from __future__ import annotations

import math
import re
from pathlib import Path

import numpy as np

from racecraft.contract.errors import SettingError
from racecraft.worlds.deepracer.env.actions import ActionSpace, ActionTable, action_space
from racecraft.worlds.deepracer.env.vehicle import (
    MAX_LOGGED_SPEED_MPS,
    MAX_SPEED_MPS,
    MAX_STEERING_RAD,
    MIN_SPEED_MPS,
)
from racecraft.worlds.deepracer.files.model_metadata import (
    RACING_SPEEDS_MPS,
    TODAYS_SPEEDS_MPS,
    default_model_metadata,
    read_model_metadata,
)

ANGLES = 7
_TEXT = re.compile(r"(\d+)x([\d.]+(?:,[\d.]+)*)")


def default_top_speed(car: str) -> float:
    """Return the fastest command that is asked of a car where nothing is said: what its logs reach, m/s."""
    return MAX_LOGGED_SPEED_MPS.get(car, MAX_SPEED_MPS)


def default_table(car: str, top_speed: float) -> str:
    """Return the text of a table with which a car laps about as fast as with any up to a top speed, m/s.

    >>> default_table("v5-classic", 4.0), default_table("v6", 2.5)
    ('7x1,2.2,4', '7x1.5,2.5')
    """
    speeds = RACING_SPEEDS_MPS.get(car, TODAYS_SPEEDS_MPS)
    return f"{ANGLES}x" + ",".join(f"{speed / speeds[-1] * top_speed:.3g}" for speed in speeds)


def read_table(text: str) -> ActionSpace:
    """Return the action space of "7x1.5,2.5", of "default" (the console's ten), or of a model_metadata.json.

    Raises:
        SettingError: The text is none of them, or a number is out of range.
        MetadataError: The file cannot be used.
    """
    if text == "default":
        return action_space(default_model_metadata().actions)
    if found := _TEXT.fullmatch(text.replace(" ", "")):
        return _grid(text, int(found[1]), [float(speed) for speed in found[2].split(",")])
    if Path(text).suffix == ".json":
        return action_space(read_model_metadata(text).action_space)
    raise SettingError(
        "table {text!r} is not known; expected 'default', angles x speeds such as 7x1.5,2.5, or a model_metadata.json.",
        text=text,
    )


def _grid(text: str, angles: int, speeds: list[float]) -> ActionTable:
    if not 2 <= angles <= 61 or not all(MIN_SPEED_MPS <= speed <= MAX_SPEED_MPS for speed in speeds):
        raise SettingError(
            "table {text!r}; expected 2 to 61 angles and speeds from {min_speed_mps:g} to {max_speed_mps:g} m/s.",
            text=text,
            min_speed_mps=MIN_SPEED_MPS,
            max_speed_mps=MAX_SPEED_MPS,
        )
    degrees = np.linspace(-math.degrees(MAX_STEERING_RAD), math.degrees(MAX_STEERING_RAD), angles)
    return ActionTable.of([(math.radians(angle), speed) for angle in degrees for speed in sorted(speeds)])
