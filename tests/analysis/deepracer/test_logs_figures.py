"""What the figures of logs show: on made-up laps, on a circuit driven clockwise, for continuous actions too."""

import numpy as np
import pytest
from matplotlib.collections import LineCollection
from tests.logs import makers

from racecraft.analysis.deepracer import logs as analysis
from racecraft.logs import read
from racecraft.tracks.catalogue import load_track


def ticks_of(folder, columns):
    return read(makers.write(folder / "training-simtrace" / "0-iteration.csv", columns)).ticks.collect()


def pieces(plot):
    """Return how many pieces of path each map of a plot shows."""
    return [
        sum(len(one.get_segments()) for one in axes.collections if isinstance(one, LineCollection))
        for axes in plot.figure.axes
        if axes.get_aspect() == 1.0
    ]


# --- a car that is set down ------------------------------------------------------------------------------------------


@pytest.fixture
def set_down(tmp_path):
    """An episode whose first tick lies three metres off, where the last one ended; and a hop back in its third."""
    columns = makers.episode(0, 0.3, ticks=40)
    columns["X"][0] += 3.0
    columns["X"][2], columns["Y"][2] = columns["X"][1] - 0.03, columns["Y"][1]
    return ticks_of(tmp_path, columns)


def test_the_way_to_where_a_car_was_set_down_is_no_driven_speed_and_no_slide(set_down):
    told = analysis.with_motion(set_down)
    assert told["driven_mps"].is_null().to_list() == [True, True] + [False] * 38
    assert told["driven_mps"].max() < 5.0
    assert told["slide_rad"].is_null().to_list() == [True] * 3 + [False] * 37
    assert np.degrees(told["slide_rad"].abs().max()) < 20.0, "it hopped backwards only while it was put down"


def test_paths_are_broken_where_a_car_was_set_down(set_down):
    plot = analysis.one_episode(set_down, load_track("reinvent_base"), 0)
    assert pieces(plot) == [38], "of 39 steps one was not driven"
