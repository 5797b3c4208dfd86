"""The light of the original's worlds in three years, and the colours it gives a circuit. Begin with `palette_under`.

Textures are the same in all years; the sun is not. A light says what share of a texture's RGB is seen on the ground, on
painted lines and on the inner face of each wall, and what colour stands above the walls. The shares are fitted to grey
levels read from real camera frames (docs/fidelity.md has the table); red, green and blue within a grey level follow the
sun, which gives a little less blue. Objects have the light of the ground. re:Invent 2018
lies on a carpet that shines less, in a hall with three dark walls.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from racecraft.worlds.deepracer.env.objects import KINDS
from racecraft.worlds.deepracer.tracks.style import TrackStyle

CARPETED = ("reinvent_base",)
"""Circuits that have a light of their own."""


class Light(NamedTuple):
    """Shares of the textures' RGB that are seen."""

    ground: tuple[float, float, float]
    """On field and road."""
    paint: tuple[float, float, float]
    """On lines, dashes and the start strip."""
    walls: tuple[float, float, float, float]
    """On the inner face of the south, east, north and west wall."""
    sky: float | None
    """Grey level above the walls; None: the colour of the walls goes on."""


def _sun(share: float) -> tuple[float, float, float]:
    return share, share, 0.98 * share


LIGHTS = {
    "2019": Light(_sun(1.31), _sun(1.31), (1.31, 1.31, 1.31, 1.31), None),
    "2021": Light(_sun(1.175), _sun(1.175), (1.21, 1.21, 1.21, 1.21), 174.0),
    "2026": Light(_sun(1.06), _sun(1.06), (1.06, 1.06, 1.06, 1.06), 178.0),
}
"""By year: the first simulator; the console from 2020 to its end; the ROS 2 build. Nearly every circuit has these."""
CARPET_LIGHTS = {
    "2019": Light((1.04, 1.04, 1.05), (1.20, 1.20, 1.20), (0.0, 0.82, 0.96, 0.44), None),
    "2021": Light((1.04, 1.04, 1.05), (1.06, 1.06, 1.06), (0.016, 0.2, 0.21, 0.39), 178.0),
    "2026": Light((0.94, 0.94, 0.95), (0.96, 0.96, 0.96), (1.06, 1.06, 1.06, 1.06), 178.0),
}
"""The same on re:Invent 2018. No frame of it was recorded in 2026: its ground is that of 2021, darker by as much as
other circuits are, its walls are lit like theirs."""
LIGHT_OF_CAR = {"v4": "2021", "v5-classic": "2021", "v6": "2026", "v6-unlimited": "2026", "kinematic": "2026"}
"""The light of the simulator that drove a car."""


def light_for(light: str, car: str) -> str:
    """Return the year of the light that a race has: the one asked for, or that of its car.

    >>> light_for("car", "v4"), light_for("2019", "v4")
    ('2021', '2019')
    """
    return LIGHT_OF_CAR[car] if light == "car" else light


def palette_under(light: str, look: TrackStyle, name: str = "", for_people: bool = False) -> np.ndarray:
    """Return the RGB levels of a circuit's materials, (M, 3), 0 to 255, in the order of `scene.MATERIALS`.

    Args:
        light: "2019", "2021" or "2026".
        look: The circuit's textures.
        name: The circuit's name; some have a light of their own.
        for_people: All walls are lit alike, as in a film: a wall in its own shadow is a black picture.
    """
    shares = (CARPET_LIGHTS if name in CARPETED else LIGHTS)[light]
    walls = LIGHTS[light].walls if for_people else shares.walls
    ground = [np.array(colour) * shares.ground for colour in (look.field, look.road)]
    paint = [np.array(colour) * shares.paint for colour in (look.line, look.dash, look.start)]
    wall = np.array(look.wall, dtype=np.float64)
    if shares.sky is None:
        sky = wall if name in CARPETED else wall * LIGHTS[light].walls[0]
    else:
        sky = np.full(3, shares.sky)
    objects = [np.array(kind.colour) * shares.ground for kind in KINDS]
    return np.clip(np.array([*ground, *paint, *(wall * share for share in walls), sky, *objects]), 0.0, 255.0)
