"""Which race of a car against its slower self is filmed."""

import numpy as np

from racecraft.worlds.deepracer.evaluation.head_to_head import DriverResult, RaceResult
from racecraft.worlds.deepracer.training.self_rating import most_passing


def test_the_race_with_most_overtakes_is_filmed_of_those_that_were_kept():
    races = tuple(
        (DriverResult("last", 1, overtakes=count), DriverResult("slower", 2, overtakes=9)) for count in (0, 2, 2, 5)
    )
    assert most_passing(RaceResult(("last", "slower"), races, (np.zeros(1),) * 3)) == 1
    assert most_passing(RaceResult(("last", "slower"), races, (np.zeros(1),) * 4)) == 3
