"""The lessons about Unity's scenes: texts, checks and figures."""

from __future__ import annotations

from collections.abc import Mapping
from importlib.resources import files

from racecraft.lessons.checking import Check
from racecraft.worlds.unity.lessons import checks, configuration

TEXTS = files(__name__) / "texts"
CHECKS: Mapping[str, Check] = {**checks.CHECKS, **configuration.CHECKS}
MODULES: Mapping[str, str] = {
    "basic": "racecraft.worlds.unity.lessons/rc_basic.js",
    "schedule": "racecraft.worlds.unity.lessons/rc_schedule.js",
}
