"""The lessons that need no world: texts, checks and figures. Other parts of the course have the same names."""

from __future__ import annotations

from collections.abc import Mapping
from importlib.resources import files

from racecraft.lessons.checking import Check
from racecraft.lessons.exercises import family, gradient, grid_world, rewards

TEXTS = files("racecraft.lessons") / "texts"
CHECKS: Mapping[str, Check] = {**grid_world.CHECKS, **rewards.CHECKS, **gradient.CHECKS, **family.CHECKS}
MODULES: Mapping[str, str] = {
    "grid": "racecraft.lessons/rc_grid.js",
    "fork": "racecraft.lessons/rc_fork.js",
    "temperature": "racecraft.lessons/rc_temperature.js",
    "search": "racecraft.lessons/rc_search.js",
    "gradient": "racecraft.lessons/rc_gradient.js",
}
