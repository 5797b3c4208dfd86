"""Charts as data: gaps are gaps, the table holds the same figures and says what it leaves out."""

import numpy as np

from racecraft.pages.chart import MAX_ROWS, Chart, Series


def test_what_is_no_number_is_a_gap_in_plot_and_table():
    shown = Chart("t", "lap", "s", [Series("a", np.array([1, 2]), np.array([10.5, np.nan]))]).shown()
    assert shown["plot"]["series"][0]["y"] == [10.5, None]
    assert shown["table"]["rows"] == [["1", "10.50"], ["2", "–"]]


def test_series_with_x_of_their_own_share_the_table():
    chart = Chart("t", "lap", "s", [Series("a", [1, 3], [1.0, 3.0]), Series("b", [2, 3], [2.0, 4.0])], digits=0)
    assert chart.shown()["table"]["rows"] == [["1", "1", "–"], ["2", "–", "2"], ["3", "3", "4"]]


def test_a_long_table_keeps_every_so_many_rows_and_says_so():
    many = 10 * MAX_ROWS + 1
    table = Chart("t", "step", "x", [Series("a", range(many), range(many))]).shown()["table"]
    assert len(table["rows"]) <= MAX_ROWS + 1
    assert table["every"] == 11


def test_several_values_at_one_place_are_a_row_each():
    chart = Chart("t", "epochs", "score", [Series("a", [3, 5, 3], [1.0, 2.0, 4.0], "dots")], digits=0)
    assert chart.shown()["table"]["rows"] == [["3", "1"], ["3", "4"], ["5", "2"]]
