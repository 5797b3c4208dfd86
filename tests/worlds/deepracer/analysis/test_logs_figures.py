"""What the figures of logs show: on made-up laps, on a circuit driven clockwise, for continuous actions too."""

import inspect
import re
from pathlib import Path

import numpy as np
import polars as pl
import pytest
from matplotlib.collections import LineCollection
from tests.worlds.deepracer.logs import makers

from racecraft.worlds.deepracer.analysis import logs as analysis
from racecraft.worlds.deepracer.analysis.logs.fitting import fit
from racecraft.worlds.deepracer.logs import read
from racecraft.worlds.deepracer.tracks.catalogue import load_track


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


# --- charts ----------------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def laps(tmp_path_factory):
    """Five full laps and two that end at 30 %."""
    full = [makers.episode(k, 1.0, 46 + 5 * k, 10.0 + 20 * k, "lap_complete") for k in range(5)]
    columns = makers.joined(*full, *(makers.episode(5 + k, 0.3, start_s=200.0 + 20 * k) for k in range(2)))
    return ticks_of(tmp_path_factory.mktemp("laps"), columns)


def test_full_laps_are_not_set_beside_their_progress_which_is_the_same_for_all(laps):
    for complete in (False, True):
        axes = analysis.scatter_of_laps(laps, complete).figure.axes
        told = [one.get_xlabel() + one.get_ylabel() for one in axes]
        assert any("progress (%)" in words for words in told) is not complete
    percent = next(one for one in analysis.scatter_of_laps(laps).figure.axes if one.get_ylabel() == "progress (%)")
    assert percent.collections[0].get_offsets()[:, 1].max() == pytest.approx(100.0)


def test_a_training_without_a_full_lap_says_so(laps):
    short = laps.filter(pl.col("unique_episode") >= 5)
    words = [[text.get_text() for text in one.texts] for one in analysis.training_progress(short).figure.axes]
    assert [told for told in words if told] == [["no full lap yet"]]
    assert not any(one.texts for one in analysis.training_progress(laps).figure.axes)


def test_what_goes_with_a_slow_lap_is_told_in_words_and_degrees(laps):
    plot = analysis.lap_correlations(laps)
    told = " ".join(one.get_title(loc="left") + one.get_xlabel() for one in plot.figure.axes)
    assert "_" not in told
    assert "Steps: +1.00" in told


def test_sectors_that_are_segments_carry_their_names_and_are_drawn_in_their_order(laps):
    plot = analysis.sector_times(laps, load_track("reinvent_base"))
    segment, *others = analysis.find_segments(load_track("reinvent_base")).all
    words = [label.get_text() for label in plot.figure.axes[0].get_yticklabels()]
    assert words == [segment.name, *(one.name for one in others)]
    first = plot.data.filter((pl.col("unique_episode") == 0) & (pl.col("sector") == segment.name))["seconds"][0]
    assert first == pytest.approx(3.0 * ((segment.end - segment.begin) % 1.0), abs=0.15), "at even speed, by its length"


def test_the_speed_of_waypoints_nobody_passed_is_left_open(laps):
    track = load_track("reinvent_base")
    plot = analysis.reward_per_waypoint(laps.filter(pl.col("unique_episode") == 5), track)
    shown = [patch.get_data().values for one in plot.figure.axes for patch in one.patches if hasattr(patch, "get_data")]
    passed = plot.data["waypoint"].to_numpy()
    assert len(shown) == 2
    for value in shown:
        assert np.flatnonzero(np.isfinite(value)).tolist() == passed.tolist()
        assert len(passed) < 0.4 * len(value)


# --- actions ---------------------------------------------------------------------------------------------------------


@pytest.fixture(scope="module")
def continuous(tmp_path_factory):
    """Three laps of A to Z Speedway, clockwise, with continuous actions of ±30° and 1 to 2 m/s."""
    track = load_track("reInvent2019_wide_cw")
    columns = makers.joined(*(makers.episode(k, 1.0, 200, 10.0 + 20 * k, track=track, continuous=True)
                              for k in range(3)))  # fmt: skip
    draw = np.random.default_rng(5)
    columns["steer"] = draw.uniform(-30.0, 30.0, len(columns["X"]))
    columns["throttle"] = draw.uniform(1.0, 2.0, len(columns["X"]))
    columns["steer"][5:7], columns["throttle"][5:7] = (-30.0, 30.0), (1.0, 2.0)
    return ticks_of(tmp_path_factory.mktemp("continuous"), columns)


def test_continuous_actions_are_called_by_the_middles_of_their_bins(continuous):
    names = list(analysis.action_names(continuous).values())
    assert names[:2] == ["0: ~26° right, 1.2 m/s", "1: ~26° right, 1.5 m/s"]
    assert names[10] == "10: ~ahead, 1.5 m/s"
    assert names[-1] == "20: ~26° left, 1.8 m/s"


def test_the_fan_of_actions_tells_left_from_right_in_words(continuous):
    axes = analysis.action_space(continuous).figure.axes[0]
    words = [axes.xaxis.get_major_formatter()(angle, 0) for angle in (0.3, 0.0, -0.3)]
    assert words == ["17° left", "ahead", "17° right"]


@pytest.mark.parametrize("name", ["Spain_track", "reInvent2019_wide_cw"])
def test_maps_of_cells_show_the_road_large_and_its_borders_above_the_cells(name, tmp_path):
    """A track's field may be many times as large as its road."""
    track = load_track(name)
    ticks = ticks_of(tmp_path, makers.episode(0, 1.0, 300, track=track))
    for plot in (analysis.reward_heat_map(ticks, track), analysis.action_heat_maps(ticks, track)):
        for axes in plot.figure.axes[:-1]:
            x0, x1 = axes.get_xlim()
            assert 0.7 < (track.bounds[2] - track.bounds[0]) / (x1 - x0) < 1.0
            over = [one for one in axes.lines if one.zorder > axes.images[0].zorder]
            assert {len(one.get_xdata()) for one in over} == {len(track.inner), len(track.outer)}


def test_maps_of_actions_spread_their_colours_over_what_is_there(laps):
    """Three actions in turn: none is the only one of a cell, but of one with a single tick."""
    last = (pl.col("unique_episode") == 6) & (pl.col("tick") == 12)
    far = laps.with_columns(x_m=pl.col("x_m") + pl.when(last).then(1.5).otherwise(0.0))
    plot = analysis.action_heat_maps(far, load_track("reinvent_base"), cell_m=0.6)
    assert plot.data["share"].max() == 1.0, "a cell of one tick is among the data"
    images = [axes.images[0] for axes in plot.figure.axes[:-1]]
    assert len(images) == 3
    assert all(image.get_clim()[0] == 0.0 for image in images)
    assert 0.4 < images[0].get_clim()[1] < 0.9
    assert max(np.nanmax(image.get_array()) for image in images) < 1.0, "but tells nothing, and is not drawn"


def test_a_car_that_weaves_along_a_straight_drives_a_straight_and_a_gentle_arc_stays_an_arc():
    along = np.linspace(0.0, 4.0, 50)
    radius, heading, stray = fit(np.column_stack([along, 0.08 * np.sin(3.0 * along)]))
    assert radius is None
    assert heading == pytest.approx(0.0, abs=0.05)
    assert stray == pytest.approx(0.08 / np.sqrt(2), rel=0.1)
    angle = np.linspace(0.0, 0.4, 20)
    noise = np.random.default_rng(3).normal(0.0, 0.005, 20)
    radius, heading, stray = fit(np.column_stack([(5.0 + noise) * np.sin(angle), 5.0 - (5.0 + noise) * np.cos(angle)]))
    assert radius == pytest.approx(5.0, rel=0.15)
    assert heading is None
    assert stray < 0.008


# --- the table of the docs page --------------------------------------------------------------------------------------


def test_the_docs_list_every_plot_and_nothing_that_is_not_there():
    text = (Path(__file__).parents[4] / "docs/racing/logs.md").read_text(encoding="utf-8")
    table = text.split("| racers call it | function |")[1].split("\n\n")[0]
    cells = " ".join(line.split("|")[2] for line in table.splitlines()[2:])
    named = {name.split("(")[0] for name in re.findall(r"`([^`]+)`", cells)} - {"logs.metrics"}
    drawn = {name for name in analysis.__all__ if inspect.isfunction(getattr(analysis, name))
             and inspect.signature(getattr(analysis, name)).return_annotation == "Plot"}  # fmt: skip
    assert len(drawn) > 30
    assert drawn - named == set()
    assert named - set(analysis.__all__) == set()
