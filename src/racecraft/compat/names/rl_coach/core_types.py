"""Amounts of training."""

from racecraft.compat.coach_config import EPISODES, STEPS, TRAININGS, Amount, Part


def EnvironmentSteps(count: float) -> Amount:  # noqa: N802 - Coach's name
    """Return so many steps of the environment."""
    return Amount(STEPS, count)


def EnvironmentEpisodes(count: float) -> Amount:  # noqa: N802 - Coach's name
    """Return so many episodes."""
    return Amount(EPISODES, count)


def TrainingSteps(count: float) -> Amount:  # noqa: N802 - Coach's name
    """Return so many acts of learning."""
    return Amount(TRAININGS, count)


class RunPhase:
    """What Coach is doing."""

    HEATUP, TRAIN, TEST = "HEATUP", "TRAIN", "TEST"


def SelectedPhaseOnlyDumpFilter(phase: str) -> Part:  # noqa: N802 - Coach's name
    """Return which phase is filmed."""
    return Part("SelectedPhaseOnlyDumpFilter")


def MaxDumpFilter() -> Part:  # noqa: N802 - Coach's name
    """Return that the best episode is filmed."""
    return Part("MaxDumpFilter")
