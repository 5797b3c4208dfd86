"""The lessons about cars: texts, checks, figures, and what was trained for them (scripts/make_lesson_material.py)."""

from racecraft.worlds.deepracer.lessons import checks, disturbed, racing, sight

CHECKS = (checks, disturbed, racing, sight)
