"""Rules of a race made definite: how long, from where, and how many abreast; numbers by hand."""

import numpy as np
import pytest

from racecraft.contract.errors import SettingError
from racecraft.worlds.deepracer.env.rules import first_starts, most_ticks, require_grid
from racecraft.worlds.deepracer.env.settings import RaceConfig
from racecraft.worlds.deepracer.tracks.catalogue import load_track
from racecraft.worlds.deepracer.tracks.track import Track


def straight(length):
    x = np.array([0.0, 1.0, length])
    return Track.from_rows("straight", np.column_stack([x, 0 * x, x, 0 * x + 0.5, x, 0 * x - 0.5]))


@pytest.mark.parametrize(
    ("config", "length", "laps", "ticks"),
    [
        ({}, 20.0, 3, 4500),  # 100 s a lap
        ({}, 60.0, 1, 2250),  # at 0.4 m/s it takes 150 s
        ({"max_episode_seconds": 4.0}, 60.0, 3, 180),
    ],
)
def test_an_episode_has_so_many_ticks(config, length, laps, ticks):
    assert most_ticks(RaceConfig(**config), length, laps) == ticks


def test_starts_are_spread_evenly_where_nobody_says():
    assert first_starts(load_track("Oval_track"), None, 4).tolist() == [0.0, 0.25, 0.5, 0.75]
    assert first_starts(load_track("Oval_track"), [0.3, 0.1], 2).tolist() == [0.3, 0.1]


def test_a_grid_may_be_just_as_long_as_the_lap():
    require_grid(straight(3.0), 4)
    with pytest.raises(SettingError, match="expected at most 3 cars"):
        require_grid(straight(2.99), 4)
