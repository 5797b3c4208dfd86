"""Figures as charts: what is drawn is taken over, what cannot be stays a picture."""

import numpy as np
import pytest
from matplotlib.figure import Figure

from racecraft.analysis.interactive import charts_of


def one(draw):
    axes = Figure().add_subplot()
    draw(axes)
    found = charts_of(axes.figure, "what it shows")
    return None if found is None else found[0]


def test_lines_points_bands_and_levels_come_over_with_their_names():
    def draw(axes):
        axes.plot([0, 1, 2], [3, np.nan, 5], label="a")
        axes.plot([0, 1], [1, 2], "--", label="b")
        axes.scatter([5, 6], [7, 8], label="c")
        axes.fill_between([0, 1, 2], [1, 1, 1], [2, 3, 4], label="band")
        axes.axhline(9.5, label="best")
        axes.axvline(1.5, label="here")
        axes.set(xlabel="lap", ylabel="s", yscale="log")

    chart = one(draw)
    assert [(one.name, one.look) for one in chart.series] == [("a", "line"), ("b", "dashed"), ("c", "dots")]
    np.testing.assert_array_equal(chart.series[0].y, [3, np.nan, 5])
    assert [(band.name, list(band.low), list(band.high)) for band in chart.bands] == [("band", [1, 1, 1], [2, 3, 4])]
    assert (chart.levels[0].y, chart.levels[0].text, chart.marks[0].x) == (9.5, "best", 1.5)
    assert (chart.x, chart.y, chart.log) == ("lap", "s", True)


@pytest.mark.parametrize("lie", [False, True])
def test_bars_stand_on_zero_and_keep_their_names(lie):
    chart = one(lambda axes: (axes.barh if lie else axes.bar)(["left", "right"], [30, 70]))
    assert (chart.series[0].look, list(chart.series[0].y), chart.low) == ("bars", [30, 70], 0.0)
    assert list(chart.names) == ["left", "right"]
    assert [row[0] for row in chart.shown()["table"]["rows"]] == ["left", "right"]


def test_a_second_axis_stands_on_the_right():
    def draw(axes):
        axes.plot([0, 1], [1, 2], label="a")
        other = axes.twinx()
        other.plot([0, 1], [100, 200], label="b")
        other.set_ylabel("reward")

    chart = one(draw)
    assert ([one.right for one in chart.series], chart.right) == ([False, True], "reward")


@pytest.mark.parametrize(
    "draw",
    [
        lambda axes: axes.imshow(np.zeros((2, 2))),
        lambda axes: (axes.plot([0, 1]), axes.set_aspect("equal")),
        lambda axes: (axes.plot([0, 1]), axes.text(0, 0, "only a picture says this")),
        lambda axes: (axes.barh([0, 1], [1, 2]), axes.scatter([1], [1])),
        lambda axes: axes.pie([1, 2]),
        lambda axes: None,
    ],
    ids=["picture", "map", "words", "points on lying bars", "pie", "nothing"],
)
def test_what_no_chart_of_ours_draws_stays_a_picture(draw):
    assert one(draw) is None
