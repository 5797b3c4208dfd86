"""What a car carries to see with: a camera of one eye or two, and perhaps a LiDAR. Begin with `car_sensors`.

Seven names go into a metadata file, four cameras and three LiDARs. One camera is always on board, a LiDAR need not be.

    FRONT_FACING_CAMERA, LEFT_CAMERA, observation    one eye in the middle of the car, a grey frame (H, W)
    STEREO_CAMERAS                                   two eyes 6 cm apart, grey frames (H, W, 2), left before right
    LIDAR                                            64 distances, m
    SECTOR_LIDAR                                     8 sectors, each 1 where something is nearer than 0.5 m
    DISCRETIZED_SECTOR_LIDAR                         sectors by steps of distance, one 1 a sector; all 0: nothing near

LEFT_CAMERA is no left eye: the original gives only stereo cars a second camera, and reads it from the front camera's
place (simapp `sensors_rollout.py`, `racetrack_with_racecar.launch.py`).

Facts: deepracer.md 2.1 to 2.4. The beams themselves are cast in `kernels/lidar.py`.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from racecraft.contract.errors import SettingError, nearest
from racecraft.contract.world import Array, ArraySpec
from racecraft.worlds.deepracer.env.vehicle import TICKS_PER_SECOND
from racecraft.worlds.deepracer.files.lidar_config import BEAMS, DEFAULTS
from racecraft.worlds.deepracer.files.sensor_names import CAMERAS, LIDARS

FRONT, LEFT, STEREO, OBSERVATION = "FRONT_FACING_CAMERA", "LEFT_CAMERA", "STEREO_CAMERAS", "observation"
LIDAR, SECTOR_LIDAR, DISCRETIZED = "LIDAR", "SECTOR_LIDAR", "DISCRETIZED_SECTOR_LIDAR"

STEREO_BASELINE_M = 0.06
"""Between the left and the right eye."""
EYES_LEFT_M: Mapping[str, tuple[float, ...]] = {STEREO: (STEREO_BASELINE_M / 2, -STEREO_BASELINE_M / 2)}
"""How far left of the car's middle each eye of a camera sits; of one that is not here, one eye in the middle."""
STEREO_GREY_WEIGHTS = np.array([0.299, 0.587, 0.114])
"""Of red, green and blue in a stereo eye's grey: the original turns these frames grey by another road (PIL's "L")."""

FIRST_BEAM_RAD, LAST_BEAM_RAD = -2.61799, 2.61799
"""Where the first and the last of 64 beams point, from the LiDAR's own nose, left positive."""
BEAM_STEP_RAD = (LAST_BEAM_RAD - FIRST_BEAM_RAD) / (BEAMS - 1)
NEAREST_M, FARTHEST_M = 0.15, 12.0
"""Between these a LiDAR measures; what is nearer reads as the nearest."""
LIDAR_NOISE_M = 0.01
"""Standard deviation of a reading in the original."""
LIDAR_X_M, LIDAR_Z_M = 0.02913, 0.1847
"""Where it sits: ahead of base_link and above the ground."""
AWS_HERTZ = 10
"""Readings a second in the original; ours keep up with the camera."""

LIDAR_CLIP_M, SECTOR_CLIP_M = 1.0, 0.5
"""What the policy is told of a LIDAR and of a SECTOR_LIDAR ends here."""
SECTORS = 8
"""Of a SECTOR_LIDAR."""


@dataclass(frozen=True)
class LidarView:
    """How a LiDAR's readings are told to the policy."""

    name: str
    """One of `LIDARS`: what the observation is called."""
    clip_m: float
    """Farther is as far as this."""
    sectors: int = 0
    """Equal parts that the beams are summed up in; 0: every beam is told by itself."""
    values: int = 1
    """Steps of distance in a sector, each `clip_m / values` long."""

    @property
    def spec(self) -> ArraySpec:
        """The observation."""
        if not self.sectors:
            doc = f"Distance along each of {BEAMS} beams, m, from the right to the left of the LiDAR's nose."
            return ArraySpec((BEAMS,), np.float32, NEAREST_M, self.clip_m, doc=doc)
        step = self.clip_m / self.values
        doc = f"{self.sectors} sectors from right to left, in each a 1 at the {step:g} m step of what is nearest."
        return ArraySpec((self.sectors * self.values,), np.float32, 0.0, 1.0, doc=doc)


@dataclass(frozen=True)
class Sensors:
    """What a car sees with."""

    camera: str = FRONT
    """One of `CAMERAS`."""
    lidar: LidarView | None = None

    @property
    def camera_name(self) -> str:
        """What the camera's observation is called: what one eye sees is FRONT_FACING_CAMERA, by whatever name it came.

        Beside a LiDAR `observation` keeps its own name, since AWS lays inputs end to end in the order of their sorted
        names, and that one comes last.
        """
        is_front = self.camera == LEFT or (self.camera == OBSERVATION and self.lidar is None)
        return FRONT if is_front else self.camera

    @property
    def eyes_left_m(self) -> Array:
        """How far left of the car's middle each eye sits, m, float64 (E,)."""
        return np.array(EYES_LEFT_M.get(self.camera, (0.0,)))

    def specs(self, width: int, height: int) -> dict[str, ArraySpec]:
        """Return the observations by name, for frames of so many pixels."""
        if self.camera == STEREO:
            doc = "Left and right eye, grey."
            seen = {STEREO: ArraySpec((height, width, 2), np.uint8, 0, 255, doc=doc)}
        else:
            seen = {self.camera_name: ArraySpec((height, width), np.uint8, 0, 255, doc="Front camera, grey.")}
        return seen if self.lidar is None else {**seen, self.lidar.name: self.lidar.spec}


LIDAR_VIEWS = {
    one.name: one for one in (LidarView(LIDAR, LIDAR_CLIP_M), LidarView(SECTOR_LIDAR, SECTOR_CLIP_M, SECTORS))
}
"""LiDARs whose figures no file says."""
FRONT_CAMERA = Sensors()
"""The car of somebody who asks for nothing else."""


def car_sensors(names: Sequence[str], lidar_config: Mapping[str, float] | None = None) -> Sensors:
    """Return a car's sensors by the names in its metadata.

    Args:
        names: One of `CAMERAS`, and at most one of `LIDARS`, in any order.
        lidar_config: `num_sectors`, `num_values_per_sector` and `clipping_dist` (m) of a DISCRETIZED_SECTOR_LIDAR; what
            is left out is as in `lidar_config.DEFAULTS`.

    Raises:
        SettingError: A name is unknown, there is not exactly one camera, or more than one LiDAR.

    >>> car_sensors(["LIDAR", "STEREO_CAMERAS"]).camera
    'STEREO_CAMERAS'
    """
    for name in names:
        if name not in CAMERAS + LIDARS:
            raise SettingError("There is no sensor '{name}'. {hint}", name=name, hint=nearest(name, CAMERAS + LIDARS))
    cameras = [name for name in names if name in CAMERAS]
    lidars = [name for name in names if name in LIDARS]
    if len(cameras) != 1 or len(lidars) > 1:
        raise SettingError("sensors {names}; expected exactly one camera and at most one LiDAR.", names=list(names))
    return Sensors(cameras[0], lidar_view(lidars[0], lidar_config) if lidars else None)


def lidar_view(name: str, lidar_config: Mapping[str, float] | None = None) -> LidarView:
    """Return how a LiDAR of that name tells its readings."""
    if name in LIDAR_VIEWS:
        return LIDAR_VIEWS[name]
    config = {**DEFAULTS, **(lidar_config or {})}
    return LidarView(name, config["clipping_dist"], int(config["num_sectors"]), int(config["num_values_per_sector"]))


class MountedLidar(NamedTuple):
    """A LiDAR as kernels take it: plain numbers, m and rad."""

    x: float
    """Ahead of base_link."""
    z: float
    """Above the ground; what is lower is not hit."""
    yaw: float
    """Of its nose from the car's nose."""
    hertz: int
    """Readings a second, at most one a tick."""
    noise: float
    """Standard deviation of a reading."""
    reach: float
    """What is farther does not matter to whoever reads."""
    clip: float
    sectors: int
    values: int


def mounted_lidar(
    view: LidarView | None, *, backward: bool = False, hertz: int = round(TICKS_PER_SECOND), noise: float = 0.0
) -> MountedLidar:
    """Return the numbers that a kernel needs of a LiDAR; None: of one that is never asked.

    Args:
        view: How it is told.
        backward: Whether its nose points to the car's tail, so that the blind 60 degrees lie ahead of the car.
        hertz: Readings a second; between them the last one stands.
        noise: Standard deviation of a reading, m.
    """
    config = view or lidar_view(LIDAR)
    yaw = math.pi if backward else 0.0
    reach = min(config.clip_m + 8.0 * noise, FARTHEST_M)
    return MountedLidar(LIDAR_X_M, LIDAR_Z_M, yaw, hertz, noise, reach, config.clip_m, config.sectors, config.values)
