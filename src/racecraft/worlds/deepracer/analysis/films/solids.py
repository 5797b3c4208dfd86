"""Cars painted into a camera's picture: faces projected by the same optics, far ones first. See `paint_car`."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from racecraft.contract.world import Array
from racecraft.worlds.deepracer.analysis.films.shells import Shell

NEAR_M = 0.03
"""What lies nearer to the eye is cut off."""
FINE = 3
"""Points a side of a pixel that edges are drawn with."""
SUN = np.array([0.35, 0.25, 0.9]) / math.sqrt(0.35**2 + 0.25**2 + 0.9**2)
"""Towards the light, in the world's frame."""
SHADE, SHADOW = 0.58, 0.45
"""Share of the light on a face that turns away from the sun; darkness of the patch under a car."""


class CameraPose(NamedTuple):
    """Where a camera is and how it looks: a pinhole, lengths in m, angles in rad."""

    x: float
    y: float
    z: float
    yaw: float
    """Left positive."""
    pitch: float
    """Positive looks down."""
    focal: float
    """Pixels."""


def paint_car(picture: Array, eye: CameraPose, shell: Shell, pose: tuple[float, float, float]) -> None:
    """Paint a car into a picture (H, W, 3) uint8, in place; what stands before it is painted after it.

    Args:
        picture: What the eye sees else.
        eye: The camera.
        shell: The car's surface.
        pose: x, y (m) and yaw (rad) of its base_link.
    """
    lit = _lit(shell, pose, eye)
    ground = _cut(_into_camera(eye, _placed(_FOOTPRINT, pose)))
    shapes = [(_projected(face, eye, picture), colour) for face, colour in lit]
    shapes = [(outline, colour) for outline, colour in shapes if len(outline) > 2]
    draw_polygons(picture, [(_projected(ground, eye, picture), (0, 0, 0))] if len(ground) > 2 else [], SHADOW)
    draw_polygons(picture, shapes, 1.0)


_FOOTPRINT = np.array(
    [(0.175 * math.cos(a), 0.115 * math.sin(a), 0.0) for a in np.linspace(0, 2 * math.pi, 24, endpoint=False)]
)


def _placed(points: Array, pose: tuple[float, float, float]) -> Array:
    """Return points (P, 3) of the car's frame in the world."""
    x, y, yaw = pose
    cosine, sine = math.cos(yaw), math.sin(yaw)
    return np.column_stack(
        [
            x + cosine * points[:, 0] - sine * points[:, 1],
            y + sine * points[:, 0] + cosine * points[:, 1],
            points[:, 2],
        ]
    )


def _lit(shell: Shell, pose: tuple[float, float, float], eye: CameraPose) -> list[tuple[Array, tuple[int, int, int]]]:
    """Return the faces that the eye sees, in its frame and cut, with the light they have; far ones first."""
    place, seen = np.array([eye.x, eye.y, eye.z]), []
    for face, colour in zip(shell.faces, shell.colours, strict=True):
        corners = _placed(face, pose)
        normal = np.cross(corners[1] - corners[0], corners[2] - corners[1])
        normal /= np.linalg.norm(normal)
        middle = corners.mean(axis=0)
        if normal @ (place - middle) <= 0.0:
            continue
        cut = _cut(_into_camera(eye, corners))
        if len(cut) > 2:
            light = SHADE + (1.0 - SHADE) * max(0.0, float(normal @ SUN))
            r, g, b = np.clip(colour * light, 0, 255).astype(int)
            seen.append((float(np.linalg.norm(middle - place)), cut, (int(r), int(g), int(b))))
    seen.sort(key=lambda one: -one[0])
    return [(cut, colour) for _, cut, colour in seen]


def _into_camera(eye: CameraPose, points: Array) -> Array:
    """Return depth, left and down of points (P, 3) of the world, m; as `kernels/camera.py` has it."""
    dx, dy, dz = points[:, 0] - eye.x, points[:, 1] - eye.y, points[:, 2] - eye.z
    ahead = dx * math.cos(eye.yaw) + dy * math.sin(eye.yaw)
    left = dy * math.cos(eye.yaw) - dx * math.sin(eye.yaw)
    cosine, sine = math.cos(eye.pitch), math.sin(eye.pitch)
    return np.column_stack([ahead * cosine - dz * sine, left, -ahead * sine - dz * cosine])


def _cut(points: Array) -> Array:
    """Return a convex polygon of camera points without what lies behind the near plane."""
    kept = []
    for here, there in zip(points, np.roll(points, -1, axis=0), strict=True):
        if here[0] >= NEAR_M:
            kept.append(here)
        if (here[0] >= NEAR_M) != (there[0] >= NEAR_M):
            kept.append(here + (NEAR_M - here[0]) / (there[0] - here[0]) * (there - here))
    return np.array(kept)


def _projected(points: Array, eye: CameraPose, picture: Array) -> Array:
    """Return where camera points lie in a picture, (P, 2) pixels, x right and y down."""
    height, width = picture.shape[:2]
    scale = eye.focal / points[:, 0]
    return np.column_stack([0.5 * width - points[:, 1] * scale, 0.5 * height + points[:, 2] * scale])


def draw_polygons(picture: Array, shapes: list[tuple[Array, tuple[int, int, int]]], cover: float) -> None:
    """Lay polygons over a picture (H, W, 3) uint8 with soft edges, in order; in place.

    Args:
        picture: What lies below.
        shapes: Corners (P, 2) in pixels, x right and y down, and RGB of each.
        cover: Share of what lies below that they hide, 0 to 1.
    """
    from PIL import Image, ImageDraw

    height, width = picture.shape[:2]
    corners = np.concatenate([outline for outline, _ in shapes]) if shapes else np.empty((0, 2))
    if not len(corners):
        return
    x0, y0 = np.clip(np.floor(corners.min(axis=0)) - 1, 0, (width, height)).astype(int)
    x1, y1 = np.clip(np.ceil(corners.max(axis=0)) + 1, 0, (width, height)).astype(int)
    if x0 >= x1 or y0 >= y1:
        return
    sheet = Image.new("RGBA", (FINE * int(x1 - x0), FINE * int(y1 - y0)))
    pen = ImageDraw.Draw(sheet)
    for outline, colour in shapes:
        pen.polygon([tuple(point) for point in (FINE * (outline - (x0, y0))).tolist()], (*colour, 255))
    fine = np.asarray(sheet, np.float32).reshape(int(y1 - y0), FINE, int(x1 - x0), FINE, 4)
    share = fine[..., 3:] / 255.0
    alpha = share.mean(axis=(1, 3))
    colour = (fine[..., :3] * share).mean(axis=(1, 3))
    patch = picture[y0:y1, x0:x1]
    patch[:] = np.clip(patch * (1.0 - cover * alpha) + cover * colour + 0.5, 0, 255).astype(np.uint8)
