"""The lessons about Unity's scenes: texts, checks and figures."""

from racecraft.worlds.unity.lessons import checks, configuration

CHECKS = (checks, configuration)
