"""The moments that a reward is tried at: what each is called is what its numbers say, on a road that is round."""

import math

import pytest

from racecraft.worlds.deepracer.files.reward_examples import default_reward_source, example_situations

MOMENTS = {  # progress (%), steps, speed (m/s), steering (degrees), distance from the centre line (m), wheels on, off
    "at the start": (0.4, 2, 1, 0, 0.1, True, False),
    "on the way": (35, 80, 2, -15, 0.1, True, False),
    "near the border": (50, 120, 1, 0, 0.45, False, False),
    "off the track": (60, 150, 1, 0, 0.7, False, True),
    "an object ahead": (70, 180, 1, 0, 0.1, True, False),
    "lap complete": (100, 250, 1, 0, 0.1, True, False),
}
"""A first call sees steps of 2, as at AWS; a road 1 m wide is left beyond 0.5 m."""
KEYS = ("progress", "steps", "speed", "steering_angle", "distance_from_center", "all_wheels_on_track", "is_offtrack")


def test_each_moment_is_what_it_is_called():
    moments = example_situations()
    assert {name: tuple(one[key] for key in KEYS) for name, one in moments.items()} == MOMENTS
    assert list(moments) == list(MOMENTS)


@pytest.mark.parametrize("name", MOMENTS)
def test_every_moment_is_on_a_round_road_driven_to_the_left(name):
    moment = example_situations()[name]
    points = moment["waypoints"]
    assert (len(points), points[0]) == (41, points[-1])
    assert points[0] == pytest.approx((0, -4))
    assert points[10] == pytest.approx((4, 0))
    assert {round(math.hypot(*point), 9) for point in points} == {4}
    assert moment["track_length"] == pytest.approx(2 * math.pi * 4, abs=0.05)
    assert (moment["x"], moment["y"]) == (0, -4 - moment["distance_from_center"]), "right of the line, eastwards"
    assert (moment["heading"], moment["is_left_of_center"], moment["track_width"]) == (0, False, 1)
    assert (moment["closest_waypoints"], moment["projection_distance"]) == ([0, 1], 0)
    assert (moment["is_reversed"], moment["is_crashed"]) == (False, False)
    assert moment["sim_time"] == pytest.approx(moment["steps"] / 15), "15 steps a second"


def test_only_one_moment_has_an_object_which_stands_on_the_road():
    moments = example_situations()
    lists = [key for key in moments["at the start"] if key.startswith("objects_")]
    for name, moment in moments.items():
        has_one = name == "an object ahead"
        assert (moment["object_in_camera"], moment["closest_objects"]) == (has_one, [0, 0])
        assert {len(moment[key]) for key in lists} == {int(has_one)}
    one = {key: value for key, (value,) in ((key, moments["an object ahead"][key]) for key in lists)}
    assert one["objects_location"] == [0, 4]
    assert (one["objects_speed"], one["objects_heading"], one["objects_left_of_center"]) == (0, 0, True)
    assert 0 < one["objects_distance"] < 25
    assert 0 <= one["objects_distance_from_center"] <= 0.5


def test_a_first_reward_fits_the_race():
    alone, objects, cars = default_reward_source(), default_reward_source(True), default_reward_source(True, True)
    assert (default_reward_source(has_rivals=True), default_reward_source(False, False)) == (cars, alone)
    assert len({alone, objects, cars}) == 3
    assert "objects_" not in alone
    assert "nearest object" in objects
    assert "nearest car" in cars
