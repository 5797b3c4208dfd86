"""Drives for every test of the room, under the name `reports_along`."""

import numpy as np
import pytest

from racecraft.worlds.deepracer.env import race
from racecraft.worlds.deepracer.env.vehicle import FRONT_POINT_M, TICK_SECONDS
from racecraft.worlds.deepracer.tracks.catalogue import load_track


@pytest.fixture(scope="session")
def track():
    """The circuit on which the made-up drives take place."""
    return load_track("reinvent_base")


@pytest.fixture(scope="session")
def reports_along(track):
    """A maker of TICK_REPORT (T,): a car that covers a share of the lap on the centre line."""

    def make(ticks, ending=race.LAP_COMPLETE, share=1.0):
        """Return TICK_REPORT (T,) of a car that covers a share of the lap on the centre line."""
        arc = np.linspace(0.0, share * track.length, ticks)
        wrapped = np.minimum(arc, track.length - 1e-6)
        x, y = (np.interp(wrapped, track.arc, track.centre[:, k]) for k in (0, 1))
        yaw = np.unwrap(np.arctan2(np.gradient(y), np.gradient(x)))
        reports = np.zeros(ticks, race.TICK_REPORT)
        reports["front_x"], reports["front_y"], reports["yaw"] = x, y, yaw
        reports["x"], reports["y"] = x - FRONT_POINT_M * np.cos(yaw), y - FRONT_POINT_M * np.sin(yaw)
        reports["steps"] = np.arange(1, ticks + 1)
        reports["lap_seconds"] = np.arange(1, ticks + 1) * TICK_SECONDS
        reports["progress"] = 100.0 * share * arc / arc[-1]
        reports["speed"] = np.where(np.arange(ticks) % 8 < 4, 1.0, 2.0)
        reports["driven_speed"] = 1.5 + 0.5 * np.sin(np.arange(ticks) / 5)
        reports["steering"] = np.radians(15.0) * np.sign(np.sin(np.arange(ticks) / 9))
        reports["status"][0] = race.PREPARE
        reports["status"][1:] = race.IN_PROGRESS
        reports["status"][-1] = ending
        reports["terminated"][-1] = ending != race.IN_PROGRESS
        return reports

    return make
