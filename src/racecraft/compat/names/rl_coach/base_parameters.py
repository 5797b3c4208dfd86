"""Parameters of everything, and the words among them."""

from racecraft.compat.coach_config import Part


class EmbedderScheme:
    """How large the layers over an observation are."""

    Empty, Shallow, Medium, Deep = "Empty", "Shallow", "Medium", "Deep"


class MiddlewareScheme(EmbedderScheme):
    """How large the layers behind them are."""


class DistributedCoachSynchronizationType:
    """How workers meet; there is one learner here."""

    SYNC, ASYNC = "SYNC", "ASYNC"


def PresetValidationParameters(**words: object) -> Part:  # noqa: N802 - Coach's name
    """Return how Coach tests a preset."""
    return Part("PresetValidationParameters", **words)


def VisualizationParameters(**words: object) -> Part:  # noqa: N802 - Coach's name
    """Return what Coach films."""
    return Part("VisualizationParameters", **words)
