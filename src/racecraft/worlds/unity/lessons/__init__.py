"""The lessons about Unity's scenes: texts, checks, figures, and what was trained for them."""

from racecraft.worlds.unity.lessons import checks, configuration, policies

CHECKS = (checks, configuration, policies)
