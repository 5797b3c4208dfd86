"""Tables and plots of logs: by hand on made-up laps, by twin with deepracer-utils, on any track and action."""

import itertools
import re

import numpy as np
import polars as pl
import pytest
from matplotlib.collections import LineCollection
from tests.reference import HAS_ALL, LARGE, TRACES
from tests.worlds.deepracer.logs import makers

from racecraft.contract.errors import TrackError
from racecraft.worlds.deepracer.analysis import logs as analysis
from racecraft.worlds.deepracer.analysis.logs import PlotError
from racecraft.worlds.deepracer.analysis.logs.advice import advice
from racecraft.worlds.deepracer.analysis.logs.judged import Evaluations, judged_in_log
from racecraft.worlds.deepracer.driving.telemetry.corners import find_corners
from racecraft.worlds.deepracer.logs import read
from racecraft.worlds.deepracer.tracks.catalogue import load_track, names


def logs_of(tmp_path, columns):
    return read(makers.write(tmp_path / "training-simtrace" / "0-iteration.csv", columns)).ticks


@pytest.fixture
def laps(tmp_path):
    """Four episodes on re:Invent 2018: two full laps of 3.0 and 4.0 s, two that leave the road at 30 %."""
    full = [makers.episode(k, 1.0, ticks=46 + 15 * k, status="lap_complete") for k in range(2)]
    return logs_of(tmp_path, makers.joined(*full, makers.episode(2, 0.3), makers.episode(3, 0.3)))


# --- by hand ----------------------------------------------------------------------------------------------------------


def test_one_row_an_episode(laps):
    table = analysis.simulation_agg(laps)
    assert table["seconds"].to_list() == pytest.approx([3.0, 4.0, 11 / 15, 11 / 15])
    assert table["steps"].to_list() == [46, 61, 12, 12]
    assert table["reward"].to_list() == [45.0, 60.0, 11.0, 11.0]
    assert table["progress_share"].to_list() == pytest.approx([1.0, 1.0, 0.3, 0.3])
    assert table["complete"].to_list() == [True, True, False, False]
    assert table["seconds_if_complete"][2] == pytest.approx(11 / 15 / 0.3)
    assert table["quintile"].to_list() == ["1st", "2nd", "3rd", "4th"]
    assert table["distance_m"][0] == pytest.approx(load_track("reinvent_base").length, rel=0.02)


def test_what_a_reset_moves_the_car_is_not_driven(tmp_path):
    columns = makers.episode(0, 0.5, ticks=100)
    there = analysis.simulation_agg(logs_of(tmp_path / "a", columns))["distance_m"][0]
    for name in ("X", "Y"):
        columns[name][60:] = columns[name][20:60]  # off the road at tick 60, and set back by 40 ticks
    jump = np.hypot(columns["X"][60] - columns["X"][59], columns["Y"][60] - columns["Y"][59])
    assert jump > 2.0
    told = analysis.simulation_agg(logs_of(tmp_path / "b", columns))["distance_m"][0]
    assert told == pytest.approx(there * 98 / 99, rel=0.02)


def test_the_stability_of_steps_that_take_a_fifteenth_of_a_second(laps):
    row = analysis.stability(laps).data.row(0, named=True)
    assert (row["mean_ms"], row["max_ms"], row["steps"]) == (pytest.approx(1000 / 15), pytest.approx(1000 / 15), 127)
    assert row["steady"]
    late = laps.with_columns(time_s=pl.col("time_s") * 1.4)
    assert not analysis.stability(late).data["steady"][0]


def test_the_discount_tester_by_hand(tmp_path):
    ticks = logs_of(tmp_path, makers.episode(0, 0.3, ticks=4))
    data = analysis.discount_tester(ticks, [0.5]).data
    assert data["reward"].to_list() == [0.0, 1.0, 1.0, 1.0]
    assert data["value"].to_list() == [0.875, 1.75, 1.5, 1.0]
    with pytest.raises(PlotError, match="1.5 is no discount factor"):
        analysis.discount_tester(ticks, [1.5])


def test_common_rewards_are_counted(laps):
    data = analysis.common_rewards(
        laps.with_columns(reward=pl.when(pl.col("tick") == 5).then(100.0).otherwise(1.0))
    ).data
    assert data["reward"].to_list() == [1.0, 100.0]
    assert data["count"].to_list() == [123, 4]
    assert data["steps"].to_list()[1] == 1, "a bonus is paid at one step of the episode"


def test_sectors_of_a_lap_add_up_to_its_time(laps):
    track = load_track("reinvent_base")
    for parts in (None, 3):
        data = analysis.sector_times(laps, track, parts).data
        sums = data.group_by("unique_episode").agg(pl.col("seconds").sum(), pl.col("lap_seconds").first())
        assert sums["seconds"].to_list() == pytest.approx(sums["lap_seconds"].to_list())
    even = analysis.sector_times(laps, track, 3).data.filter(pl.col("unique_episode") == 0)
    assert even["seconds"].to_list() == pytest.approx([1.0, 1.0, 1.0], abs=0.08)


def test_slides_of_a_car_that_goes_where_it_looks_and_of_one_that_drifts(tmp_path):
    columns = makers.episode(0, 0.1, ticks=40)
    straight = analysis.with_motion(logs_of(tmp_path, columns))
    assert straight["slide_rad"].abs().max() < 0.03
    assert straight["driven_mps"].drop_nulls().to_numpy() == pytest.approx(0.1 * 17.71 / 39 * 15, rel=0.02)
    (tmp_path / "b").mkdir()
    columns["yaw"] = (columns["yaw"] - 20.0 + 180.0) % 360.0 - 180.0
    drifting = analysis.with_motion(logs_of(tmp_path / "b", columns))
    assert np.degrees(drifting["slide_rad"].drop_nulls().to_numpy()) == pytest.approx(20.0, abs=2.0)


def test_slides_are_small_where_the_heading_passes_from_179_to_minus_179_degrees(tmp_path):
    track = load_track("reinvent_base")
    slide = analysis.with_motion(logs_of(tmp_path, makers.episode(0, 1.0, ticks=300, track=track)))["slide_rad"]
    assert np.degrees(slide.abs().max()) < 20.0, "corners of the centre line turn by less"


@pytest.fixture
def set_down(tmp_path):
    """An episode whose first tick lies three metres off, where the last one ended; and a hop back in its third."""
    columns = makers.episode(0, 0.3, ticks=40)
    columns["X"][0] += 3.0
    columns["X"][2], columns["Y"][2] = columns["X"][1] - 0.03, columns["Y"][1]
    return logs_of(tmp_path, columns).collect()


def test_the_way_to_where_a_car_was_set_down_is_no_driven_speed_and_no_slide(set_down):
    told = analysis.with_motion(set_down)
    assert told["driven_mps"].is_null().to_list() == [True, True] + [False] * 38
    assert told["driven_mps"].max() < 5.0
    assert told["slide_rad"].is_null().to_list() == [True] * 3 + [False] * 37
    assert np.degrees(told["slide_rad"].abs().max()) < 20.0, "it hopped backwards only while it was put down"


def test_paths_are_broken_where_a_car_was_set_down(set_down):
    maps = [axes for axes in analysis.one_episode(set_down, load_track("reinvent_base"), 0).figure.axes
            if axes.get_aspect() == 1.0]  # fmt: skip
    paths = [one for axes in maps for one in axes.collections if isinstance(one, LineCollection)]
    assert sum(len(one.get_segments()) for one in paths) == 38, "of 39 steps one was not driven"


def test_exits_are_where_episodes_ended(laps):
    track = load_track("reinvent_base")
    plot = analysis.exit_points(laps, track)
    assert plot.data["unique_episode"].to_list() == [2, 3]
    assert plot.data["lap_share"].to_numpy() == pytest.approx(0.3, abs=0.01)
    worst = analysis.exits_by_segment(laps, track).row(0, named=True)
    assert (worst["exits"], worst["crashes"], worst["share"], worst["passed_share"]) == (2, 0, 1.0, 0.5)
    assert plot.title == "Where cars left the road, 2 times"
    hit = laps.with_columns(pl.col("status").cast(pl.String).replace("off_track", "crashed"))
    assert analysis.exit_points(hit, track).title == "Where cars crashed, 2 times"
    with pytest.raises(PlotError, match="No car left the road"):
        analysis.exit_points(laps.filter(pl.col("unique_episode") < 2), track)


def test_the_best_laps_in_every_order(laps):
    assert analysis.best_laps(laps)["unique_episode"].to_list() == [0, 1]
    assert analysis.best_laps(laps, by="reward")["unique_episode"].to_list() == [1, 0, 2, 3]
    assert analysis.best_laps(laps, 1, "progress_share")["unique_episode"].to_list() == [0]
    with pytest.raises(PlotError, match="expected seconds, progress_share or reward"):
        analysis.best_laps(laps, by="luck")


def test_an_episode_or_column_that_is_not_there_is_named(laps):
    track = load_track("reinvent_base")
    with pytest.raises(PlotError, match="no unique episode 9; expected 0 to 3"):
        analysis.one_episode(laps, track, 9)
    with pytest.raises(PlotError, match="no column joy"):
        analysis.reward_heat_map(laps, track, "joy")
    with pytest.raises(PlotError, match="no ticks here"):
        analysis.simulation_agg(laps.filter(pl.col("tick") < 0))


def test_another_reward_is_paid_for_the_same_laps(laps):
    plot = analysis.new_reward(laps, load_track("reinvent_base"), lambda params: params["progress"] + params["steps"])
    frame = plot.data
    assert frame.filter(pl.col("status") == "prepare")["new_reward"].to_list() == [0.0] * 4
    driven = frame.filter(pl.col("status") != "prepare")
    wanted = 100 * driven["progress_share"] + driven["tick"]
    assert driven["new_reward"].to_numpy() == pytest.approx(wanted.to_numpy())


# --- by law -----------------------------------------------------------------------------------------------------------


def test_segments_of_every_circuit_cover_it_once_and_their_bends_are_the_turns_of_telemetry():
    """A straight below a metre is shared by the turns beside it: a bend is at most half a metre longer there."""
    for name in ("Straight_track", *names()[::6]):
        track = load_track(name)
        found, corners = analysis.find_segments(track), find_corners(track)
        kinds = [one.kind for one in found.all]
        assert sum(one.length_m for one in found.all) == pytest.approx(track.length), name
        assert set(found.of(np.linspace(0.0, 1.0, 4000)).tolist()) == set(range(len(kinds))), name
        assert all((a, b) != ("straight", "straight") for a, b in itertools.pairwise(kinds)), name
        assert len({one.name for one in found.all}) == len(kinds), name
        assert kinds.count("left") + kinds.count("right") == len(corners), name
        for corner in corners:
            middle = corner.begin + 0.5 * ((corner.end - corner.begin) % 1.0)
            bend = found.all[int(found.of(middle % 1.0))]
            assert (bend.kind, bend.name) == (corner.side, corner.name), name
            for ours, theirs in ((bend.begin, corner.begin), (bend.end, corner.end)):
                assert abs((ours - theirs + 0.5) % 1.0 - 0.5) * track.length <= 0.5, (name, corner.name)


@pytest.mark.parametrize("name", ["Spain_track", "reInvent2019_wide_cw"])
@pytest.mark.parametrize("backwards", [False, True])
def test_the_circuit_of_a_log_is_found_and_turned_as_it_was_driven(tmp_path, name, backwards):
    track = load_track(name)
    driven = track.reversed() if backwards else track
    ticks = logs_of(tmp_path, makers.joined(*(makers.episode(k, 0.8, 150, track=driven) for k in range(2))))
    found = analysis.find_track(ticks)
    assert found.direction == driven.direction
    assert np.abs(found.as_filed().centre - driven.as_filed().centre).max() < 0.05, found.name
    assert analysis.find_track(ticks, name).direction == driven.direction


def test_a_circuit_that_nobody_knows_is_a_letter(tmp_path):
    ticks = logs_of(tmp_path, makers.episode(0)).with_columns(track_length_m=pl.lit(3.14))
    with pytest.raises(PlotError, match="3.140 m long .* Name it with --track"):
        analysis.find_track(ticks)
    assert analysis.track_or_none(ticks) is None


@pytest.mark.parametrize("name", ["Bowtie_track", "reInvent2019_wide"])
def test_a_log_is_not_read_on_a_track_that_it_was_not_driven_on(tmp_path, name):
    """The first is nearly as long, the second lies nearly where the car drove."""
    ticks = logs_of(tmp_path, makers.joined(*(makers.episode(k, 0.8, 150) for k in range(2))))
    assert analysis.find_track(ticks, "reinvent_base").name == "reinvent_base"
    with pytest.raises(TrackError, match=f"{name}: a track of"):
        analysis.find_track(ticks, name)


def every_plot(ticks, track):
    """Return each plot's maker by name, for laps of which at least three are full."""
    frame = ticks.collect()
    judged = frame.with_columns(phase=pl.lit("evaluation").cast(frame.schema["phase"]))
    return {
        "stability": analysis.stability(ticks), "progress": analysis.training_progress(ticks),
        "scatter": analysis.scatter_of_laps(ticks), "full": analysis.scatter_of_laps(ticks, complete=True),
        "quintiles": analysis.quintiles(ticks), "top": analysis.top_iterations(ticks, track),
        "heat": analysis.reward_heat_map(ticks, track), "actions": analysis.action_heat_maps(ticks, track),
        "episode": analysis.one_episode(ticks, track, 0), "iteration": analysis.one_iteration(ticks, track, 0),
        "laps": analysis.selected_laps(ticks, track, [0, 1]), "segments": analysis.segments_plot(track),
        "breakdown": analysis.action_breakdown(ticks, track), "space": analysis.action_space(ticks),
        "histogram": analysis.action_histogram(ticks), "index": analysis.action_index_map(ticks, track),
        "waypoints": analysis.reward_per_waypoint(ticks, track), "exits": analysis.exit_points(ticks, track),
        "common": analysis.common_rewards(ticks), "spread": analysis.reward_distribution(ticks),
        "discount": analysis.discount_tester(ticks), "slides": analysis.slides(ticks, track),
        "distributions": analysis.episode_distributions(ticks, 0), "times": analysis.lap_times(ticks),
        "correlations": analysis.lap_correlations(ticks), "sectors": analysis.sector_times(ticks, track),
        "straights": analysis.straights_and_curves(ticks, track),
        "grid": analysis.evaluation_grid(judged, track),
        "new": analysis.new_reward(ticks, track, lambda params: params["speed"]),
    }  # fmt: skip


@pytest.mark.parametrize(("backwards", "continuous"), [(False, False), (True, True)])
@pytest.mark.parametrize("name", ["reinvent_base", "Spain_track", "Straight_track"])
def test_every_plot_has_data_on_every_kind_of_track_and_action(tmp_path, name, backwards, continuous):
    track = load_track(name).reversed() if backwards else load_track(name)
    parts = [makers.episode(k, 1.0, 40 + 3 * k * k, status="lap_complete", track=track, continuous=continuous)
             for k in range(4)]  # fmt: skip
    parts += [makers.episode(4, 0.4, track=track, continuous=continuous)]
    ticks = logs_of(tmp_path, makers.joined(*parts))
    for what, plot in every_plot(ticks, track).items():
        assert plot.data.height > 0, what


def test_continuous_actions_fall_into_bins_right_to_left(tmp_path):
    table = analysis.action_table(logs_of(tmp_path, makers.episode(0, 0.5, 61, continuous=True)))
    assert table["steering_rad"].to_list() == pytest.approx([-0.5, 0.0, 0.5])
    assert table["count"].to_list() == [20, 20, 20]


# --- by twin ----------------------------------------------------------------------------------------------------------


def test_episodes_agree_with_deepracer_utils():
    utils = pytest.importorskip("deepracer.logs")
    theirs = utils.DeepRacerLog(str(TRACES / "drfc-1-worker"))
    theirs.load(ignore_metadata=True)
    table = utils.AnalysisUtils.simulation_agg(theirs.df, secondgroup="unique_episode").sort_values("unique_episode")
    ours = analysis.simulation_agg(read(TRACES / "drfc-1-worker").training)
    for name, column, factor in (
        ("steps", "steps", 1), ("progress", "progress_share", 100), ("time", "seconds", 1),
        ("speed", "speed_mps", 1), ("reward", "reward", 1), ("start_at", "start_at", 1), ("complete", "complete", 1),
        ("time_if_complete", "seconds_if_complete", 1), ("reward_if_complete", "reward_if_complete", 1),
    ):  # fmt: skip
        mine = ours[column].cast(pl.Float64).to_numpy() * factor
        assert mine == pytest.approx(table[name].astype(float).to_numpy(), rel=1e-9), name
    theirs_m, ours_m = table["dist"].astype(float).to_numpy(), ours["distance_m"].to_numpy()
    same = np.isclose(ours_m, theirs_m, rtol=1e-9)
    assert (same.sum(), len(same)) == (536, 540)
    assert (theirs_m[~same] - ours_m[~same] > 0.9).all()  # theirs counts how far the car was set down elsewhere


def test_stability_agrees_with_deepracer_utils():
    utils = pytest.importorskip("deepracer.logs")
    theirs = utils.DeepRacerLog(str(TRACES / "drfc-1-worker"))
    theirs.load(ignore_metadata=True)
    table = theirs.stability.analyze()
    ours = analysis.stability(read(TRACES / "drfc-1-worker").training).data
    found = [name for name in table.columns if "avg" in name or "mean" in name]
    scale = 1.0 if table[found[0]].mean() > 1 else 1000.0
    assert ours["mean_ms"].to_numpy() == pytest.approx(scale * table[found[0]].to_numpy(), rel=1e-6)


@pytest.mark.skipif(not HAS_ALL, reason=LARGE)
def test_real_logs_say_what_to_change():
    logs = read(TRACES / "console-2022")
    track = analysis.find_track(logs.training)
    assert (track.name, track.is_reversed) == ("reinvent_base", False)
    told = advice(logs.training.collect(), track)
    assert told[0].try_.startswith("It is still learning")
    assert any(
        "47 full laps lose 2.96 s" in one.found and "in turn 1 (left), waypoints 20 to 47" in one.found for one in told
    )
    assert not any("exits" in one.found for one in told), "54 of 177 in a quarter of the lap may be chance"


@pytest.mark.skipif(not HAS_ALL, reason=LARGE)
def test_a_real_car_that_laps_when_it_is_judged_is_not_told_that_it_fails():
    """The console's metrics: its last six evaluations are full laps all five, while its exploring cars still fail."""
    logs = read(TRACES / "console-2022")
    judged = judged_in_log(logs.ticks.collect(), logs.metrics.collect())
    assert (len(judged.shares), judged.shares[-6:], judged.best_lap_seconds) == (
        28,
        (1.0,) * 6,
        pytest.approx(14.13, abs=0.01),
    )
    told = advice(logs.training.collect(), analysis.find_track(logs.training), judged=judged)
    assert told[0].try_.startswith("It laps: ask for more speed")
    assert "its last 2 evaluations came to 100 % and 100 % of a lap. Its best lap took 14.13 s." in told[0].found
    assert not any("exits" in one.found or "still learning" in one.try_ for one in told)


@pytest.mark.skipif(not HAS_ALL, reason=LARGE)
def test_an_evaluation_driven_by_itself_is_a_judgement_too():
    logs = read(TRACES / "drfc-1-worker")
    alone = judged_in_log(logs.ticks.collect(), None)
    assert alone.shares == (1.0,)
    assert alone.best_lap_seconds == pytest.approx(12.212, abs=0.001), "explored; the judged one took 13.8 s"
    assert judged_in_log(logs.training.collect(), None) == Evaluations()


def test_advice_is_silent_where_there_is_little_to_go_by(laps):
    assert advice(laps.collect(), load_track("reinvent_base")) == []


def training(shares, **more):
    """Return a training's ticks: an episode for each share of the lap, full laps at 1."""
    parts = [
        makers.episode(
            k, share, ticks=46, start_s=10.0 * k, status="lap_complete" if share == 1.0 else "off_track", **more
        )
        for k, share in enumerate(shares)
    ]
    return makers.joined(*parts)


def what_to_try(tmp_path, shares, **more):
    ticks = logs_of(tmp_path, training(shares, **more)).collect()
    ticks = ticks.with_columns((pl.col("unique_episode") // 10).alias("iteration"))
    return [one.try_ for one in advice(ticks, load_track("reinvent_base"))]


def test_a_training_that_has_hardly_begun_is_told_to_go_on_and_nothing_of_speed(tmp_path):
    """By hand: 40 episodes of 46 steps are 1,840, fewer than any training of AWS's took to its first lap."""
    first, *others = what_to_try(tmp_path, [0.05, 0.07] * 20, continuous=True)
    assert first.startswith("It is early")
    assert "this one has 1,840" in first
    assert not any("Speed is not used" in one for one in others)


def test_no_trend_is_told_of_one_iteration_or_of_twenty_episodes(tmp_path):
    rising = [0.1] * 12 + [0.6] * 8
    assert not any("still learning" in one for one in what_to_try(tmp_path, rising))
    ticks = logs_of(tmp_path, training(rising * 2)).collect()
    assert not any("of the episodes to" in one.found for one in advice(ticks, None)), "all of one iteration"


def test_a_simulator_is_late_by_its_mean_step_not_by_how_far_stamps_stray(tmp_path):
    """A public console log: 66.8 ms on average, 92 ms in one step of twenty. Then one of 80 ms."""
    columns = training([0.3] * 40)
    for mean_ms, late in ((66.8, False), (80.0, True)):
        jitter = np.random.default_rng(3).normal(0.0, 15.0, len(columns["steps"]))
        columns["tstamp"] = 0.001 * np.cumsum(np.clip(mean_ms + jitter, 20.0, None))
        told = [one.found for one in advice(logs_of(tmp_path / f"{late}", columns).collect(), None)]
        assert any("could not keep fifteen steps a second" in one for one in told) == late
        assert not late or "ms on average (95 %: " in told[0]


def test_chance_is_no_change_and_a_change_is_one(tmp_path):
    """By hand: fifths of eight laps of 20 or 60 %; their mean of 40 has an error of 7.6, so 45 is no more than 40."""
    steady = [1.0] + [0.2, 0.6] * 15 + [0.2, 0.6, 0.2, 0.6, 0.2, 0.6, 0.6, 0.4, 0.4]
    assert what_to_try(tmp_path, steady)[0].startswith("It stands still below full laps")
    rising = [1.0] + [0.2, 0.3] * 15 + [0.7] * 9
    assert what_to_try(tmp_path, rising)[0].startswith("It is still learning")
    falling = [1.0] + [0.7] * 30 + [0.2, 0.3] * 4 + [0.3]
    assert what_to_try(tmp_path, falling)[0].startswith("It has got worse")


@pytest.mark.parametrize("status", ["in_progress", "time_up"])
def test_fifths_go_by_when_episodes_end_and_what_was_cut_is_no_short_lap(tmp_path, status):
    """By hand: 40 laps of 50 %, of which the last but eight to begin end last; the eight are cut off at 2 %."""
    parts = [makers.episode(k, 0.5, ticks=46, start_s=10.0 * k) for k in range(40)]
    parts += [makers.episode(k, 0.02, ticks=3, start_s=10.0 * k, status=status) for k in range(40, 48)]
    ticks = logs_of(tmp_path, makers.joined(*parts)).collect()
    late = ((pl.col("unique_episode") < 8) & (pl.col("tick") > 40)).cast(pl.Int32)
    share = pl.when(pl.col("unique_episode") < 8).then(2.0).otherwise(1.0) * pl.col("progress_share")
    told = advice(ticks.with_columns(late.alias("iteration"), share.alias("progress_share")), None)[0]
    assert told.found.startswith(
        "Mean progress went from 50 % in the fourth fifth of the episodes to 100 % in the last"
    )
    assert told.plot().data["progress_share"].min() >= 0.5, "beside the words stands what they tell of"


def test_a_car_whose_drives_the_clock_cuts_is_not_left_without_advice(tmp_path):
    parts = [makers.episode(k, 0.4, ticks=46, start_s=10.0 * k, status="time_up") for k in range(40)]
    later = (pl.col("unique_episode") >= 20).cast(pl.Int32).alias("iteration")
    told = advice(logs_of(tmp_path, makers.joined(*parts)).collect().with_columns(later), None)[0].found
    assert told.startswith("Mean progress went from 40 % in the fourth fifth of the episodes to 40 % in the last")


def test_a_place_is_told_by_its_waypoints_too(tmp_path):
    """By hand: all leave the road at 30 % of re:Invent 2018, the 36th waypoint of 119, in the bend round its east."""
    ticks = logs_of(tmp_path, training([0.3] * 40)).collect()
    (told,) = [one.found for one in advice(ticks, load_track("reinvent_base")) if "exits" in one.found]
    first, last = map(int, re.search(r"16 of 16 .*lie in turn 1 \(left\), waypoints (\d+) to (\d+) ", told).groups())
    assert first < 36 < last < 60


@pytest.mark.parametrize(
    ("continuous", "words"),
    [(False, "make the slow action that points ahead faster"), (True, "raise the lowest speed")],
)
def test_who_gets_round_slowly_is_told_what_can_be_changed(tmp_path, continuous, words):
    told = [one for one in what_to_try(tmp_path, [1.0] * 40, continuous=continuous) if "Speed is not used" in one]
    assert all(words in one for one in told)
    assert told


def found(tmp_path, columns, begins):
    """Return what advice found that holds some words, of a training whose iterations are ten episodes each."""
    ticks = logs_of(tmp_path, columns).collect()
    ticks = ticks.with_columns((pl.col("unique_episode") // 10).alias("iteration"))
    return [one.found for one in advice(ticks, load_track("reinvent_base")) if begins in one.found]


def test_an_exit_place_is_one_only_where_chance_does_not_explain_it(tmp_path):
    """By hand: 16 of 16 is 81 % at least (Wilson); exits that are spread over the lap show no place."""
    (told,) = found(tmp_path / "one", training([0.3] * 40), "exits")
    assert "(100 %, 95 %: 81 to 100; it is " in told
    assert found(tmp_path / "spread", training([(7 * k % 40 + 0.5) / 40 for k in range(40)]), "exits") == []


def test_a_car_that_asks_for_its_top_speed_on_straights_is_not_told_of_speed(tmp_path):
    columns = training([1.0] * 40)
    (told,) = found(tmp_path / "slow", columns, "On straights")
    assert re.search(r"asks for 1\.\d\d m/s on average \(95 %: 1\.\d\d to 1\.\d\d\), of 2\.00 m/s", told)
    columns["throttle"] = np.full(len(columns["throttle"]), 2.0)
    assert found(tmp_path / "fast", columns, "On straights") == []


def test_laps_that_are_all_alike_lose_nothing_and_a_slow_bend_is_named(tmp_path):
    """Forty laps of 46 steps; then every second one stands a second still at 30 % of the lap."""
    columns = training([1.0] * 40)
    assert found(tmp_path / "alike", columns, "best sectors") == []
    late = np.concatenate([np.where((np.arange(46) > 14) & (k % 2 == 1), 1.0, 0.0) for k in range(40)])
    columns["tstamp"] = columns["tstamp"] + late
    (told,) = found(tmp_path / "late", columns, "best sectors")
    assert told.startswith("40 full laps lose 0.50 s on average to the best sectors put together, 0.50 s of it (95 %: ")
    assert "in turn 1 (left), waypoints " in told


def test_of_few_laps_no_sector_is_told(tmp_path):
    columns = training([1.0] * 9 + [0.3] * 31)
    late = np.concatenate([np.where((np.arange(46) > 14) & (k % 2 == 1), 1.0, 0.0) for k in range(40)])
    columns["tstamp"] = columns["tstamp"] + late
    assert found(tmp_path, columns, "best sectors") == []


def test_an_action_is_rare_only_where_enough_steps_show_it(tmp_path):
    """By hand: 2 of 368 late steps are 0.5 %, and may be 2 % (Wilson); 1 of 1,840 is at most 0.3 %."""
    for episodes, rare in ((40, 2), (200, 1)):
        columns = training([1.0] * episodes)
        columns["action"] = np.where(columns["action"] == 2, 0, columns["action"])
        columns["action"][-rare:] = 2
        told = found(tmp_path / str(episodes), columns, "less than one step of a hundred")
        assert bool(told) == (episodes == 200)
        assert not told or "(95 %: at most 0.3 %)" in told[0]
