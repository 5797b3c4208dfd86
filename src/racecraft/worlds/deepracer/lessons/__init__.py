"""The lessons about cars: texts, checks, figures, and what was trained for them (scripts/make_lesson_material.py)."""

from __future__ import annotations

from collections.abc import Mapping
from importlib.resources import files

from racecraft.lessons.checking import Check
from racecraft.worlds.deepracer.lessons import checks, disturbed, racing, sight

HERE = files(__name__)
TEXTS = HERE / "texts"
MATERIAL = HERE / "material"
CHECKS: Mapping[str, Check] = {**checks.CHECKS, **racing.CHECKS, **sight.CHECKS, **disturbed.CHECKS}
MODULES: Mapping[str, str] = {
    "learning": "racecraft.worlds.deepracer.lessons/rc_learning.js",
    "rates": "racecraft.worlds.deepracer.lessons/rc_rates.js",
    "params": "racecraft.worlds.deepracer.lessons/rc_params.js",
    "laps": "racecraft.worlds.deepracer.lessons/rc_laps.js",
    "sight": "racecraft.worlds.deepracer.lessons/rc_sight.js",
    "sureness": "racecraft.worlds.deepracer.lessons/rc_sureness.js",
    "stress": "racecraft.worlds.deepracer.lessons/rc_stress.js",
    "matrix": "racecraft.worlds.deepracer.lessons/rc_matrix.js",
}
