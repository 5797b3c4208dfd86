"""The key `lidar_config` of `model_metadata.json`: how a car's LiDAR sums up its beams.

Source: facts: simapp `model_metadata.py`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from racecraft.contract.errors import nearest
from racecraft.contract.message import Message
from racecraft.formats.json_text import JsonDocument, as_number, kind_of
from racecraft.worlds.deepracer.files.sensor_names import LIDARS

CONFIGURABLE = "DISCRETIZED_SECTOR_LIDAR"
"""The only one that asks `lidar_config`."""
BEAMS = 64
CLIPPING_M = (0.15, 12.0)
"""Nearest and farthest distance at which a beam may be cut."""
DEFAULTS: Mapping[str, float] = {"num_sectors": 8, "num_values_per_sector": 8, "clipping_dist": 2.0}
"""What stands for a key that is left out."""
MAX_VALUES = 1000
"""More steps of distance than millimetres in a metre tell nothing."""


def read_lidar_config(document: JsonDocument) -> dict[str, float] | None:
    """Return num_sectors, num_values_per_sector and clipping_dist (m) as far as they are given; None without the key.

    Raises:
        MetadataError: A value is no number or out of range; the message names file, line and key.
    """
    written = document.value.get("lidar_config")
    if written is None:
        return None
    if not isinstance(written, dict):
        raise document.error_at("lidar_config", found=kind_of(written), expected="an object with num_sectors")
    config: dict[str, float] = {}
    for key, value in written.items():
        number = as_number(value)
        if number is None:
            raise document.error_at("lidar_config", key, found=repr(value), expected="a number")
        config[key] = number
    full = {**DEFAULTS, **config}
    if not CLIPPING_M[0] <= full["clipping_dist"] <= CLIPPING_M[1]:
        raise document.error_at(
            "lidar_config",
            "clipping_dist",
            found=Message("{config:g}", config=config["clipping_dist"]),
            expected="0.15 to 12 m",
        )
    sectors, values = full["num_sectors"], full["num_values_per_sector"]
    if not 1 <= sectors <= BEAMS or BEAMS % sectors:  # what divides them is a whole number
        divisors = ", ".join(str(part) for part in range(1, BEAMS + 1) if BEAMS % part == 0)
        expected = Message("a divisor of its {beams} beams: {divisors}", beams=BEAMS, divisors=divisors)
        raise document.error_at(
            "lidar_config", "num_sectors", found=Message("{sectors:g}", sectors=sectors), expected=expected
        )
    if not 1 <= values <= MAX_VALUES or values % 1:
        expected = Message("a whole number from 1 to {max_values}", max_values=MAX_VALUES)
        raise document.error_at(
            "lidar_config", "num_values_per_sector", found=Message("{values:g}", values=values), expected=expected
        )
    return config


def lidar_notes(sensors: Sequence[str], config: Mapping[str, float] | None) -> list[str]:
    """Return what is worth telling of a LiDAR and its config, a clause each."""
    if config is None:
        return [f"there is no lidar_config; {_described(DEFAULTS)} is taken"] if CONFIGURABLE in sensors else []
    if CONFIGURABLE not in sensors:
        lidar = next((name for name in sensors if name in LIDARS), None)
        why = f"{lidar} has its own figures" if lidar else "there is no LiDAR among the sensors"
        return [f"lidar_config is kept and does nothing: {why}"]
    unknown = [key for key in config if key not in DEFAULTS]
    absent = {key: value for key, value in DEFAULTS.items() if key not in config}
    notes = [
        f"unknown key '{key}' in lidar_config is kept and does nothing. {nearest(key, DEFAULTS)}" for key in unknown
    ]
    return [*notes, f"lidar_config leaves out {_described(absent)}, which is taken"] if absent else notes


def _described(config: Mapping[str, float]) -> str:
    return ", ".join(f"{key} {value:g}" for key, value in config.items())
