"""Metrics without ticks, sequences of actions, fitted lines, a racer's own plots: by hand on made-up laps."""

import inspect
import math
import re
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import polars as pl
import pytest
from tests.reference import HAS_ALL, LARGE, TRACES
from tests.worlds.deepracer.logs import makers

from racecraft.analysis.custom_plots import CustomPlotError, made_or_why
from racecraft.analysis.page_part import own_plots_part
from racecraft.analysis.plot import PlotError
from racecraft.analysis.report import write_report
from racecraft.formats.run_folder import RunFolder
from racecraft.worlds.deepracer.analysis import logs as analysis
from racecraft.worlds.deepracer.analysis.logs.fitting import fit
from racecraft.worlds.deepracer.analysis.logs.page import Extras, write_logs_page
from racecraft.worlds.deepracer.analysis.run_advice import custom_plots_of
from racecraft.worlds.deepracer.logs import read
from racecraft.worlds.deepracer.logs.columns import METRIC_COLUMNS, schema
from racecraft.worlds.deepracer.tracks.catalogue import load_track


def metrics_of(*rows):
    """Return metrics of (round, phase, iteration, progress, seconds, reward)."""
    told = [
        {"round": r, "phase": phase, "stream": "", "worker": 0, "iteration": i, "episode": k, "trial": k + 1,
         "reward": reward, "start_s": 0.0, "seconds": seconds, "progress_share": share, "status": None, "resets": 0,
         "file": 0}
        for k, (r, phase, i, share, seconds, reward) in enumerate(rows)
    ]  # fmt: skip
    return pl.DataFrame(told, schema=schema(METRIC_COLUMNS))


METRICS = metrics_of(
    (1, "training", 0, 0.2, 2.0, 10.0), (1, "training", 0, 0.6, 6.0, 30.0), (1, "training", 0, 1.0, 12.0, 80.0),
    (1, "evaluation", 0, 0.5, 5.0, None), (1, "training", 1, 1.0, 10.0, 90.0), (1, "training", 1, 1.0, 14.0, 70.0),
    (2, "training", 0, 0.9, 9.0, 60.0),
)  # fmt: skip


def test_metrics_of_rounds_are_summed_up_iteration_by_iteration():
    table = analysis.metrics_summary(METRICS)
    assert table["round"].to_list() == [1, 1, 2]
    assert table["training_progress_share"].to_list() == pytest.approx([0.6, 1.0, 0.9])
    assert table["training_complete_share"].to_list() == pytest.approx([1 / 3, 1.0, 0.0])
    assert table["training_lap_seconds"].to_list() == [12.0, 12.0, None]
    assert table["training_best_lap_seconds"].to_list() == [12.0, 10.0, None]
    assert table["evaluation_progress_share"].to_list() == [0.5, None, None]
    assert analysis.metrics_summary(METRICS, "median")["training_reward"].to_list() == [30.0, 80.0, 60.0]
    assert analysis.metrics_summary(METRICS, "max")["training_seconds"].to_list() == [12.0, 14.0, 9.0]
    smooth = analysis.metrics_summary(METRICS, rolling=2)["training_progress_share"].to_list()
    assert smooth == pytest.approx([0.6, 0.8, 0.9])  # a round begins anew
    assert analysis.metrics_best_laps(METRICS)["seconds"].to_list() == [10.0, 12.0, 14.0]
    with pytest.raises(PlotError, match="'modus' is not known; expected one of mean"):
        analysis.metrics_summary(METRICS, "modus")


@pytest.mark.parametrize("make", [analysis.completion_progress, analysis.lap_time_progress, analysis.lap_scatter])
def test_charts_of_metrics_are_drawn(make, tmp_path):
    assert make(METRICS).save(tmp_path / "a.png").stat().st_size > 3000


@pytest.mark.parametrize("make", [analysis.completion_progress, analysis.metrics_best_laps])
def test_logs_without_metrics_are_told_which_file_is_missing(make):
    with pytest.raises(PlotError, match=r"no metrics of a training here; expected TrainingMetrics\.json"):
        make(METRICS.clear())


def test_real_metrics_agree_with_real_ticks():
    """AWS cuts progress to whole percent and counts the same episodes."""
    logs = read(TRACES / "drfc-1-worker")
    told = analysis.metrics_summary(logs.metrics)
    ticks = analysis.per_iteration(analysis.simulation_agg(logs.training))
    both = told.join(ticks, on=["round", "iteration"])
    assert both.height == ticks.height > 3
    away = (both["training_progress_share"] - both["progress_share"]).abs()
    assert away.max() < 0.011
    assert both["training_episodes"].to_list() == both["episodes"].to_list()


def test_sequences_of_actions_by_hand(tmp_path):
    """Actions 0 1 0 1 0 1 in one episode, 1 1 in another: 0 1 three times, 1 0 twice, 1 1 once."""
    first, second = makers.episode(0, 0.3, ticks=7), makers.episode(1, 0.3, ticks=3)
    first["action"], second["action"] = np.array([0, 0, 1, 0, 1, 0, 1]), np.array([1, 1, 1])
    ticks = read(makers.write(tmp_path / "0-iteration.csv", makers.joined(first, second))).ticks
    data = analysis.action_sequences(ticks, 2).data
    assert dict(data.select("sequence", "count").rows()) == {"0 1": 3, "1 0": 2, "1 1": 1}
    assert data["share"].to_list() == pytest.approx([3 / 6, 2 / 6, 1 / 6])
    assert data["mean_reward"].to_list() == [1.0, 1.0, 1.0]
    with pytest.raises(PlotError, match="No episode has 50 actions"):
        analysis.action_sequences(ticks, 50)


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_an_arc_is_fitted_by_its_radius_and_a_straight_by_its_heading(side):
    angle = np.linspace(0.2, 1.4, 12)
    arc = np.column_stack([5.0 + 2.0 * np.cos(angle), side * 2.0 * np.sin(angle)])
    radius, heading, stray = fit(arc)
    assert (radius, heading, stray) == (pytest.approx(2.0 * side), None, pytest.approx(0.0, abs=1e-9))
    straight = np.column_stack([np.linspace(0.0, -3.0, 9), side * np.linspace(0.0, 3.0, 9)])
    straight[::2, 0] += 0.01
    radius, heading, stray = fit(straight)
    assert radius is None
    assert heading == pytest.approx(side * 0.75 * math.pi, abs=0.02)
    assert 0.0 < stray < 0.01


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


@pytest.mark.parametrize("backwards", [False, True])
def test_a_lap_on_the_centre_line_turns_as_the_track_does(tmp_path, backwards):
    track = load_track("reinvent_base")
    track = track.reversed() if backwards else track
    columns = makers.episode(0, 1.0, ticks=240, status="lap_complete", track=track)
    ticks = read(makers.write(tmp_path / "0-iteration.csv", columns)).ticks
    plot = analysis.fitted_line(ticks, track)
    kinds = {segment.name: segment.kind for segment in analysis.find_segments(track).all}
    for number, radius in plot.data.drop_nulls("radius_m").select("segment", "radius_m").rows():
        if kinds[number] != "straight":
            assert (radius > 0) == (kinds[number] == "left")
    assert plot.save(tmp_path / "a.png").stat().st_size > 3000
    with pytest.raises(PlotError, match="no episode 7"):
        analysis.fitted_line(ticks, track, 7)


# --- a racer's own ----------------------------------------------------------------------------------------------------

OWN = '''
import polars as pl
from racecraft.worlds.deepracer.analysis.logs import simulation_agg

def plot_mean_speed(ticks, track):
    """Mean speed of each episode."""
    return simulation_agg(ticks).select("unique_episode", "speed_mps")

def plot_figure(ticks, track):
    from matplotlib.figure import Figure
    figure = Figure()
    figure.add_subplot().plot(ticks["x_m"], ticks["y_m"])
    return figure

def plot_broken(ticks, track):
    return 1 / 0

def helper():
    raise AssertionError("not a plot")
'''


@pytest.fixture
def laps(tmp_path):
    return read(makers.write(tmp_path / "0-iteration.csv", makers.iteration(range(3)))).ticks.collect()


def test_own_plots_stand_on_the_page_and_a_broken_one_says_where(tmp_path, laps, monkeypatch):
    monkeypatch.setattr("racecraft.worlds.deepracer.analysis.logs.page._section", lambda *section: iter(()))
    (tmp_path / "mine.py").write_text(OWN)
    own = analysis.own_plots([tmp_path / "mine.py"])
    assert [one.name for one in own] == ["plot_mean_speed", "plot_figure", "plot_broken"]
    assert own[0](laps, None).title == "Mean speed of each episode."
    assert own[0](laps, None).data.height == 3
    page = write_logs_page(tmp_path / "p.html", laps, load_track("reinvent_base"), "log", Extras(plots=own)).read_text()
    assert page.index("Your own") < page.index("Mean speed of each episode.") < page.index("mine.py:16: plot_broken")
    assert "ZeroDivisionError" in page


def documented():
    """The example on the page about logs, as it stands there."""
    page = Path(__file__).resolve().parents[4] / "docs" / "racing" / "logs.md"
    return next(
        code for code in page.read_text(encoding="utf-8").split("```python\n")[1:] if "def plot_" in code
    ).split("```")[0]


def test_the_documented_plot_comes_from_a_file_a_folder_and_a_package_that_is_installed(tmp_path, laps, monkeypatch):
    """The package is one of a real installation: a module and its entry points on the path."""
    (tmp_path / "folder").mkdir()
    (tmp_path / "folder" / "mine.py").write_text(documented())
    site, about = tmp_path / "site", tmp_path / "site" / "their_plots-1.0.dist-info"
    about.mkdir(parents=True)
    (site / "their_plots.py").write_text(documented())
    (about / "METADATA").write_text("Metadata-Version: 2.1\nName: their-plots\nVersion: 1.0\n")
    (about / "entry_points.txt").write_text("[racecraft.plots]\nspeed = their_plots:plot_mean_speed\n")
    monkeypatch.syspath_prepend(site)
    in_file, in_folder = (tmp_path / "folder" / "mine.py"), tmp_path / "folder"
    found = analysis.own_plots([in_file, in_folder])
    assert [one.origin for one in found[:2]] == [str(in_file)] * 2
    (installed,) = [one for one in found if "their_plots" in one.origin]
    for one in (*found[:2], installed):
        made = one(laps, None)
        assert made.title == "Mean speed of each episode."
        assert made.data.columns == ["unique_episode", "speed_mps"]
        assert made.data.height == 3


LATE = """
from racecraft.worlds.deepracer.analysis.logs import Plot

def plot_late(ticks, track):
    return Plot("late", "Late", ticks, lambda: 1 / 0)

def plot_quit(ticks, track):
    raise SystemExit(0)

def plot_none(ticks, track):
    pass

def plot_steps(ticks, track):
    return ticks.select("tick")
"""


def test_a_plot_that_fails_takes_nothing_with_it(tmp_path, laps):
    """One that fails when it is drawn, one that would end the program, one that gives nothing; one that works."""
    (tmp_path / "mine.py").write_text(LATE)
    *none, steps = made_or_why(analysis.own_plots([tmp_path / "mine.py"]), laps, None)
    assert [one.title for one in none] == ["plot_late", "plot_quit", "plot_none"]
    assert "mine.py:5: plot_late failed (ZeroDivisionError" in none[0].why
    assert "mine.py:8: plot_quit failed (SystemExit" in none[1].why
    assert none[0].why.endswith("leave it out of --plots.")
    assert "plot_none gave NoneType; expected a Plot" in none[2].why
    assert steps.data.columns == ["tick"]


def test_a_broken_plot_of_a_package_leaves_the_report_standing(tmp_path, monkeypatch):
    def broken(ticks, track):
        raise ValueError("no such <thing>")

    entry = SimpleNamespace(name="speed", value="their_package:speed", group="racecraft.plots", load=lambda: broken)
    monkeypatch.setattr("racecraft.contract.extensions.entry_points", lambda group: [entry])
    run = RunFolder.create(tmp_path / "run", {"kind": "gymnasium", "title": "x", "settings": {}})
    run.append_metrics({"iteration": 1, "steps": 9, "seconds": 1.0})
    makers.write(run.path / "training-simtrace" / "0-iteration.csv", makers.iteration(range(3)))
    parts = list(own_plots_part(custom_plots_of(run, ())))
    text = write_report(run, tmp_path / "r.html", of_world=lambda facts: parts).read_text(encoding="utf-8")
    assert "speed failed (ValueError: no such &lt;thing&gt;)" in text
    assert "Mend it, or remove its package." in text


@pytest.mark.parametrize(
    ("text", "said"),
    [("x = 1", "holds no plot"), ("def plot_a(:", "own.py:1: cannot be imported"), (None, "is not there")],
)
def test_a_file_without_plots_is_refused(tmp_path, text, said):
    if text is not None:
        (tmp_path / "own.py").write_text(text)
    with pytest.raises(CustomPlotError, match=said):
        analysis.own_plots([tmp_path / "own.py"])


@pytest.mark.skipif(not HAS_ALL, reason=LARGE)
def test_waypoints_are_counted_as_the_log_counts_them():
    """Row 18 of this route file repeats row 17: AWS counts it, and so do the plots."""
    ticks = read(TRACES / "droa-2026-discrete").training.collect()
    track = analysis.find_track(ticks)
    assert (track.name, len(track.centre)) == ("Spain_track", len(load_track("Spain_track").centre) + 1)
    recorded = ticks["closest_waypoint"].to_numpy()
    assert (analysis.on_track(ticks, track)["waypoint"].to_numpy() == recorded).mean() > 0.99
    each_place_once = analysis.on_track(ticks, load_track("Spain_track"))["waypoint"].to_numpy()
    assert (each_place_once == recorded).mean() < 0.9
    once = ticks.with_columns(closest_waypoint=pl.Series(each_place_once))
    assert len(analysis.find_track(once).centre) == len(load_track("Spain_track").centre)


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
