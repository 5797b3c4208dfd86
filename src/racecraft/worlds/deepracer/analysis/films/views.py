"""The views a drive is filmed in, one table: `VIEWS`. Each paints one picture of one moment.

    car     the car's own camera, in colour
    chase   from behind and above, as the original's main camera: 1.5 m behind, 1.0 m up, 0.314 rad down
    top     the whole circuit from above, as the original's second camera: a quarter of room around it
    pip     chase, with top in its corner

(facts: deepracer.md 2.5.) Other cars, boxes and bots on the track are seen in all of them.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np

from racecraft.contract.world import Array
from racecraft.worlds.deepracer.analysis.films.figures import strip_height
from racecraft.worlds.deepracer.analysis.films.moments import Moments
from racecraft.worlds.deepracer.analysis.films.shells import Shell
from racecraft.worlds.deepracer.analysis.films.solids import CameraPose, paint_car
from racecraft.worlds.deepracer.analysis.films.standing import FilmedObjects, back_to_front
from racecraft.worlds.deepracer.analysis.films.top import TopMap
from racecraft.worlds.deepracer.env.camera import Camera, CameraMount
from racecraft.worlds.deepracer.env.kernels.boxes import paint_boxes
from racecraft.worlds.deepracer.env.scene import build_scene
from racecraft.worlds.deepracer.tracks.track import Track

CAMERA_SHAPE = 4 / 3
CHASE = CameraMount(x=-1.5, z=1.0, pitch=0.314)
INSET, INSET_EDGE = 0.3, 0.02
"""Width of the small picture, and its distance from the corner: shares of the large one's width."""


@dataclass(frozen=True, eq=False)
class FilmedCar:
    """A car on the track while it is filmed."""

    moments: Moments
    shell: Shell


@dataclass(frozen=True)
class FilmContext:
    """What all views of a film share."""

    track: Track
    light: str
    mount: CameraMount
    """Of the filmed car's own camera."""
    cars: Sequence[FilmedCar]
    """The first is filmed."""
    objects: FilmedObjects
    """In the pictures of the filmed car."""


class View(Protocol):
    """Paints moments of a film."""

    def paint(self, moment: int, picture: Array) -> None:
        """Paint a moment into a picture (H, W, 3) uint8."""
        ...


class MountedView:
    """A camera on a mount of the filmed car, with every car and object that it sees painted in.

    Args:
        stage: What is filmed.
        width, height: Pixels.
        mount: Where the camera sits.
        is_chase: It follows the car from outside, so that the car itself is seen.
    """

    def __init__(self, stage: FilmContext, width: int, height: int, mount: CameraMount, is_chase: bool) -> None:
        self._stage, self._mount, self._is_chase = stage, widened(mount, width / height), is_chase
        scene = build_scene(stage.track, stage.light, for_people=True)
        self._camera = Camera(scene, width, height, self._mount)

    def paint(self, moment: int, picture: Array) -> None:
        """Paint the ground, then what stands on it, far things first."""
        filmed = self._stage.cars[0].moments
        x, y, yaw = filmed.poses[moment]
        heading = float(filmed.chase_yaw[moment]) if self._is_chase else float(yaw)
        self._camera.render_rgb(np.array([[x, y, heading]]), picture[None])
        eye = CameraPose(
            float(x + self._mount.x * np.cos(heading)),
            float(y + self._mount.x * np.sin(heading)),
            self._mount.z,
            heading,
            self._mount.pitch,
            self._camera.optics.focal,
        )
        seen = self._stage.cars if self._is_chase else self._stage.cars[1:]
        poses = np.array([_pose(car, moment) for car in seen]).reshape(-1, 3)
        boxes, kinds = self._stage.objects.boxes[moment], self._stage.objects.kinds[moment]
        for k in back_to_front(boxes, poses, eye.x, eye.y):
            if k < len(boxes):
                one = slice(k, k + 1)
                paint_boxes(
                    self._camera.optics, boxes[None, one], kinds[None, one], np.array([[x, y, heading]]),
                    self._camera.scene.palette[None], picture[None],
                )  # fmt: skip
            else:
                paint_car(picture, eye, seen[k - len(boxes)].shell, tuple(poses[k - len(boxes)].tolist()))


class TopView:
    """The whole circuit from above."""

    def __init__(self, stage: FilmContext, width: int, height: int, foot: int = 0) -> None:
        self._stage = stage
        self._map = TopMap(stage.track, stage.light, width, height, foot)

    def paint(self, moment: int, picture: Array) -> None:
        """Paint the circuit, what stands on it, and every car, the filmed one last."""
        picture[:] = self._map.picture
        self._map.paint_boxes(picture, self._stage.objects.boxes[moment], self._stage.objects.kinds[moment])
        for car in reversed(self._stage.cars):
            self._map.paint_car(picture, car.shell, tuple(_pose(car, moment).tolist()))


def _pose(car: FilmedCar, moment: int) -> Array:
    """Return x, y and yaw of a car at a moment of the film; one whose drive is over stays where it is."""
    pose: Array = car.moments.poses[min(moment, len(car.moments) - 1)]
    return pose


class PictureInPicture:
    """One view, with another one small in its upper right corner."""

    def __init__(self, large: View, small: View, width: int, small_size: tuple[int, int]) -> None:
        self._large, self._small = large, small
        self._inset = np.empty((small_size[1], small_size[0], 3), np.uint8)
        self._edge = round(INSET_EDGE * width)

    def paint(self, moment: int, picture: Array) -> None:
        """Paint both."""
        self._large.paint(moment, picture)
        self._small.paint(moment, self._inset)
        high, wide = self._inset.shape[:2]
        top, right = self._edge, picture.shape[1] - self._edge
        picture[top - 2 : top + high + 2, right - wide - 2 : right + 2] = 244
        picture[top : top + high, right - wide : right] = self._inset


def widened(mount: CameraMount, shape: float) -> CameraMount:
    """Return the mount of a picture that is wider than the camera's 4 : 3: it shows more at the sides, no less above.

    >>> round(widened(CHASE, 4 / 3).horizontal_view, 6), round(widened(CHASE, 16 / 9).horizontal_view, 2)
    (1.13, 1.4)
    """
    half = math.tan(mount.horizontal_view / 2) * shape / CAMERA_SHAPE
    return replace(mount, horizontal_view=2.0 * math.atan(half))


def car_view(stage: FilmContext, width: int, height: int) -> View:
    """Return the car's own camera."""
    return MountedView(stage, width, height, stage.mount, is_chase=False)


def chase_view(stage: FilmContext, width: int, height: int) -> View:
    """Return the camera behind the car."""
    return MountedView(stage, width, height, CHASE, is_chase=True)


def top_view(stage: FilmContext, width: int, height: int) -> View:
    """Return the circuit from above, clear of the figures at the picture's foot."""
    return TopView(stage, width, height, strip_height(width, height))


def pip_view(stage: FilmContext, width: int, height: int) -> View:
    """Return the camera behind the car, with the circuit from above in its corner."""
    small = round(INSET * width), round(INSET * width * 0.75)
    return PictureInPicture(chase_view(stage, width, height), TopView(stage, *small), width, small)


VIEWS = {"car": car_view, "chase": chase_view, "top": top_view, "pip": pip_view}
"""Every view by the name users type."""
AWS_FOLDERS = {"pip": "camera-pip", "chase": "camera-45degree", "top": "camera-topview"}
"""Folders under mp4/ in which the original keeps its films (facts: deepracer.md 9.5)."""
