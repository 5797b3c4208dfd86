"""Metrics files: real ones come back byte for byte; wrong ones get letters."""

import json

import pytest
from tests.reference import TRACES

from racecraft.contract.errors import ContractError
from racecraft.worlds.deepracer.files.training_metrics import (
    EvaluationRow,
    MetricsFileError,
    TrainingRow,
    evaluation_row,
    read_metrics_file,
    training_row,
    write_evaluation_metrics,
    write_training_metrics,
)


def test_every_real_file_comes_back_byte_for_byte(tmp_path):
    paths = sorted(TRACES.glob("**/metrics/**/*.json"))
    assert len(paths) == 5
    for path in paths:
        file = read_metrics_file(path)
        if file.best_model_metric:
            write_training_metrics(tmp_path / "m.json", file.rows, file.best_model_metric)
        else:
            write_evaluation_metrics(tmp_path / "m.json", file.rows)
        assert (tmp_path / "m.json").read_bytes() == path.read_bytes(), path


def test_seconds_and_shares_become_what_aws_writes():
    """The first row of a real training: 27.746 s to 31.538 s, 29.9 % of the lap, reward 31."""
    row = training_row(
        reward=31.2, start_s=27.746, end_s=31.538, episode=1, trial=1, progress_share=0.299, status="off_track"
    )
    assert row == TrainingRow(31, 31538, 27746, 3792, 1, 1, "training", 29, "Off track")
    lap = evaluation_row(
        start_s=7, end_s=21.25, trial=2, progress_share=1.0, status="lap_complete", crashes=1, off_track=2
    )
    assert lap == EvaluationRow(100, 21250, 7000, 14250, "Lap complete", 1, 0, 2, 0, 3, 2)


def test_nobody_chooses_the_best_by_a_metric_that_is_not(tmp_path):
    with pytest.raises(ContractError, match="Did you mean 'progress'"):
        write_training_metrics(tmp_path / "m.json", [], "progres")


WRONG = [  # text, what the message holds
    ("[]", ":1: there are no metrics"),
    ('{"metrics": [\n3]}', ":2: metrics[0]: 3; expected an object"),
    ('{"metrics": [\n{"phase": "training"}]}', ":2: metrics[0].reward_score: there is no such value; expected a whole"),
    ('{"metrics": [\n', ":2: no valid JSON"),
]


@pytest.mark.parametrize(("text", "found"), WRONG)
def test_what_is_no_metrics_file_gets_a_letter(tmp_path, text, found):
    (tmp_path / "m.json").write_text(text)
    with pytest.raises(MetricsFileError) as caught:
        read_metrics_file(tmp_path / "m.json")
    assert str(caught.value).startswith(f"{tmp_path / 'm.json'}{found}")


@pytest.mark.filterwarnings("ignore::DeprecationWarning", "ignore::FutureWarning")
def test_deepracer_utils_reads_metrics_of_ours(tmp_path, monkeypatch):
    logs = pytest.importorskip("deepracer.logs", reason="deepracer-utils is not installed")
    for name, value in [
        ("AWS_DEFAULT_REGION", "us-east-1"),
        ("AWS_ACCESS_KEY_ID", "x"),
        ("AWS_SECRET_ACCESS_KEY", "x"),
    ]:
        monkeypatch.setenv(name, value)
    rows = []
    for episode in range(1, 5):
        trial = (episode - 1) % 2 + 1
        rows.append(
            training_row(
                reward=episode, start_s=episode, end_s=episode + 0.5, episode=episode, trial=trial,
                progress_share=0.5, status="off_track",
            )
        )  # fmt: skip
    write_training_metrics(tmp_path / "m.json", rows)
    metrics = logs.metrics.TrainingMetrics("bucket", fname=str(tmp_path / "m.json"))
    frame = metrics.getTraining()
    assert len(frame) == 4
    assert set(frame["iteration"]) == {0, 1}
    assert json.loads((tmp_path / "m.json").read_text())["version"] == 2.0


@pytest.mark.parametrize(("share", "percent"), [(0.0099, 0), (0.29, 29), (0.5799999, 57), (1.0, 100)])
def test_percent_are_cut_but_for_a_hair(share, percent):
    """0.29 * 100 and 0.58 * 100 are a hair below a whole number in floats."""
    row = training_row(reward=0, start_s=0, end_s=1, episode=1, trial=1, progress_share=share, status="time_up")
    assert (row.completion_percentage, row.episode_status, row.phase) == (percent, "Time Up", "training")


def test_mishaps_are_counted_and_summed():
    lap = evaluation_row(start_s=0.5, end_s=2, trial=1, progress_share=0.5, status="reversed", crashes=1, immobilized=2,
                         off_track=4, reversed_=8)  # fmt: skip
    counts = (lap.crash_count, lap.immobilized_count, lap.off_track_count, lap.reversed_count, lap.reset_count)
    assert counts == (1, 2, 4, 8, 15)
    clean = evaluation_row(start_s=0.5, end_s=2, trial=1, progress_share=0.5, status="pause")
    assert (clean.crash_count, clean.immobilized_count, clean.off_track_count, clean.reversed_count) == (0, 0, 0, 0)
    assert (clean.reset_count, clean.elapsed_time_in_milliseconds, clean.metric_time) == (0, 1500, 2000)


ROW = {"reward_score": 31, "metric_time": 2, "start_time": 1, "elapsed_time_in_milliseconds": 1, "episode": 1,
       "trial": 1, "phase": "training", "completion_percentage": 29, "episode_status": "Off track"}  # fmt: skip


def read(tmp_path, value):
    (tmp_path / "m.json").write_text(json.dumps(value))
    return read_metrics_file(tmp_path / "m.json")


def test_whole_numbers_may_be_floats_and_the_best_model_goes_by_progress(tmp_path):
    file = read(tmp_path, {"metrics": [{**ROW, "reward_score": 31.0}]})
    assert (file.rows, file.best_model_metric) == ((TrainingRow(**ROW),), "progress")
    assert type(file.rows[0].reward_score) is int


@pytest.mark.parametrize(
    ("name", "value", "expected"),
    [("reward_score", 31.5, "a whole number"), ("trial", True, "a whole number"), ("phase", 3, "a word")],
)
def test_a_value_of_another_kind_is_refused(tmp_path, name, value, expected):
    with pytest.raises(MetricsFileError, match=rf"metrics\[0\]\.{name}: .*expected {expected}"):
        read(tmp_path, {"metrics": [{**ROW, name: value}]})
