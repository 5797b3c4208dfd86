"""What lies under every pixel of a car's frame, and how much of a policy's attention each surface gets.

Begin with `surface_shares` and `by_surface`. The camera makes a pixel of the exact shares of the materials in it
(`kernels/camera.py`), so a frame of one material alone, white on black, is the share that material has of each pixel.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from racecraft.contract.world import Array
from racecraft.worlds.deepracer.env.camera import Camera
from racecraft.worlds.deepracer.env.objects import KINDS
from racecraft.worlds.deepracer.env.scene import MATERIALS

OBSTACLE = "obstacle"
NAMES = {
    "field": "grass", "line": "border line", "dash": "centre line", "start": "start line",
    **dict.fromkeys((kind.name for kind in KINDS), OBSTACLE),
}  # fmt: skip
"""What racers call materials whose name in the scene is another; all walls are one surface, all boxes and bots too."""
Objects = tuple[Array, Array]
"""Boxes and bots of T moments, (T, K, 6) and their kinds (T, K), as `objects.Objects` has them."""


def surface_of(material: str) -> str:
    """Return the surface that a material of the scene belongs to.

    >>> surface_of("field"), surface_of("wall south"), surface_of("bot_car")
    ('grass', 'wall', 'obstacle')
    """
    return "wall" if material.startswith("wall") else NAMES.get(material, material)


SURFACES = tuple(dict.fromkeys(surface_of(material) for material in MATERIALS))
"""In the order of the scene's materials."""
ROUNDED = 0.01
"""Shares of a pixel that is wholly told add up to 1 within this: each is a whole number of 255ths."""


@dataclass(frozen=True)
class SurfaceAttention:
    """What one surface gets over a drive."""

    surface: str
    area: float
    """Share of all pixels, 0 to 1."""
    attention: float
    """Share of all attention, 0 to 1."""
    changed: float | None = None
    """Share of the ticks with it in sight on which the decision is another where it is painted over; None: not
    tried."""

    @property
    def times_its_area(self) -> float:
        """How many times the attention that an even look would give it."""
        return self.attention / self.area if self.area > 0 else 0.0


def surface_shares(camera: Camera, poses: Array, objects: Objects | None = None) -> Array:
    """Return how much of each pixel each surface fills.

    Args:
        camera: Of the size and mount the policy sees through.
        poses: (T, 3): x, y in m and yaw in rad of base_link.
        objects: What stood on the road then; None: nothing.

    Returns:
        float32 (T, S, H, W), 0 to 1, over S = len(SURFACES); they add up to 1 within a hundredth.
    """
    plain = Camera(camera.scene._replace(grass=0.0), camera.width, camera.height, camera.mount)
    found = np.empty((len(poses), len(SURFACES), camera.height, camera.width), np.float32)
    for number, surface in enumerate(SURFACES):
        white = np.array([255.0 * (surface_of(material) == surface != OBSTACLE) for material in MATERIALS])
        found[:, number] = plain.render_grey(poses, palettes=white, boxes=objects) / np.float32(255.0)
    if objects is not None:  # what nothing else fills: a box's sides are shaded, so its own white is none
        found[:, SURFACES.index(OBSTACLE)] = np.maximum(1.0 - found.sum(axis=1) - ROUNDED, 0.0)
    return found


def eye_poses(poses: Array, left_m: float) -> Array:
    """Return the poses (T, 3) of an eye so far left of the car's middle, m, as those of a car that has one eye."""
    x, y, yaw = np.asarray(poses, float).T
    return np.column_stack([x - left_m * np.sin(yaw), y + left_m * np.cos(yaw), yaw])


def by_surface(heat: Array, shares: Array) -> list[SurfaceAttention]:
    """Return what each surface gets of the attention of T frames, most first; surfaces out of sight are left out.

    Args:
        heat: (T, H, W), never negative.
        shares: (T, S, H, W) from `surface_shares`.
    """
    area = shares.sum(axis=(0, 2, 3), dtype=np.float64)
    got = np.einsum("thw,tshw->s", heat, shares, dtype=np.float64)
    area, got = area / area.sum(), got / max(got.sum(), 1e-300)
    rows = [SurfaceAttention(name, float(area[k]), float(got[k])) for k, name in enumerate(SURFACES) if area[k] > 1e-4]
    return sorted(rows, key=lambda row: -row.attention)


def painted_over(
    camera: Camera, poses: Array, surface: str, levels: Array | None = None, objects: Objects | None = None
) -> Array:
    """Return what the car would see were a surface not told from its surroundings, uint8 (T, H, W).

    Grass, lines and the start take the road's grey, the road the grass's; walls and sky change places; obstacles are
    taken away.

    Args:
        camera: Of the size and mount the policy sees through.
        poses: (T, 3): x, y in m and yaw in rad of base_link.
        surface: One of SURFACES.
        levels: Grey level of each material as this camera tells it; None: one eye's.
        objects: What stood on the road then; None: nothing.
    """
    if surface == OBSTACLE:
        return camera.render_grey(poses, palettes=levels)
    levels = np.array(camera.scene.grey_palette if levels is None else levels, float)
    by_name = dict(zip(MATERIALS, levels, strict=True))
    for k, material in enumerate(MATERIALS):
        if surface_of(material) == surface:
            levels[k] = by_name[_instead(surface)]
    return camera.render_grey(poses, palettes=levels, boxes=objects)


def _instead(surface: str) -> str:
    """Return the material whose grey a surface is given."""
    return {"road": "field", "wall": "sky", "sky": "wall south"}.get(surface, "road")
