"""What cars look like in films: shells as simple convex solids in the original's names and colours. See `shell_named`.

Metres in the car's own frame: x ahead of base_link, y left, z above the ground. A shell fills the original's bounding
box, 0.324 x 0.188 x 0.195 m (facts: deepracer.md 1.1); its form is ours.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from racecraft.contract.errors import SettingError, nearest
from racecraft.contract.world import Array

RGB = tuple[int, int, int]

COLOURS: dict[str, RGB] = {
    "Black": (44, 46, 50),
    "Grey": (134, 140, 146),
    "Blue": (24, 92, 190),
    "Red": (200, 32, 40),
    "Orange": (236, 122, 20),
    "White": (236, 238, 240),
    "Purple": (124, 62, 170),
}
"""The original's seven, by its names (facts: deepracer-systems.md A2, DR_CAR_COLOR)."""
DEEPRACER = "deepracer"
F1_COLOURS: dict[str, RGB] = {
    "f1_2021": (214, 20, 44),
    "f1_car_11": (0, 170, 160),
    "f1_car_12": (30, 50, 110),
    "f1_car_13": (240, 130, 0),
    "f1_car_14": (0, 96, 72),
    "f1_car_15": (30, 130, 220),
    "f1_car_16": (190, 16, 24),
    "f1_car_17": (244, 244, 244),
    "f1_car_18": (110, 20, 40),
    "f1_car_19": (44, 70, 98),
    "f1_car_20": (250, 204, 40),
    "f1_car_21": (70, 74, 80),
}
"""Formula-1 shells come painted, whatever DR_CAR_COLOR says; which colour is ours to choose."""
SHELLS = (DEEPRACER, *F1_COLOURS)
TYRE, DARK, GLASS, LAMP = (24, 25, 28), (40, 43, 48), (30, 40, 52), (240, 236, 210)
WHEEL_RADIUS_M, WHEEL_WIDTH_M, WHEEL_SIDES = 0.036, 0.034, 12
WHEELS_M = ((0.0823, 0.0796), (0.0823, -0.0796), (-0.0817, 0.0811), (-0.0817, -0.0811))
"""Centres of the wheels, ahead and left (facts: deepracer.md 1.1)."""


@dataclass(frozen=True, eq=False)
class Shell:
    """A car's surface: plane convex faces, seen from outside only."""

    faces: tuple[Array, ...]
    """(P, 3) corners each, counter-clockwise from outside."""
    colours: Array
    """(F, 3) RGB of each face, unlit."""


@lru_cache(maxsize=32)
def shell_named(name: str = DEEPRACER, colour: str = "Red") -> Shell:
    """Return a shell; both names in any case.

    Raises:
        SettingError: There is no such shell, or no such colour.
    """
    paint = paint_of(name, colour)
    return _built(_deepracer(paint) if name.lower() == DEEPRACER else _formula_one(paint))


def paint_of(name: str = DEEPRACER, colour: str = "Red") -> RGB:
    """Return what a shell is painted with; both names in any case.

    Raises:
        SettingError: There is no such shell, or no such colour.
    """
    by_letters = {known.lower(): paint for known, paint in COLOURS.items()}
    if name.lower() not in SHELLS:
        raise SettingError("there is no body shell '{name}'. {hint}", name=name, hint=nearest(name, SHELLS))
    if colour.lower() not in by_letters:
        raise SettingError("there is no car colour '{colour}'. {hint}", colour=colour, hint=nearest(colour, COLOURS))
    return F1_COLOURS.get(name.lower(), by_letters[colour.lower()])


Part = tuple[list[Array], RGB]


def _deepracer(paint: RGB) -> list[Part]:
    """A truck's low body with a glass cabin, the computer behind it, and the camera on its mast."""
    return [
        *_wheels(),
        (_block((-0.145, 0.15), 0.062, (0.03, 0.058)), DARK),
        (_block((-0.158, 0.166), 0.07, (0.055, 0.09), (-0.15, 0.12), 0.062), paint),
        (_block((-0.1, 0.085), 0.058, (0.09, 0.128), (-0.08, 0.03), 0.046), GLASS),
        (_block((-0.085, 0.032), 0.047, (0.128, 0.134)), paint),
        (_block((-0.158, -0.128), 0.08, (0.118, 0.126)), paint),
        (_block((-0.15, -0.135), 0.01, (0.09, 0.118)), DARK),
        (_block((0.108, 0.122), 0.008, (0.085, 0.13)), DARK),
        (_block((0.104, 0.145), 0.022, (0.122, 0.146)), DARK),
        (_block((0.145, 0.147), 0.007, (0.127, 0.141)), LAMP),
    ]


def _formula_one(paint: RGB) -> list[Part]:
    """An open-wheeler: needle nose, wings before and behind, a driver's head under the halo."""
    return [
        *_wheels(),
        (_block((-0.15, 0.1), 0.04, (0.026, 0.045)), DARK),
        (_block((-0.13, 0.05), 0.05, (0.04, 0.082), (-0.13, 0.03), 0.034), paint),
        (_block((0.03, 0.158), 0.026, (0.04, 0.075), (0.03, 0.15), 0.013), paint),
        (_block((0.135, 0.166), 0.09, (0.022, 0.03)), paint),
        (_block((-0.15, 0.0), 0.018, (0.08, 0.118), (-0.14, -0.03), 0.012), paint),
        (_block((0.0, 0.034), 0.016, (0.075, 0.105), (0.006, 0.028), 0.011), LAMP),
        (_block((-0.158, -0.125), 0.076, (0.126, 0.136)), paint),
        (_block((-0.155, -0.13), 0.076, (0.11, 0.126)), DARK),
        (_block((-0.148, -0.138), 0.01, (0.06, 0.11)), DARK),
        (_block((0.02, 0.06), 0.003, (0.075, 0.112), (0.02, 0.03), 0.003), DARK),
    ]


def _wheels() -> list[Part]:
    return [(_wheel(x, y), TYRE) for x, y in WHEELS_M]


def _block(
    along: tuple[float, float],
    half_width: float,
    up: tuple[float, float],
    along_top: tuple[float, float] | None = None,
    half_width_top: float | None = None,
) -> list[Array]:
    """Return the six faces of a block whose top may be shorter and narrower than its foot."""
    (x0, x1), (z0, z1), (t0, t1) = along, up, along_top or along
    top = half_width if half_width_top is None else half_width_top
    foot = [(x0, -half_width, z0), (x1, -half_width, z0), (x1, half_width, z0), (x0, half_width, z0)]
    head = [(t0, -top, z1), (t1, -top, z1), (t1, top, z1), (t0, top, z1)]
    sides = [[foot[k], foot[(k + 1) % 4], head[(k + 1) % 4], head[k]] for k in range(4)]
    return [np.array(face) for face in (foot[::-1], head, *sides)]


def _wheel(x: float, y: float) -> list[Array]:
    """Return a wheel that stands on the ground: a prism of WHEEL_SIDES sides along y."""
    angles = 2.0 * math.pi * np.arange(WHEEL_SIDES) / WHEEL_SIDES
    rim = np.column_stack([x + WHEEL_RADIUS_M * np.cos(angles), WHEEL_RADIUS_M * (1.0 + np.sin(angles))])
    right, left = (
        np.column_stack([rim[:, 0], np.full(WHEEL_SIDES, y + side * WHEEL_WIDTH_M / 2), rim[:, 1]]) for side in (-1, 1)
    )
    treads = [np.array([right[k - 1], left[k - 1], left[k], right[k]]) for k in range(WHEEL_SIDES)]
    return [right, left[::-1], *treads]


def _built(parts: list[Part]) -> Shell:
    faces = tuple(face for solid, _ in parts for face in solid)
    colours = np.array([colour for solid, colour in parts for _ in solid], float)
    return Shell(faces, colours)
