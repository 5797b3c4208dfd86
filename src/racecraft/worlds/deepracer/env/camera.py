"""The car's camera: a pinhole on a mount, at any size by the same optics. Begin with `Camera`.

The original's camera has 640 x 480 pixels and 1.13 rad of horizontal view, its frames are scaled to 160 x 120 for the
policy (facts: simapp `racecar.gazebo`, `sensors_rollout.py`). Ours renders the size asked for, every pixel the mean
over its area. The picture itself is made in `kernels/camera.py`, of what `scene.py` lays out.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from racecraft.contract.errors import RacecraftError
from racecraft.worlds.deepracer.env.kernels import camera as kernels
from racecraft.worlds.deepracer.env.kernels.boxes import paint_boxes
from racecraft.worlds.deepracer.env.scene import MATERIALS, Scene

HORIZONTAL_VIEW_RAD = 1.13
"""Angle between the left and the right edge of the frame (facts: simapp `racecar.gazebo`)."""


@dataclass(frozen=True, slots=True)
class CameraMount:
    """Where a camera sits on the car and how it looks."""

    x: float
    """m ahead of base_link."""
    z: float
    """m above the ground."""
    pitch: float
    """rad, positive looks down."""
    horizontal_view: float = HORIZONTAL_VIEW_RAD
    """rad between the left and right edges of the frame."""
    roll: float = 0.0
    """rad, positive leans to the right, as the picture then turns to the left."""


MOUNT_V3 = CameraMount(x=0.14529379, z=0.13032555, pitch=math.radians(13.6))
"""Cars of version 3 and later: 15 degrees less the car's nose-up stance (simapp `frustum.py`). Frames of 2021 want
z 0.1309, 13.59 degrees and 1.132 rad of view, frames of 2026 0.1310, 13.60 and 1.133: a quarter of a pixel away."""
MOUNT_V2 = CameraMount(x=0.2, z=0.164, pitch=math.radians(15.0))
"""Cars of version 2 (simapp `frustum.py`). Three pairs of its frames, two eyes each, want z 0.1634 and 14.98 degrees:
how far apart the eyes, 60 mm from each other, see the same edge tells height and pitch without knowing the pose."""
MOUNT_V1 = CameraMount(x=0.2, z=0.1235, pitch=math.radians(15.1), horizontal_view=1.135)
"""Cars of version 1, whose metadata names no sensor: fitted to 92 frames of 2019. Line edges lie 0.35
pixels from those of 23 of them."""


def mount_for_version(version: str | None) -> CameraMount:
    """Return where the camera sits on cars of a metadata version: 1 and 2 each carry a mount of their own."""
    if version is None or float(version) >= 3:
        return MOUNT_V3
    return MOUNT_V2 if float(version) >= 2 else MOUNT_V1


class Optics(NamedTuple):
    """A mounted camera as kernels take it: plain numbers, lengths in m, image measures in pixels."""

    focal: float
    middle_x: float
    middle_y: float
    cos_pitch: float
    sin_pitch: float
    mount_x: float
    mount_z: float
    side: float
    """Half width over focal length; more where a camera that leans sees ground further aside."""
    side_norm: float
    """Norm of the side plane's normal on the ground, for circles."""
    ground_near: float
    """Depth nearer than any ground in the frame, m."""
    cos_roll: float = 1.0
    sin_roll: float = 0.0
    grain: float = 0.0
    """Spread of the field's grain, grey levels; 0 where the field is plain."""


OPTICS = np.dtype([(name, "f8") for name in Optics._fields])
"""One car's `Optics` as a record, so that every car may have its own."""


class CameraError(RacecraftError):
    """A camera was asked for what it cannot do."""


class Camera:
    """Renders what cars see of one scene.

    Args:
        scene: From `build_scene`.
        width, height: Pixels; 4 : 3 has the original's view, another shape keeps the horizontal view.
        mount: Where the camera sits.
    """

    def __init__(self, scene: Scene, width: int = 160, height: int = 120, mount: CameraMount = MOUNT_V3):
        if width < 1 or height < 1:
            raise CameraError(
                "A camera of {width} x {height} pixels sees nothing. "
                "Give a width and height of at least 1, such as 160 and 120.",
                width=width,
                height=height,
            )
        self.scene, self.width, self.height, self.mount = scene, width, height, mount
        self.optics = mounted_optics(width, height, mount)._replace(grain=scene.grass)

    def render_grey(
        self,
        poses: np.ndarray,
        out: np.ndarray | None = None,
        palettes: np.ndarray | None = None,
        boxes: tuple[np.ndarray, np.ndarray] | None = None,
    ):
        """Render what the policy sees.

        Args:
            poses: (R, 3) float64: x, y in m and yaw in rad of base_link.
            out: (R, H, W) uint8, written; None: a new array.
            palettes: (M,) or (R, M) grey levels 0 to 255 of the materials; None: the scene's daylight.
            boxes: What stands on the road, as for `render_rgb`.

        Returns:
            `out`.
        """
        poses = _checked_poses(poses)
        out = self._checked_out(out, (len(poses), self.height, self.width))
        levels = _checked_palettes(self.scene.grey_palette if palettes is None else palettes, len(poses), 1)
        kernels.render_grey_frames(self.scene, self.optics, poses, levels, out)
        if boxes is not None:
            paint_boxes(self.optics, *boxes, poses, levels[..., None], out[..., None])
        return out

    def render_rgb(
        self,
        poses: np.ndarray,
        out: np.ndarray | None = None,
        palettes: np.ndarray | None = None,
        boxes: tuple[np.ndarray, np.ndarray] | None = None,
    ):
        """Render for people: as `render_grey`, with `out` (R, H, W, 3) and `palettes` (M, 3) or (R, M, 3).

        `boxes` are what stands on the road, (R, K, 6) and their kinds (R, K), as `objects.Objects` has them.
        """
        poses = _checked_poses(poses)
        out = self._checked_out(out, (len(poses), self.height, self.width, 3))
        levels = _checked_palettes(self.scene.palette if palettes is None else palettes, len(poses), 2)
        kernels.render_frames(self.scene, self.optics, poses, levels, out)
        if boxes is not None:
            paint_boxes(self.optics, *boxes, poses, levels, out)
        return out

    def _checked_out(self, out: np.ndarray | None, shape: tuple[int, ...]) -> np.ndarray:
        if out is None:
            return np.empty(shape, np.uint8)
        if out.shape != shape or out.dtype != np.uint8:
            raise CameraError(
                "The array for the frames is {dtype} {shape}, it should be uint8 {shape_2}. "
                "Give an array of that shape, or none.",
                dtype=out.dtype,
                shape=out.shape,
                shape_2=shape,
            )
        return out


def mounted_optics(width: int, height: int, mount: CameraMount) -> Optics:
    """Return the numbers a kernel needs of a camera of that size on that mount."""
    focal = 0.5 * width / math.tan(0.5 * mount.horizontal_view)
    sine, cosine = math.sin(mount.pitch), math.cos(mount.pitch)
    side = 0.5 * width / focal
    lowest = 0.5 * height / focal  # down over depth at the frame's lower edge
    if mount.roll != 0.0:
        side, lowest = _leaning(side, lowest, mount)
    nearest = mount.z / (sine + lowest * cosine)  # depth at which that ray meets the ground
    return Optics(
        focal, 0.5 * width, 0.5 * height, cosine, sine, mount.x, mount.z,
        side, math.hypot(1.0, side * cosine), 0.5 * nearest, math.cos(mount.roll), math.sin(mount.roll),
    )  # fmt: skip


def _leaning(side: float, lowest: float, mount: CameraMount) -> tuple[float, float]:
    """Return how far aside and down, over depth, ground may lie that a leaning camera must draw.

    That is what is in the frame, and what is above it up to the horizon: a pixel begins with all that lies above.
    """
    cosine, sine = math.cos(mount.roll), abs(math.sin(mount.roll))
    horizon = (math.tan(mount.pitch) + side * sine) / cosine
    return side * cosine + max(lowest, horizon) * sine, math.hypot(side, lowest)


def _checked_poses(poses: np.ndarray) -> np.ndarray:
    poses = np.ascontiguousarray(poses, dtype=np.float64)
    if poses.ndim != 2 or poses.shape[1] != 3:
        raise CameraError(
            "Poses of shape {shape} were given, it should be (R, 3). Give x, y and yaw of each car, one car a row.",
            shape=poses.shape,
        )
    return poses


def _checked_palettes(palettes: np.ndarray, frames: int, ndim: int) -> np.ndarray:
    palettes = np.ascontiguousarray(palettes, dtype=np.float64)
    if palettes.ndim == ndim:
        palettes = palettes[None]
    if palettes.ndim != ndim + 1 or len(palettes) not in (1, frames) or palettes.shape[1] != len(MATERIALS):
        raise CameraError(
            "Palettes of shape {shape} do not fit {frames} frames and {count} materials. "
            "Give one palette, or one for each frame, with a row for each material of scene.MATERIALS.",
            shape=palettes.shape,
            frames=frames,
            count=len(MATERIALS),
        )
    return palettes
