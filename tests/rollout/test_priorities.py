"""Weights of places by hand: what an error weighs, and what was given up stays out."""

import numpy as np
import pytest

from racecraft.rollout.priorities import Priorities


def test_an_error_weighs_its_size_and_a_little_to_a_power():
    """Of 0, a millionth of what an error of 1 weighs, so that it is drawn now and then."""
    plain, rooted = Priorities(4, 1.0), Priorities(4, 0.5)
    assert plain.weights_of(np.array([0.0, -1.0, 3.0])) == pytest.approx([1e-6, 1.000001, 3.000001], rel=1e-12)
    assert rooted.weights_of(np.array([0.0, -4.0], np.float32)) == pytest.approx([1e-3, np.sqrt(4.000001)], rel=1e-12)
    assert Priorities(4, 0.0).weights_of(np.array([0.0, 9.0])).tolist() == [1.0, 1.0]


def test_the_largest_weight_is_the_largest_that_was_ever_given():
    places, found = Priorities(5, 1.0), []
    for index, weights in (([1, 2], [0.5, 0.25]), ([3], [4.0]), ([3], [2.0]), ([], [])):
        places.set(np.array(index, np.int64), np.array(weights))
        found.append(places.largest)
    assert found == [1.0, 4.0, 4.0, 4.0]
    assert places.leaves.tolist() == [0.0, 0.5, 0.25, 2.0, 0.0]


def test_a_late_word_on_what_was_given_up_changes_nothing():
    places = Priorities(3, 1.0)
    places.set(np.array([0, 2]), 1e-9)
    places.set_errors(np.array([0, 1, 2]), np.array([1.0, 2.0, 3.0]))
    assert places.leaves == pytest.approx([1.000001, 0.0, 3.000001])
