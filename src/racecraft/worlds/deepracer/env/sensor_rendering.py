"""What the cars of a world see with, and the room that kernels draw into. Begin with `SensorRenderer.sight`.

One eye is drawn where its observation lies. Two are drawn into a room of our own and then shown as one picture of two
channels, as AWS's stereo camera tells them.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from racecraft.contract.world import Array
from racecraft.worlds.deepracer.env.camera import Camera
from racecraft.worlds.deepracer.env.fidelity import AwsQuirks
from racecraft.worlds.deepracer.env.kernels import lidar as lidar_kernels
from racecraft.worlds.deepracer.env.kernels import observations
from racecraft.worlds.deepracer.env.kernels.eyes import join_eyes
from racecraft.worlds.deepracer.env.objects import Nearby, Objects
from racecraft.worlds.deepracer.env.race_spec import CRITIC_NAME
from racecraft.worlds.deepracer.env.randomisation import RandomisedCars, plain_optics
from racecraft.worlds.deepracer.env.scene import GREY_WEIGHTS
from racecraft.worlds.deepracer.env.sensors import (
    AWS_HERTZ,
    LIDAR_NOISE_M,
    STEREO,
    STEREO_GREY_WEIGHTS,
    MountedLidar,
    Sensors,
    mounted_lidar,
)
from racecraft.worlds.deepracer.env.vehicle import TICKS_PER_SECOND
from racecraft.worlds.deepracer.files.lidar_config import BEAMS

EYE_PAIR = np.dtype("<u2")
"""Two eyes' grey levels of one pixel, left before right in memory, as one number."""


class SensorRenderer:
    """What N x M cars see with.

    Args:
        camera: On every car, in the scene of their track.
        sensors: What a policy is told by.
        habits: Which of the original's bugs a LiDAR has.
        shape: (N, M).
    """

    def __init__(self, camera: Camera, sensors: Sensors, habits: AwsQuirks, shape: tuple[int, int]) -> None:
        self.camera, self.sensors = camera, sensors
        self._habits, self._shape = habits, shape
        self.lidar = self._mounted(sensors)
        """The LiDAR as it sits on every car; without one on board it is never asked."""
        self.ranges = np.zeros((*shape, BEAMS))
        """What each car's LiDAR read last, m, before it is told to the policy, float64 (N, M, 64)."""
        self._no_lidar = np.zeros((*shape, 0), np.float32)
        self._every_car = np.ones(shape, bool)
        self._frames, self._last_frames = (self._stereo_buffer() for _ in range(2))
        self._optics = plain_optics(camera, shape)
        self.palettes = np.tile(camera.scene.palette @ grey_weights(sensors), (*shape, 1))
        """The grey level of every material, and of every kind of object, to every car."""

    @property
    def sight(self) -> tuple[object, ...]:
        """What kernels take: the scene, every car's optics, its eyes, its LiDAR and the grey level of everything."""
        return self.camera.scene, self._optics, self.sensors.eyes_left_m, self.lidar, self.palettes

    def vary(self, varied: RandomisedCars) -> None:
        """See with what every car has drawn, instead of what is common to all."""
        self._optics, self.palettes = varied.optics, varied.palettes

    def views(self, observations: Mapping[str, Array]) -> tuple[Array, Array, Array]:
        """Return what kernels write: frames (N, M, E, H, W), the critic's numbers, what the LiDAR tells."""
        return self._views(observations, self._frames)

    def last_views(self, observations: Mapping[str, Array]) -> tuple[Array, Array, Array]:
        """Return the same of how episodes end."""
        return self._views(observations, self._last_frames)

    def show(self, observations: Mapping[str, Array]) -> None:
        """Bring every car's eyes, once they are drawn, to where the policy looks."""
        self._join_eyes(self._frames, self._every_car, observations)

    def show_last(self, cars: Array, observations: Mapping[str, Array]) -> None:
        """Bring there how the episodes of `cars` (bool (N, M)) end."""
        self._join_eyes(self._last_frames, cars, observations)

    def look_with(self, camera: Camera, sensors: Sensors, around: Nearby, cars: Array, rows: Array) -> dict[str, Array]:
        """Return what cars see who carry another camera: (R, H, W), of two eyes (R, H, W, 2), uint8.

        Args:
            camera: Made with a scene of the same track.
            sensors: Which camera that is; of a LiDAR, see `look_around_with`.
            around: What stands around each car.
            cars: CAR_STATE (N, M).
            rows: Which of them, (R, 2): world and number in it.
        """
        frames = np.empty((len(rows), len(sensors.eyes_left_m), camera.height, camera.width), np.uint8)
        palette = camera.scene.palette @ grey_weights(sensors)
        observations.look_with(camera.scene, camera.optics, sensors.eyes_left_m, palette, around, cars, rows, frames)
        if sensors.camera != STEREO:
            return {sensors.camera_name: frames[:, 0]}
        both = np.empty((len(rows), 1, camera.height, camera.width, 2), np.uint8)
        join_eyes(frames[:, None], np.ones((len(rows), 1), bool), both.view(EYE_PAIR)[..., 0])
        return {STEREO: both[:, 0]}

    def look_around_with(
        self, sensors: Sensors, objects: Objects, cars: Array, rows: Array, keys: Array, ranges: Array
    ) -> dict[str, Array]:
        """Return what cars are told who carry another LiDAR, (R, L) float32; nothing without one.

        Args:
            sensors: Which LiDAR that is.
            objects: What stands on the road.
            cars: CAR_STATE (N, M).
            rows: Which of them, (R, 2): world and number in it.
            keys: Each car's stream of chance, uint64 (N, M).
            ranges: Their newest readings, float64 (R, 64), m: the caller's, for they stand until the next is due.
        """
        if sensors.lidar is None:
            return {}
        distances = np.zeros((len(rows), *sensors.lidar.spec.shape), np.float32)
        lidar_kernels.look_around_with(
            self._mounted(sensors), self.camera.scene, objects, cars, rows, keys, ranges, distances
        )
        return {sensors.lidar.name: distances}

    def _views(self, observations: Mapping[str, Array], own: Array) -> tuple[Array, Array, Array]:
        lidar = self.sensors.lidar
        frames = own if self.sensors.camera == STEREO else observations[self.sensors.camera_name][:, :, None]
        return frames, observations[CRITIC_NAME], self._no_lidar if lidar is None else observations[lidar.name]

    def _stereo_buffer(self) -> Array:
        """Return room for the frames of two eyes, (N, M, 2, H, W); one eye needs none."""
        count = 2 if self.sensors.camera == STEREO else 0
        return np.zeros((*self._shape, count, self.camera.height, self.camera.width), np.uint8)

    def _join_eyes(self, own: Array, cars: Array, observations: Mapping[str, Array]) -> None:
        if self.sensors.camera == STEREO:
            join_eyes(own, cars, observations[STEREO].view(EYE_PAIR)[..., 0])

    def _mounted(self, sensors: Sensors) -> MountedLidar:
        return mounted_lidar(
            sensors.lidar,
            backward=self._habits.lidar_faces_backward,
            hertz=AWS_HERTZ if self._habits.lidar_is_slow else round(TICKS_PER_SECOND),
            noise=LIDAR_NOISE_M if self._habits.lidar_is_noisy else 0.0,
        )


def grey_weights(sensors: Sensors) -> Array:
    """Return the weights (3,) of red, green and blue in the grey level that this camera tells."""
    return STEREO_GREY_WEIGHTS if sensors.camera == STEREO else GREY_WEIGHTS
