"""Plans of boxes and bots by hand, on a lap of 20 m: where they go, and how many still fit."""

import numpy as np
import pytest

from racecraft.contract.errors import SettingError
from racecraft.worlds.deepracer.env.fidelity import habits
from racecraft.worlds.deepracer.env.objects import BOT_CAR
from racecraft.worlds.deepracer.env.placing import plan_objects
from racecraft.worlds.deepracer.env.settings import BotsConfig, BoxesConfig
from racecraft.worlds.deepracer.tracks.track import Track

SANE, AWS = habits("sane"), habits("aws")


def square(side=5.0):
    """A road 1 m wide round a square whose centre line has sides of so many metres, counter-clockwise."""
    corners = np.array([(0, -1), (1, -1), (1, 1), (-1, 1), (-1, -1), (0, -1)]) / 2
    return Track.from_rows("square", np.hstack([corners * (side + wider) for wider in (0.0, -1.0, 1.0)]))


def test_boxes_may_be_cars_that_stand():
    plan = plan_objects(square(), BoxesConfig(number=1, as_cars=True), SANE)
    assert plan.kinds.tolist() == [BOT_CAR]
    assert plan.sizes[0] == pytest.approx([0.16176, 0.09805, 0.195])
    assert plan.knots.size == 0, "they do not drive"


@pytest.mark.parametrize(("asked", "slips"), [(BoxesConfig(number=2), True), (BotsConfig(number=2), False)])
def test_the_distance_of_boxes_slips_at_aws_and_that_of_bots_does_not(asked, slips):
    assert plan_objects(square(), asked, AWS).slips == slips
    assert not plan_objects(square(), asked, SANE).slips


@pytest.mark.parametrize(
    ("asked", "cars", "fitting"),
    [
        # Fixed: from 2 m to 19 m in steps of 2 m; and where they may touch, of a box's own length, 0.4 m.
        ({"random": False, "min_distance": 2.0}, 1, 9),
        ({"random": False, "min_distance": 0.1}, 1, 48),
        ({"random": False, "min_distance": 19.1}, 1, 0),
        # Random: 1.5 m before a start and 1.1 m behind it, for every car, stay clear.
        ({"random": True, "min_distance": 2.175}, 1, 9),
        ({"random": True, "min_distance": 2.0}, 4, 8),
    ],
)
def test_as_many_fit_as_the_lap_has_room_for(asked, cars, fitting):
    if fitting:
        assert len(plan_objects(square(), BoxesConfig(number=fitting, **asked), SANE, cars).kinds) == fitting
    with pytest.raises(SettingError, match=f"expected at most {fitting}[.]"):
        plan_objects(square(), BoxesConfig(number=fitting + 1, **asked), SANE, cars)


def test_none_always_fit_and_at_aws_any_number_of_random_boxes_does():
    assert len(plan_objects(square(), BoxesConfig(number=0, min_distance=50.0), SANE).kinds) == 0
    assert len(plan_objects(square(), BoxesConfig(number=100), AWS).kinds) == 100
    with pytest.raises(SettingError, match="boxes.number is 100"):
        plan_objects(square(), BoxesConfig(number=100, random=False), AWS)
    with pytest.raises(SettingError, match="bots.number is 100"):
        plan_objects(square(), BotsConfig(number=100, random=True), AWS)


def test_of_listed_places_the_two_are_named_that_overlap():
    with pytest.raises(SettingError, match=r"'0.5,1' and '0.515,1' overlap on square.*0.4 m long"):
        plan_objects(square(), BoxesConfig(positions="0.1,1; 0.5,1; 0.5,-1;; 0.515,1"), SANE)
    assert len(plan_objects(square(), BoxesConfig(positions="0.5,1;0.521,1;0.52,-1"), SANE).arcs) == 3
