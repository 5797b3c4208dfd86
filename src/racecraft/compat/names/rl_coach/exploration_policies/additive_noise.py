"""Noise on top of numbers."""

from racecraft.compat.coach_config import Part


def AdditiveNoiseParameters() -> Part:  # noqa: N802 - Coach's name
    """Return the parameters of exploration."""
    return Part("AdditiveNoiseParameters")
