"""Each kind of fault is found in a reward that has it, and not in its sound twin."""

import json

import pytest

from racecraft.contract.errors import RewardFileError
from racecraft.worlds.deepracer.driving.reward.check import check_reward
from racecraft.worlds.deepracer.driving.reward.situations import COUNT
from racecraft.worlds.deepracer.driving.reward.speed import LAPPING, SPEED
from racecraft.worlds.deepracer.files.reward_samples import read_sample

HEAD = "def reward_function(params):\n"
FAULTY = {
    "    return 1.0 / params['distance_from_center']": ("raises", "ZeroDivisionError"),
    "    if params['speed'] > 1:\n        return 1.0": ("raises", "None"),
    "    return float('nan')": ("raises", "nan"),
    "    return 0.1 if params['all_wheels_on_track'] else 1.0": ("sign", "wheel off the track"),
    "    return 5.0 - params['speed']": ("sign", "faster the command"),
    "    return params['steps'] / 100 + params['speed']": ("time", "later it comes"),
    "    return -1.0": ("trick", "leaving the road at once"),
    "    return abs(params['steering_angle'])": ("trick", "circling"),
    "    w, c = params['waypoints'], params['closest_waypoints']\n    import math\n"
    "    d = math.degrees(math.atan2(w[c[1]][1] - w[c[0]][1], w[c[1]][0] - w[c[0]][0]))\n"
    "    return params['speed'] if abs(d - params['heading']) < 10 else 0.1": ("heading", "near 180 degrees"),
    "    import math\n    return params['speed'] * (1 - math.cos(math.radians(params['heading'] - 90)))": (
        "heading", "across the road",
    ),
}  # fmt: skip


@pytest.fixture
def check(tmp_path):
    def checked(text, **options):
        path = tmp_path / "reward_function.py"
        path.write_text(text)
        return check_reward(path, **options)

    return checked


@pytest.mark.parametrize("body", [body for body in FAULTY if FAULTY[body][0] != "heading"])
def test_a_fault_is_named(check, body):
    kind, text = FAULTY[body]
    faults = [one for one in check(HEAD + body + "\n").findings if one.level == "fault"]
    assert any(one.kind == kind and text in one.text for one in faults), faults


def test_a_reward_that_pays_no_moment_has_no_range_and_leaves_sound_json(check):
    found = check(HEAD + "    return float(params['speeed'])\n")
    assert (found.lowest, found.highest) == (None, None)
    assert found.findings[0].hint == "There is no parameter 'speeed'. Did you mean 'speed'?"
    json.dumps(found.as_dictionary(), allow_nan=False)


def test_a_difference_of_headings_without_wrapping_is_named(check):
    body = next(body for body, (kind, text) in FAULTY.items() if "near 180" in text)
    assert "heading" in [one.kind for one in check(HEAD + body).findings]
    wrapped = body.replace("abs(d - params['heading'])", "abs((d - params['heading'] + 180) % 360 - 180)")
    assert wrapped != body
    assert check(HEAD + wrapped).faults == 0


def test_the_reward_of_the_racing_car_has_no_fault_and_is_called_on_200_moments(check):
    found = check(read_sample("metres_gained"), for_race=True)
    assert (found.faults, found.situations) == (0, COUNT)
    assert found.speed.rate_rank < -0.9
    assert not any(trick.pays_more for trick in found.tricks)


def test_slow_laps_that_earn_more_are_a_note_and_for_a_race_a_fault(check):
    text = read_sample("centre_line")
    assert check(text).faults == 0
    found = check(text, for_race=True)
    assert [one.kind for one in found.findings if one.level == "fault"] == ["speed"]
    assert found.speed.teaches == LAPPING
    assert check(read_sample("fast_on_road"), for_race=True).speed.teaches == SPEED


def test_lines_that_never_run_never_matter_or_are_drowned_are_noted(check):
    found = check(
        HEAD + "    reward = 7.0\n    reward = params['speed'] * 100\n    reward += 0.001 * params['track_width']\n"
        "    if params['is_reversed'] and params['speed'] > 4.9:\n        reward = 0.0\n    return reward\n"
    )
    kinds = {(one.kind, one.line) for one in found.findings}
    assert {("never runs", 6), ("drowned", 4), ("no effect", 5)} <= kinds
    assert found.faults == 0


def test_a_line_without_which_a_loop_never_ends_does_not_hold_up_the_check(check):
    text = (
        "    place, left = 0, 3\n    while left > 0:\n        left -= 1\n        place += 1\n    return place * 1.0\n"
    )
    assert check(HEAD + text).highest == 3.0


def test_a_file_that_cannot_be_loaded_is_an_error_not_a_finding(check):
    with pytest.raises(RewardFileError, match="valid Python"):
        check("def reward_function(params)\n    return 1.0\n")
