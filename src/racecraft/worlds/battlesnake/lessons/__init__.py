"""The lessons about snakes: texts, checks and figures."""

from __future__ import annotations

from collections.abc import Mapping
from importlib.resources import files

from racecraft.lessons.checking import Check
from racecraft.worlds.battlesnake.lessons import checks

HERE = files(__name__)
TEXTS = HERE / "texts"
CHECKS: Mapping[str, Check] = checks.CHECKS
MODULES: Mapping[str, str] = {"snake": "racecraft.worlds.battlesnake.lessons/rc_snake.js"}
