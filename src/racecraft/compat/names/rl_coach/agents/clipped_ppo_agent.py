"""Clipped PPO."""

from racecraft.compat.coach_config import Part


def ClippedPPOAgentParameters() -> Part:  # noqa: N802 - Coach's name
    """Return the parameters of an agent."""
    return Part("ClippedPPOAgentParameters")
