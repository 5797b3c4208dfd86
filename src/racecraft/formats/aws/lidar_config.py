"""The key `lidar_config` of `model_metadata.json`: how a car's LiDAR sums up its beams.

Source: facts: simapp `model_metadata.py`.
"""

from __future__ import annotations

from racecraft.formats.json_text import JsonDocument, as_number, kind_of

LIDARS = ("LIDAR", "SECTOR_LIDAR", "DISCRETIZED_SECTOR_LIDAR")
"""Names of LiDARs among the sensors."""
BEAMS = 64
CLIPPING_M = (0.15, 12.0)
"""Nearest and farthest distance at which a beam may be cut."""


def read_lidar_config(document: JsonDocument) -> dict[str, float] | None:
    """Return num_sectors, num_values_per_sector and clipping_dist (m) as far as they are given; None without the key.

    Raises:
        MetadataError: A value is no number or out of range; the letter names file, line and key.
    """
    written = document.value.get("lidar_config")
    if written is None:
        return None
    if not isinstance(written, dict):
        raise document.letter("lidar_config", found=kind_of(written), expected="an object with num_sectors")
    config: dict[str, float] = {}
    for key, value in written.items():
        number = as_number(value)
        if number is None:
            raise document.letter("lidar_config", key, found=repr(value), expected="a number")
        config[key] = number
    if not CLIPPING_M[0] <= config.get("clipping_dist", 2.0) <= CLIPPING_M[1]:
        raise document.letter(
            "lidar_config", "clipping_dist", found=f"{config['clipping_dist']:g}", expected="0.15 to 12 m"
        )
    sectors = config.get("num_sectors", 8)
    if sectors < 1 or sectors % 1 or BEAMS % sectors:
        raise document.letter("lidar_config", "num_sectors", found=f"{sectors:g}", expected="a divisor of 64")
    if config.get("num_values_per_sector", 1) < 1:
        raise document.letter("lidar_config", "num_values_per_sector", found="less than 1", expected="1 or more")
    return config
