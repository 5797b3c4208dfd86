"""Values that change as training goes on."""

from racecraft.compat.coach_config import Line


def LinearSchedule(initial_value: float, final_value: float, decay_steps: int) -> Line:  # noqa: N802 - Coach's name
    """Return a straight line."""
    return Line(initial_value, final_value, decay_steps)


def ConstantSchedule(initial_value: float) -> Line:  # noqa: N802 - Coach's name
    """Return a value that stays."""
    return Line(initial_value, initial_value, 1)
