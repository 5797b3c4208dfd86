"""Heads of networks."""

from racecraft.compat.coach_config import Head


def QHeadParameters() -> Head:  # noqa: N802 - Coach's name
    """Return the head that tells what each choice is worth."""
    return Head(is_dueling=False)


def DuelingQHeadParameters() -> Head:  # noqa: N802 - Coach's name
    """Return the head that tells a moment's worth and what each choice adds apart."""
    return Head(is_dueling=True)


__all__ = ["DuelingQHeadParameters", "QHeadParameters"]
