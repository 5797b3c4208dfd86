"""Who leads a race, as its film tells."""

import numpy as np

from racecraft.worlds.deepracer.analysis.race_film import places_in
from racecraft.worlds.deepracer.env import race


def ticks_of(rows):
    """Return TICK_REPORT (T, M) of (status, laps, progress in per cent) per tick and car."""
    ticks = np.zeros((len(rows), len(rows[0])), race.TICK_REPORT)
    for tick, row in enumerate(rows):
        for car, (status, laps, progress) in enumerate(row):
            ticks[tick, car]["status"], ticks[tick, car]["laps"] = status, laps
            ticks[tick, car]["progress"] = progress
    return ticks


GOES, DONE, PARK, OFF = race.IN_PROGRESS, race.LAP_COMPLETE, race.PARK, race.OFF_TRACK


def test_places_are_told_by_how_far_each_has_driven_of_its_own_laps():
    told = ticks_of(
        [
            [(GOES, 0, 0.0), (GOES, 0, 0.0), (GOES, 0, -1.0)],  # behind its start is no less than at it
            [(GOES, 0, 40.0), (GOES, 0, 90.0), (GOES, 0, 50.0)],
            [(GOES, 1, 10.0), (GOES, 0, 95.0), (OFF, 0, 70.0)],  # the second lap comes before the first
            [(DONE, 2, 100.0), (GOES, 1, 99.0), (PARK, 0, 0.0)],  # retired: as far as it came
            [(PARK, 0, 0.0), (DONE, 2, 100.0), (PARK, 0, 0.0)],  # finished later, and as far
            [(PARK, 0, 0.0), (PARK, 0, 0.0), (PARK, 0, 0.0)],
        ]
    )
    assert places_in(told).tolist() == [[1, 1, 1], [3, 1, 2], [1, 2, 3], [1, 2, 3], [1, 2, 3], [1, 2, 3]]
