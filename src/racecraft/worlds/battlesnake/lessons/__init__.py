"""The lessons about snakes: texts, checks and figures."""

from racecraft.worlds.battlesnake.lessons import checks, matches

CHECKS = (checks, matches)
