"""Episodes told apart where their numbers alone do not tell."""

import json

import polars as pl
from tests.logs import makers

from racecraft.analysis.deepracer.logs import simulation_agg
from racecraft.logs import read
from racecraft.logs.numbering import number


def rows(**columns):
    usual = {"round": 1, "phase": "training", "stream": "", "worker": 0}
    count = len(columns["tick"])
    return pl.DataFrame({name: [value] * count for name, value in usual.items()} | columns)


def test_an_episode_begins_where_steps_start_again_though_its_number_stays():
    frame = number(rows(episode=[0, 0, 0, 0], tick=[1, 2, 1, 2]))
    assert frame["unique_episode"].to_list() == [0, 0, 1, 1]


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


def test_iterations_of_one_episode_are_told_by_their_trials(tmp_path):
    row = {"start_time": 0, "metric_time": 9, "completion_percentage": 5, "trial": 1, "phase": "training"}
    path = tmp_path / "TrainingMetrics.json"
    path.write_text(json.dumps({"metrics": [row | {"episode": k} for k in (1, 2, 3)]}))
    assert read(path).metrics.collect()["iteration"].to_list() == [0, 1, 2]


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
