"""What a checkpoint tells of its behaviors."""

from racecraft.worlds.unity.env.behavior_specs import behaviors_in, card_for
from racecraft.worlds.unity.env.behaviors import Behavior, Sensor, UnityActions

STRIKER = Behavior("Striker?team=0", (Sensor("eye", (3,), (3,)),), UnityActions(2))
GOALIE = Behavior("Goalie?team=1", (Sensor("eye", (4, 5, 3), (3, 4, 5), True, "CHW"),), UnityActions(0, (2, 3)))


def test_one_behavior_stands_alone_and_has_no_settings_of_its_own():
    card = card_for([STRIKER], {"Striker": {"network": {"units": 3}}})
    assert list(card) == ["behavior"]
    assert behaviors_in(card) == {"Striker": (STRIKER, {})}


def test_several_stand_by_name_each_with_its_own_settings():
    own = {"Striker": {"network": {"units": 3}, "ppo": {"clip": 0.1}}, "Goalie": {"network": {"units": 4}}}
    card = card_for([STRIKER, GOALIE], own)
    assert list(card) == ["behaviors"]
    assert behaviors_in(card) == {"Striker": (STRIKER, own["Striker"]), "Goalie": (GOALIE, own["Goalie"])}
