"""What a checkpoint tells of its behaviors: enough to know each one's sensors and actions where no player is at hand.

One behavior stands as `behavior`, several as `behaviors`, by name without the team, each with its own groups of
settings (`network` and that of the algorithm); `settings` are what all share. Begin with `card_for`, and `behaviors_in`
for the way back.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from racecraft.worlds.unity.env.behaviors import Behavior, behavior_from, card_of

Groups = Mapping[str, Mapping[str, Any]]
"""Settings as plain values, by group."""


def card_for(behaviors: Sequence[Behavior], own: Mapping[str, Groups]) -> dict[str, Any]:
    """Return behaviors as plain values.

    Args:
        behaviors: Who learns.
        own: Each one's own groups of settings, by name without the team.
    """
    if len(behaviors) == 1:
        return {"behavior": card_of(behaviors[0])}
    return {
        "behaviors": {
            behavior.base_name: {"behavior": card_of(behavior), **own[behavior.base_name]} for behavior in behaviors
        }
    }


def behaviors_in(card: Mapping[str, Any]) -> dict[str, tuple[Behavior, Groups]]:
    """Return the behaviors of a checkpoint's metadata, by name without the team, each with its own groups of settings.

    >>> from racecraft.worlds.unity.env.behaviors import UnityActions
    >>> behavior = Behavior("A?team=0", (), UnityActions(1))
    >>> behaviors_in(card_for([behavior], {"A": {}})) == {"A": (behavior, {})}
    True
    """
    if "behaviors" not in card:
        behavior = behavior_from(card["behavior"])
        return {behavior.base_name: (behavior, {})}
    return {
        base: (behavior_from(own["behavior"]), {name: group for name, group in own.items() if name != "behavior"})
        for base, own in card["behaviors"].items()
    }
