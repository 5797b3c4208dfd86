"""Which failures lie at one place: within a metre of the next, and in no more than three metres."""

import numpy as np
import pytest

from racecraft.worlds.deepracer.evaluation.failure_clusters import cluster_failures


@pytest.mark.parametrize(
    ("arcs", "places"),
    [
        ([2.0, 1.0, 0.0, 3.01], [[2, 1, 0], [3]]),  # a metre apart is one place, a centimetre more is not
        ([0.0, 1.0, 2.0, 3.0], [[0, 1, 2, 3]]),  # three metres long
        ([0.0, 0.75, 1.75, 2.5, 3.25], [[2, 3, 4], [0, 1]]),  # longer: parted at its widest gap
        ([5.0, 5.0, 1.0], [[0, 1], [2]]),  # the place with most first
        ([7.0, 1.0, 4.0], [[1], [2], [0]]),  # of equals in driving order, from behind the widest gap
        ([19.8, 0.3, 10.0], [[0, 1], [2]]),  # a loop of 20 m: across its start line
        ([3.0], [[0]]),
    ],
)
def test_failures_are_parted_by_hand(arcs, places):
    assert [place.tolist() for place in cluster_failures(np.array(arcs), 20.0)] == places


def test_on_an_open_track_nothing_lies_across_the_start_line():
    assert [place.tolist() for place in cluster_failures(np.array([19.8, 0.3]), 20.0, closed=False)] == [[1], [0]]
    assert cluster_failures(np.zeros(0), 20.0) == []
