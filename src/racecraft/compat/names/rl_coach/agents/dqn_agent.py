"""Deep Q-learning."""

from racecraft.compat.coach_config import Part


def DQNAgentParameters() -> Part:  # noqa: N802 - Coach's name
    """Return the parameters of an agent."""
    return Part("DQNAgentParameters")
