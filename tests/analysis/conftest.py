"""Drives for tests: the fixtures of the car's own analysis."""

from tests.worlds.deepracer.analysis.conftest import reports_along, track

__all__ = ["reports_along", "track"]
