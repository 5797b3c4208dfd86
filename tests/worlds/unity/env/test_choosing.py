"""Which behaviors of a scene are acted for."""

import pytest

from racecraft.worlds.unity.env.behaviors import Behavior, Sensor, UnityActions
from racecraft.worlds.unity.env.choosing import choose, choose_several, single
from racecraft.worlds.unity.env.errors import BuildError

EYE, EAR = (Sensor(name, (1,), (1,)) for name in ("eye", "ear"))


def scene(*names, **others):
    """Behaviors that see and do the same, but for those named otherwise."""
    known = {name: Behavior(name, (EYE,), UnityActions(1)) for name in names}
    return known | {name: Behavior(name, *parts) for name, parts in others.items()}


GAME = scene("Striker?team=0", "Striker?team=1", "Goalie?team=0")


@pytest.mark.parametrize(
    ("wish", "first"),
    [(None, None), ("Striker", "Striker"), (["Goalie", "Striker"], "Goalie"), (("Goalie",), "Goalie")],
)
def test_of_several_wishes_the_first_is_one(wish, first):
    assert single(wish) == first


@pytest.mark.parametrize(
    ("wish", "known", "chosen"),
    [
        (None, scene("A?team=0", "A?team=1"), ["A?team=0", "A?team=1"]),
        ("Striker", GAME, ["Striker?team=0", "Striker?team=1"]),
        ("Striker?team=1", GAME, ["Striker?team=1"]),
        ("Goalie", GAME, ["Goalie?team=0"]),
    ],
)
def test_teams_of_one_behavior_go_together(wish, known, chosen):
    assert choose(wish, known) == chosen


@pytest.mark.parametrize(
    ("wish", "known", "letter"),
    [
        (None, GAME, r"no behavior is chosen; the scene has Striker\?team=0, Striker\?team=1, Goalie\?team=0"),
        ("Keeper", GAME, "no behavior is named 'Keeper'"),
        ("A", scene("A?team=0", **{"A?team=1": ((EAR,), UnityActions(1))}), "see or do different things"),
    ],
)
def test_what_cannot_be_chosen_is_told(wish, known, letter):
    with pytest.raises(BuildError, match=letter):
        choose(wish, known)


STRIKERS, GOALIES = ["Striker?team=0", "Striker?team=1"], ["Goalie?team=0"]


@pytest.mark.parametrize(
    ("wish", "chosen"),
    [
        (None, [STRIKERS, GOALIES]),
        ("Goalie", [GOALIES]),
        (["Goalie", "Striker"], [STRIKERS, GOALIES]),  # in the scene's order
        (["Goalie", "Nobody"], [GOALIES]),
        (["Nobody"], [STRIKERS, GOALIES]),
    ],
)
def test_several_are_those_wished_for_or_where_none_is_known_all(wish, chosen):
    assert choose_several(wish, GAME) == chosen
