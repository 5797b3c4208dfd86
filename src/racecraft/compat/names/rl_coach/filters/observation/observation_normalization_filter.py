"""Observations of mean 0 and deviation 1."""

from racecraft.compat.coach_config import Part


def ObservationNormalizationFilter(**words: object) -> Part:  # noqa: N802 - Coach's name
    """Return the filter."""
    return Part("ObservationNormalizationFilter", **words)
