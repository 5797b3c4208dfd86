"""Double deep Q-learning."""

from racecraft.compat.coach_config import Part


def DDQNAgentParameters() -> Part:  # noqa: N802 - Coach's name
    """Return the parameters of an agent."""
    return Part("DDQNAgentParameters")
