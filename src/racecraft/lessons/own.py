"""The lessons that need no world: texts, checks and figures. Other parts of the course have the same names."""

from __future__ import annotations

from collections.abc import Mapping
from importlib.resources import files

from racecraft.lessons.checking import Check
from racecraft.lessons.exercises import grid_world

TEXTS = files("racecraft.lessons") / "texts"
CHECKS: Mapping[str, Check] = {**grid_world.CHECKS}
MODULES: Mapping[str, str] = {"grid": "racecraft.lessons/rc_grid.js"}
