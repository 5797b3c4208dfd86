"""The layout of an AWS model folder, and what it says of checkpoints."""

import datetime
import json

import pytest

from racecraft.worlds.deepracer.files.model_folder import (
    AwsModelFolder,
    CheckpointMark,
    CheckpointMarksError,
    read_checkpoint_marks,
    write_checkpoint_marks,
)


def test_files_stand_where_deepracer_for_cloud_puts_them(tmp_path):
    place = AwsModelFolder(tmp_path)
    names = [
        place.model_metadata,
        place.hyperparameters,
        place.training_metrics,
        place.checkpoint_marks,
        place.training_params,
        place.simulation_log,
        place.training_trace(7),
        place.evaluation_trace("20260102030405"),
        place.evaluation_metrics("20260102030405"),
    ]
    assert [path.relative_to(tmp_path).as_posix() for path in names] == [
        "model/model_metadata.json",
        "ip/hyperparameters.json",
        "metrics/TrainingMetrics.json",
        "model/deepracer_checkpoints.json",
        "training_params.yaml",
        "logs/training/simulation.log",
        "training-simtrace/7-iteration.csv",
        "evaluation-20260102030405/evaluation-simtrace/0-iteration.csv",
        "metrics/evaluation/evaluation-20260102030405.json",
    ]


def test_traces_are_found_by_number_and_strangers_passed_over(tmp_path):
    place = AwsModelFolder(tmp_path)
    assert place.training_traces() == {}
    place.training_trace(0).parent.mkdir()
    for name in ("10-iteration.csv", "9-iteration.csv", "x-iteration.csv", "9-iteration.csv.part"):
        (tmp_path / "training-simtrace" / name).touch()
    assert list(place.training_traces()) == [9, 10]


def test_marks_come_back_and_old_ones_are_read(tmp_path):
    path = tmp_path / "deepracer_checkpoints.json"
    best, last = CheckpointMark(12, 3456, 87.4, 1.5e9), CheckpointMark(13, 3600, None, 1.6e9)
    write_checkpoint_marks(path, best, last)
    assert read_checkpoint_marks(path) == (best, last)
    assert json.loads(path.read_text())["best_checkpoint"]["name"] == "12_Step-3456.ckpt"
    old = {"name": "3_Step-40.ckpt", "avg_comp_pct": 12, "time_stamp": 5}
    path.write_text(json.dumps({"best_checkpoint": old, "last_checkpoint": old}))
    assert read_checkpoint_marks(path)[0] == CheckpointMark(3, 40, 12.0, 5.0)


WRONG = [  # text, what the message holds
    ("{}", ": best_checkpoint: there is no such key; expected a JSON object"),
    ('{"best_checkpoint":\n{"name": "best"}}', ":2: best_checkpoint.name: 'best'; expected a name like"),
    ('{"best_checkpoint":\n{"name": "1_Step-2.ckpt", "avg_eval_metric": "x"}}', "avg_eval_metric: 'x'; expected a num"),
]


@pytest.mark.parametrize(("text", "found"), WRONG)
def test_what_are_no_marks_gets_a_letter(tmp_path, text, found):
    path = tmp_path / "c.json"
    path.write_text(text)
    with pytest.raises(CheckpointMarksError) as caught:
        read_checkpoint_marks(path)
    assert str(caught.value).startswith(str(path))
    assert found in str(caught.value)


def test_a_second_that_is_taken_is_passed_over_as_often_as_needed(tmp_path):
    place, moment = AwsModelFolder(tmp_path), datetime.datetime(2026, 1, 1)
    for second in range(3):
        place.evaluation_trace(f"2026010100000{second}").parent.mkdir(parents=True)
    assert place.free_stamp(moment) == "20260101000003"


def test_a_mark_without_time_or_score_is_of_long_ago_and_not_rated(tmp_path):
    path = tmp_path / "c.json"
    path.write_text(json.dumps({key: {"name": "1_Step-2.ckpt"} for key in ("best_checkpoint", "last_checkpoint")}))
    assert read_checkpoint_marks(path) == (CheckpointMark(1, 2, None, 0.0),) * 2
    both = {"name": "1_Step-2.ckpt", "avg_eval_metric": 0, "avg_comp_pct": 7, "time_stamp": "5"}
    path.write_text(json.dumps({"best_checkpoint": both, "last_checkpoint": both}))
    assert read_checkpoint_marks(path)[0] == CheckpointMark(1, 2, 0.0, 5.0), "the newer name of the score counts"
