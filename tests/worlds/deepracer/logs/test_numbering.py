"""Episodes told apart where their numbers alone do not tell."""

import json

import polars as pl
import pytest
from tests.worlds.deepracer.logs import makers

from racecraft.worlds.deepracer.analysis.logs import simulation_agg
from racecraft.worlds.deepracer.logs import read
from racecraft.worlds.deepracer.logs.continued import join_continued
from racecraft.worlds.deepracer.logs.numbering import number


def rows(**columns):
    usual = {"round": 1, "phase": "training", "stream": "", "worker": 0}
    count = len(columns["tick"])
    usual_columns = {name: [value] * count for name, value in usual.items()}
    return pl.DataFrame(usual_columns | {"file": range(count)} | columns)


def test_an_episode_begins_where_steps_start_again_though_its_number_stays():
    frame = number(rows(episode=[0, 0, 0, 0], tick=[1, 2, 1, 2]))
    assert frame["unique_episode"].to_list() == [0, 0, 1, 1]
    assert number(rows(episode=[0, 0], tick=[1, 1]))["unique_episode"].to_list() == [0, 1], "two of one step each"


def test_an_episode_does_not_reach_over_workers_streams_phases_or_rounds():
    for name, values in (
        ("worker", [0, 1]),
        ("stream", ["a", "b"]),
        ("phase", ["training", "evaluation"]),
        ("round", [1, 2]),
    ):
        frame = number(rows(episode=[3, 3], tick=[1, 2], **{name: values}))
        assert frame["unique_episode"].to_list() == [0, 1], name


def test_a_training_begun_again_in_the_same_folder_has_its_own_episodes(tmp_path):
    for k in range(2):
        makers.write(tmp_path / "training-simtrace" / f"{k}-iteration.csv", makers.iteration(range(1)))
    assert read(tmp_path).ticks.collect()["unique_episode"].n_unique() == 2


def test_metrics_of_a_second_worker_go_by_the_iterations_of_the_first(tmp_path):
    row = {"start_time": 0, "metric_time": 9, "completion_percentage": 5, "phase": "training"}
    (tmp_path / "metrics").mkdir()
    for name, trials in (("TrainingMetrics", (1, 2, 1, 2)), ("TrainingMetrics_1", (1, 2, 3, 4))):
        told = [row | {"episode": k, "trial": trial} for k, trial in enumerate(trials, 1)]
        (tmp_path / "metrics" / f"{name}.json").write_text(json.dumps({"metrics": told}))
    table = read(tmp_path).metrics.collect()
    assert table.select("worker", "iteration").rows() == [(w, i) for w in (0, 1) for i in (0, 0, 1, 1)]


def test_trials_that_each_start_from_standstill_are_timed_without_the_wait_between(tmp_path):
    trials = [makers.episode(k, 1.0, 31, start_s=10.0 + 20 * k, status="lap_complete") for k in range(2)]
    makers.write(tmp_path / "evaluation-20220709200242/evaluation-simtrace/0-iteration.csv", makers.joined(*trials))
    seconds = simulation_agg(read(tmp_path).evaluations)["seconds"].to_list()
    assert [round(one, 6) for one in seconds] == [2.0, 2.0]


def cut(number, at, ticks=12, **details):
    """Return the two parts of an episode that an iteration's end cuts after so many steps."""
    whole = makers.episode(number, ticks=ticks, **details)
    return [{name: values[part] for name, values in whole.items()} for part in (slice(at), slice(at, None))]


def cars_side_by_side(folder):
    """Write two iterations of three cars: the first car's episode 0 is cut, the second's ends just there."""
    begun, goes_on = cut(0, 7, share=0.5)
    files = {
        ("", 0): makers.joined(begun), ("", 1): makers.joined(goes_on, makers.episode(1)),
        ("1", 0): makers.episode(0), ("1", 1): makers.episode(1),
        ("2", 0): makers.episode(0), ("2", 1): makers.episode(1),
    }  # fmt: skip
    for (worker, iteration), columns in files.items():
        part = f"{worker}/training-simtrace" if worker else "0/training-simtrace"
        makers.write(folder / part / f"{iteration}-iteration.csv", columns)
    return read(folder).ticks.collect()


def test_an_episode_that_goes_on_in_the_next_iteration_is_one_whatever_stands_between(tmp_path):
    ticks = cars_side_by_side(tmp_path)
    assert ticks["unique_episode"].to_list() == sorted(ticks["unique_episode"].to_list())
    first = ticks.filter(pl.col("unique_episode") == 0)
    assert first["tick"].to_list() == list(range(1, 13))
    assert first["iteration"].to_list() == [0] * 7 + [1] * 5
    episodes = simulation_agg(ticks)
    assert episodes.select("worker", "iteration", "episode", "steps").rows() == [
        (0, 0, 0, 12), (1, 0, 0, 12), (2, 0, 0, 12), (0, 1, 1, 12), (1, 1, 1, 12), (2, 1, 1, 12),
    ]  # fmt: skip
    one = episodes.row(0, named=True)
    assert (one["progress_share"], one["reward"], one["status"]) == (0.5, 11.0, "off_track")
    assert one["seconds"] == pytest.approx(11 / 15)


@pytest.mark.parametrize(
    "changed", [{"episode": [4, 9, 5]}, {"tick": [1, 1, 4]}, {"worker": [0, 1, 2]}, {"phase": ["evaluation"] * 3}]
)
def test_parts_that_do_not_follow_each_other_stay_two(changed):
    columns = {"episode": [4, 9, 4], "tick": [1, 1, 2], "worker": [0, 1, 0]}
    assert join_continued(number(rows(**columns)))["unique_episode"].to_list() == [0, 0, 1]
    assert join_continued(number(rows(**{**columns, **changed})))["unique_episode"].to_list() == [0, 1, 2]
