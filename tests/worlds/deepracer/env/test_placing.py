"""Plans of boxes and bots by hand, on a lap of 20 m: where they go, and how many still fit."""

import numpy as np
import pytest

from racecraft.contract.errors import SettingError
from racecraft.worlds.deepracer.env.fidelity import habits
from racecraft.worlds.deepracer.env.objects import AMAZON_BOX, BOT_CAR, BOX
from racecraft.worlds.deepracer.env.placing import plan_objects
from racecraft.worlds.deepracer.env.settings import BotsConfig, BoxesConfig
from racecraft.worlds.deepracer.tracks.track import Track

SANE, AWS = habits("sane"), habits("aws")


def square(side=5.0):
    """A road 1 m wide round a square whose centre line has sides of so many metres, counter-clockwise."""
    corners = np.array([(0, -1), (1, -1), (1, 1), (-1, 1), (-1, -1), (0, -1)]) / 2
    return Track.from_rows("square", np.hstack([corners * (side + wider) for wider in (0.0, -1.0, 1.0)]))


def test_an_empty_road_has_no_objects_but_the_habits_by_which_cars_meet():
    sane, aws = plan_objects(square(), None, SANE), plan_objects(square(), None, AWS)
    assert (sane.corners_only, sane.blames_by_lap) == (False, False)
    assert (aws.corners_only, aws.blames_by_lap) == (True, True)
    for plan in (sane, aws):
        assert [plan.sizes.shape, plan.kinds.shape, plan.arcs.shape, plan.lanes.shape] == [(0, 3), (0,), (0,), (0,)]
        assert (plan.knots.shape, plan.cubics.shape) == ((0,), (2, 0, 2, 4))
        assert plan.kinds.dtype == np.int64
        assert not any((plan.speed, plan.is_random, plan.slips, plan.least_distance, plan.changes_lanes, plan.penalty))
        assert (plan.change_after_low, plan.change_after_high, plan.change_distance) == (0.0, 0.0, 1.0)


def test_fixed_boxes_are_spread_evenly_from_their_distance_to_a_metre_before_the_line_lane_by_lane():
    plan = plan_objects(
        square(), BoxesConfig(number=5, random=False, min_distance=3.0, type="amazon_box_obstacle"), SANE
    )
    assert plan.arcs == pytest.approx([3, 7, 11, 15, 19])
    assert plan.lanes.tolist() == [0.5, -0.5, 0.5, -0.5, 0.5], "inner, outer, inner …, of a lap to the left"
    assert plan.kinds.tolist() == [AMAZON_BOX] * 5
    assert plan.sizes == pytest.approx(np.array([[0.2, 0.15, 0.25]] * 5))
    assert (plan.is_random, plan.slips, plan.least_distance, plan.speed) == (False, False, 3.0, 0.0)
    assert plan.knots.size == 0
    other_way = plan_objects(square().reversed(), BoxesConfig(number=2, random=False), SANE)
    assert other_way.lanes.tolist() == [-0.5, 0.5]


def test_boxes_may_be_cars_that_stand():
    plan = plan_objects(square(), BoxesConfig(number=1, as_cars=True), SANE)
    assert plan.kinds.tolist() == [BOT_CAR]
    assert plan.sizes[0] == pytest.approx([0.16176, 0.09805, 0.195])
    assert plan.knots.size == 0, "they do not drive"


def test_listed_boxes_stand_where_they_are_listed_even_where_random_ones_are_asked():
    plan = plan_objects(square(), BoxesConfig(number=6, random=True, positions="0.25,-1;0.5,1;0.75,0"), AWS)
    assert plan.arcs == pytest.approx([5, 10, 15])
    assert plan.lanes.tolist() == [-0.5, 0.5, 0.5]
    assert plan.kinds.tolist() == [BOX] * 3
    assert not plan.is_random
    assert plan_objects(square(), BoxesConfig(number=6), AWS).is_random


@pytest.mark.parametrize(("asked", "slips"), [(BoxesConfig(number=2), True), (BotsConfig(number=2), False)])
def test_the_distance_of_boxes_slips_at_aws_and_that_of_bots_does_not(asked, slips):
    assert plan_objects(square(), asked, AWS).slips == slips
    assert not plan_objects(square(), asked, SANE).slips


def test_bots_drive_as_they_are_told():
    asked = BotsConfig(
        number=2, speed=0.7, lane_change=True, lane_change_after_low=2.5, lane_change_after_high=2.5,
        lane_change_distance=1.25, penalty=3.5, min_distance=4.0,
    )  # fmt: skip
    plan = plan_objects(square(), asked, SANE)
    assert plan.kinds.tolist() == [BOT_CAR] * 2
    assert plan.arcs == pytest.approx([4, 19])
    assert (plan.speed, plan.changes_lanes, plan.penalty) == (0.7, True, 3.5)
    assert (plan.change_after_low, plan.change_after_high, plan.change_distance) == (2.5, 2.5, 1.25)
    assert plan.knots == pytest.approx([0, 2.5, 7.5, 12.5, 17.5, 20])
    assert plan.cubics.shape == (2, 5, 2, 4)
    assert not plan.is_random
    with pytest.raises(SettingError, match="no longer than the most"):
        plan_objects(square(), BotsConfig(number=1, lane_change_after_low=2.6, lane_change_after_high=2.5), SANE)


@pytest.mark.parametrize(
    ("asked", "cars", "fitting"),
    [
        # Fixed: from 2 m to 19 m in steps of 2 m; and where they may touch, of a box's own length, 0.4 m.
        ({"random": False, "min_distance": 2.0}, 1, 9),
        ({"random": False, "min_distance": 0.1}, 1, 48),
        ({"random": False, "min_distance": 19.0}, 1, 1),
        ({"random": False, "min_distance": 19.1}, 1, 0),
        # Random: 1.5 m before a start and 1.1 m behind it, for every car, stay clear.
        ({"random": True, "min_distance": 2.175}, 1, 9),
        ({"random": True, "min_distance": 2.176}, 1, 8),
        ({"random": True, "min_distance": 2.0}, 4, 8),
        ({"random": True, "min_distance": 2.0}, 17, 0),
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
