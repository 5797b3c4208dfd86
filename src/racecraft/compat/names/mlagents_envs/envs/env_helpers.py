"""Names of agents: `Behavior?team=0?agent_id=3`."""

from __future__ import annotations


def agent_name(behavior: str, agent_id: int) -> str:
    """Return the name of an agent.

    >>> agent_name("Basic?team=0", 3)
    'Basic?team=0?agent_id=3'
    """
    return f"{behavior}?agent_id={agent_id}"


def behavior_of(agent: str) -> str:
    """Return the behavior of a named agent.

    >>> behavior_of("Basic?team=0?agent_id=3")
    'Basic?team=0'
    """
    return agent.rpartition("?agent_id=")[0]
