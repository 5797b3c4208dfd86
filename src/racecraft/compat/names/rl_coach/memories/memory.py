"""What is remembered."""


class MemoryGranularity:
    """What a memory's size counts."""

    Transitions, Episodes = "Transitions", "Episodes"
