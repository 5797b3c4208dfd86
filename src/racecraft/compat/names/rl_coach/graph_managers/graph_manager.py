"""How long is trained, and when is judged."""

from racecraft.compat.coach_config import Part


def ScheduleParameters() -> Part:  # noqa: N802 - Coach's name
    """Return the schedule."""
    return Part("ScheduleParameters")
