"""Which groups of settings a race brings along, and what stands in its way."""

import pytest

from racecraft.contract.errors import SettingError
from racecraft.settings.composition import Settings
from racecraft.worlds.deepracer.env.settings import (
    HEAD_TO_BOT,
    HEAD_TO_MODEL,
    MAX_CARS,
    OBJECT_AVOIDANCE,
    RACE_TYPES,
    TIME_TRIAL,
    AgainstConfig,
    BotsConfig,
    BoxesConfig,
    CameraConfig,
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


def test_a_race_is_what_the_console_s_is_where_nothing_is_said():
    race, camera = RaceConfig(), CameraConfig()
    assert (race.type, race.car, race.max_episode_seconds, race.fidelity) == ("TIME_TRIAL", "v6", None, "sane")
    assert (race.start_offset, race.start_advance, race.change_start, race.reverse) == (0.0, 0.05, True, False)
    assert (race.waypoints, race.reward_seconds) == ("as_filed", 5.0)
    assert (camera.width, camera.height, camera.light, camera.grass) == (40, 30, "car", False)
    boxes, bots, against = BoxesConfig(), BotsConfig(), AgainstConfig()
    assert (boxes.number, boxes.min_distance, boxes.random, boxes.as_cars) == (6, 2.0, True, False)
    assert (boxes.type, boxes.positions) == ("box_obstacle", "")
    assert (bots.number, bots.min_distance, bots.random, bots.speed, bots.penalty) == (3, 2.0, False, 0.2, 5.0)
    assert (bots.lane_change, bots.lane_change_after_low, bots.lane_change_after_high) == (False, 3.0, 5.0)
    assert bots.lane_change_distance == 1.0
    assert (against.cars, against.chosen_share, against.pool_share, against.pool_size) == (2, 0.5, 0.5, 8)
    assert (against.pool_every, against.slowest, against.start_ahead, MAX_CARS) == (10, 0.5, 1.5, 8)


@pytest.mark.parametrize(
    ("group", "name", "least", "most"),
    [
        (RaceConfig, "max_episode_seconds", 1.0, None), (RaceConfig, "start_offset", 0.0, 1.0),
        (RaceConfig, "start_advance", 0.0, 1.0), (RaceConfig, "reward_seconds", 0.01, None),
        (BoxesConfig, "number", 0, 100), (BoxesConfig, "min_distance", 0.0, None),
        (BotsConfig, "number", 0, 100), (BotsConfig, "min_distance", 0.0, None), (BotsConfig, "speed", 0.0, 6.0),
        (BotsConfig, "lane_change_after_low", 0.0, None), (BotsConfig, "lane_change_after_high", 0.0, None),
        (BotsConfig, "lane_change_distance", 0.1, None), (BotsConfig, "penalty", 0.0, None),
        (AgainstConfig, "cars", 2, 8), (AgainstConfig, "chosen_share", 0.0, 1.0),
        (AgainstConfig, "pool_share", 0.0, 1.0), (AgainstConfig, "pool_size", 1, 100),
        (AgainstConfig, "pool_every", 1, None), (AgainstConfig, "slowest", 0.1, 1.0),
        (AgainstConfig, "start_ahead", 0.0, 20.0),
        (CameraConfig, "width", 8, 640), (CameraConfig, "height", 6, 480),
    ],
)  # fmt: skip
def test_a_setting_may_be_at_either_end_of_its_range_and_not_beyond(group, name, least, most):
    step = 1 if isinstance(least, int) else 1e-3
    for legal, beyond in ((least, least - step), *([(most, most + step)] if most is not None else [])):
        assert getattr(group(**{name: legal}), name) == legal
        with pytest.raises(SettingError, match=name):
            group(**{name: beyond})


def test_places_that_cannot_be_read_are_refused_where_they_are_set():
    assert BoxesConfig(positions="0.5,1").positions == "0.5,1"
    with pytest.raises(SettingError, match="lies off the track"):
        BoxesConfig(positions="1.2,1")
