"""What a checkpoint tells of its behaviors: enough to rebuild each policy where no player is at hand.

One behavior stands as `behavior`, several as `behaviors`, by name without the team, each with its own `network` and
`ppo`; `settings` are what all share. Begin with `card_for`, and `behaviors_in` for the way back.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from racecraft.envs.unity.behaviors import Behavior, behavior_from, card_of
from racecraft.settings.groups import TrainSettings
from racecraft.settings.overrides import as_dictionary, from_dictionary

OWN_GROUPS = ("network", "ppo")
"""Groups of settings that each behavior has for itself."""


def card_for(behaviors: Sequence[Behavior], each: Mapping[str, TrainSettings]) -> dict[str, Any]:
    """Return behaviors as plain values.

    Args:
        behaviors: Who learns.
        each: Their settings, by name without the team.
    """
    if len(behaviors) == 1:
        return {"behavior": card_of(behaviors[0])}
    own = {base: as_dictionary(settings) for base, settings in each.items()}
    return {
        "behaviors": {
            behavior.base_name: {
                "behavior": card_of(behavior),
                **{group: own[behavior.base_name][group] for group in OWN_GROUPS},
            }
            for behavior in behaviors
        }
    }


def behaviors_in(card: Mapping[str, Any]) -> dict[str, tuple[Behavior, TrainSettings]]:
    """Return the behaviors of a checkpoint's card, by name without the team, each with its settings.

    >>> from racecraft.envs.unity.behaviors import UnityActions
    >>> behavior = Behavior("A?team=0", (), UnityActions(1))
    >>> settings = TrainSettings()
    >>> card = card_for([behavior], {"A": settings}) | {"settings": as_dictionary(settings)}
    >>> behaviors_in(card) == {"A": (behavior, settings)}
    True
    """
    shared = card["settings"]
    if "behaviors" not in card:
        behavior = behavior_from(card["behavior"])
        return {behavior.base_name: (behavior, from_dictionary(TrainSettings, shared))}
    return {
        base: (
            behavior_from(own["behavior"]),
            from_dictionary(TrainSettings, {**shared, **{group: own[group] for group in OWN_GROUPS}}),
        )
        for base, own in card["behaviors"].items()
    }
