"""Environments of Gym."""

from racecraft.compat.coach_config import Part

mujoco_v2: dict[str, str] = {}
"""Names of MuJoCo's levels; presets import it and use nothing of it."""


def GymVectorEnvironment(level: str = "", **words: object) -> Part:  # noqa: N802 - Coach's name
    """Return an environment by its id, or as "module:Class"."""
    return Part("GymVectorEnvironment", level=level, **words)
