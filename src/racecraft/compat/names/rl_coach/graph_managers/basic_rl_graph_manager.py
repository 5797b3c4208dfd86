"""A preset as a whole."""

from racecraft.compat.coach_config import Part


def BasicRLGraphManager(**parts: object) -> Part:  # noqa: N802 - Coach's name
    """Return agent, environment and schedule together."""
    return Part("BasicRLGraphManager", **parts)
