"""Which groups of settings a race brings along, and what stands in its way."""

import pytest

from racecraft.contract.errors import SettingError
from racecraft.settings.composition import Settings
from racecraft.worlds.deepracer.env.settings import (
    HEAD_TO_BOT,
    HEAD_TO_MODEL,
    OBJECT_AVOIDANCE,
    RACE_TYPES,
    TIME_TRIAL,
    AgainstConfig,
    BotsConfig,
    BoxesConfig,
    RaceConfig,
    objects_in,
    objects_of,
    race_groups,
    with_race_groups,
)

GROUPS = {TIME_TRIAL: [], OBJECT_AVOIDANCE: ["boxes"], HEAD_TO_BOT: ["bots"], HEAD_TO_MODEL: ["against"]}


@pytest.mark.parametrize("race_type", RACE_TYPES)
def test_a_race_has_the_groups_of_its_type_and_no_others(race_type):
    """Whatever groups it had before: none, those of another type, or its own with settings of the user's."""
    assert list(race_groups(race_type)) == GROUPS[race_type]
    race = RaceConfig(type=race_type)
    own = {"boxes": BoxesConfig(number=2), "bots": BotsConfig(number=1), "against": AgainstConfig(cars=3)}
    for had in ({}, *({name: group} for name, group in own.items()), own):
        settings = with_race_groups(Settings(race=race, **had))
        assert [name for name in ("boxes", "bots", "against") if name in settings] == GROUPS[race_type]
        for name in GROUPS[race_type]:
            assert getattr(settings, name) == had.get(name, race_groups(race_type)[name])
        assert settings.race == race


def test_what_stands_in_the_way_is_what_is_asked_or_by_default_what_the_type_has():
    assert [objects_in(race_type) for race_type in RACE_TYPES] == [None, BoxesConfig(), BotsConfig(), None]
    asked = {"boxes": BoxesConfig(number=2), "bots": BotsConfig(number=1), "against": AgainstConfig()}
    told = [objects_of(Settings(race=RaceConfig(type=race_type), **asked)) for race_type in RACE_TYPES]
    assert told == [None, asked["boxes"], asked["bots"], None]
    assert objects_of(Settings(race=RaceConfig(type=OBJECT_AVOIDANCE))) is None, "nobody asked"


def test_places_that_cannot_be_read_are_refused_where_they_are_set():
    assert BoxesConfig(positions="0.5,1").positions == "0.5,1"
    with pytest.raises(SettingError, match="lies off the track"):
        BoxesConfig(positions="1.2,1")
