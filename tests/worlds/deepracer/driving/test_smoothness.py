"""How calmly a car steers."""

import math

import numpy as np
import pytest

from racecraft.worlds.deepracer.driving.smoothness import smoothness_of
from racecraft.worlds.deepracer.env import race


def drive(degrees, status=race.IN_PROGRESS, episode=0):
    reports = np.zeros(len(degrees), race.TICK_REPORT)
    reports["steering"], reports["status"], reports["episode"] = np.radians(degrees), status, episode
    reports["steps"] = np.arange(1, len(degrees) + 1)
    return reports


def test_changes_are_counted_by_the_second_and_turns_by_the_tick():
    """30 + 30 + 60 + 0 + 30 degrees in 5 ticks of 1/15 s; from left by straight on to right is one turn."""
    calm = smoothness_of(drive([0, 30, 0, -60, -60, -30]))
    assert calm.change_rad_per_second == pytest.approx(math.radians(150) * 15 / 5)
    assert calm.turns_share == pytest.approx(1 / 5)


def test_small_corrections_are_no_turns_but_a_table_of_five_degrees_has_sides():
    assert smoothness_of(drive([10, -3, 3, -3, 10])).turns_share == 0.0
    assert smoothness_of(drive([5, 0, -5, 0, 5])).turns_share == pytest.approx(2 / 4)


def test_nothing_is_compared_across_episodes_or_while_the_car_is_held():
    first, second = drive([30, 30, 30]), drive([-30, -30, -30], episode=1)
    second["status"][0] = race.PREPARE
    calm = smoothness_of(np.concatenate([first, second]))
    assert calm.change_rad_per_second == 0.0
    assert smoothness_of(first[:1]) is None
