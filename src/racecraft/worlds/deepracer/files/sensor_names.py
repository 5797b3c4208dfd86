"""The sensors that a `model_metadata.json` may name, one row each. Begin with `SENSORS`.

A new sensor is a row here, its observation in `env/sensors.py` and its picture or numbers in `env/kernels/`; readers of
files, forms, reports and exports take names and words from the row.

Source: facts: simapp `model_metadata.py`.
"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class SensorName:
    """One sensor as files and people name it."""

    name: str
    """In files and among observations."""
    kind: str
    """"camera" or "lidar"."""
    text: str
    """In a sentence of a report: "it sees …"."""
    label: str = ""
    """In the console's form; "": the form does not offer it."""
    is_on_cars: bool = True
    """Whether the software of a physical car knows it (source: model_optimizer_pkg `constants.py` of the community's
    custom car, as in AWS's own)."""


SENSORS = (
    SensorName("FRONT_FACING_CAMERA", "camera", "its front camera", "One camera"),
    SensorName("LEFT_CAMERA", "camera", "its left camera"),
    SensorName("STEREO_CAMERAS", "camera", "two cameras", "Two cameras"),
    SensorName("observation", "camera", "its front camera"),
    SensorName("LIDAR", "lidar", "a LiDAR", "LiDAR"),
    SensorName("SECTOR_LIDAR", "lidar", "a LiDAR in sectors", "LiDAR in sectors"),
    SensorName("DISCRETIZED_SECTOR_LIDAR", "lidar", "a LiDAR in sectors", is_on_cars=False),
)
CAMERAS = tuple(one.name for one in SENSORS if one.kind == "camera")
LIDARS = tuple(one.name for one in SENSORS if one.kind == "lidar")
