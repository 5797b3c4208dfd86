"""Random choices now and then."""

from racecraft.compat.coach_config import Part


def EGreedyParameters() -> Part:  # noqa: N802 - Coach's name
    """Return the parameters of exploration."""
    return Part("EGreedyParameters")
