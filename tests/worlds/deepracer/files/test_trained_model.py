"""Which files of a folder belong to a trained model: found by hand, where several could be meant."""

import json
from pathlib import Path

import pytest

from racecraft.contract.errors import MetadataError
from racecraft.worlds.deepracer.files.trained_model import ForeignModelError, _nearest, find_model, looks_like_aws_model


def test_of_several_files_of_a_name_the_one_nearest_to_the_weights_is_meant():
    weights = Path("/model/ip/agent/3_Step-9.ckpt.index")
    near, far, aside = Path("/model/ip/m.json"), Path("/model/m.json"), Path("/model/other/deep/m.json")
    for files in ([near, far, aside], [aside, far, near]):
        assert _nearest(files, {"m.json"}, weights) == near
    assert _nearest([aside, far], {"m.json"}, weights) == far, "of equals the shallowest"
    assert _nearest([near, far], {"n.json"}, weights) is None


def laid_out(folder, *names):
    """Make empty files of a folder."""
    for name in names:
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).touch()
    return folder


def found(model, folder):
    return [(one.path.relative_to(folder).as_posix(), one.iteration, one.steps) for one in model.weights]


def test_checkpoints_come_by_their_numbers_and_before_graphs(tmp_path):
    laid_out(tmp_path, "model_metadata.json", "10_Step-900.ckpt.index", "2_Step-30.ckpt.index", "model_7.pb",
             "2_Step-30.ckpt.meta")  # fmt: skip
    model = find_model(tmp_path)
    assert found(model, tmp_path) == [("2_Step-30.ckpt.index", 2, 30), ("10_Step-900.ckpt.index", 10, 900)]
    assert [one.is_graph for one in model.weights] == [False, False]
    assert (model.metadata, model.best, model.reward, model.hyperparameters, model.params) == (
        tmp_path / "model_metadata.json", None, None, None, None
    )  # fmt: skip


def test_where_there_are_no_checkpoints_graphs_are_taken(tmp_path):
    laid_out(tmp_path, "model_metadata.json", "agent/model_12.pb", "agent/model_3.pb", "agent/model.pb")
    model = find_model(tmp_path)
    assert found(model, tmp_path) == [
        ("agent/model.pb", 0, 0),
        ("agent/model_3.pb", 3, 0),
        ("agent/model_12.pb", 12, 0),
    ]
    assert all(one.is_graph for one in model.weights)


def test_of_two_of_a_number_the_one_that_lies_less_deep_is_taken(tmp_path):
    laid_out(tmp_path, "model_metadata.json", "0/1_Step-5.ckpt.index", "1_Step-9.ckpt.index", "a/1_Step-7.ckpt.index")
    assert found(find_model(tmp_path), tmp_path) == [("1_Step-9.ckpt.index", 1, 9)]


SIDES = ("model_metadata.json", "reward_function.py", "hyperparameters.json", "training_params_b080e2d4-1823.yaml")


def test_what_lies_nearest_to_the_last_weights_is_theirs(tmp_path):
    for number, folder in enumerate(("c", "a", "b"), 1):
        laid_out(tmp_path / folder, *SIDES, f"{number}_Step-{number}.ckpt.index")
        (tmp_path / folder / "deepracer_checkpoints.json").write_text(marks((number, 5.0), (number, 5.0)))
    model = find_model(tmp_path)
    kept = (model.metadata, model.reward, model.hyperparameters, model.params)
    assert kept == tuple(tmp_path / "b" / name for name in SIDES)
    assert model.best == 3
    assert [one.score for one in model.weights] == [None, None, 5.0]


def marks(best, last):
    def mark(number, score):
        return {"name": f"{number}_Step-{10 * number}.ckpt", "avg_eval_metric": score, "time_stamp": 1.0}

    return json.dumps({"best_checkpoint": mark(*best), "last_checkpoint": mark(*last)})


def test_what_is_said_of_the_best_and_the_last_stands_beside_them(tmp_path):
    laid_out(tmp_path, "model_metadata.json", "model_1.pb", "model_2.pb", "model_3.pb")
    (tmp_path / "deepracer_checkpoints.json").write_text(marks((2, 80.0), (3, 60.0)))
    model = find_model(tmp_path)
    assert [(one.iteration, one.steps, one.score) for one in model.weights] == [
        (1, 0, None),
        (2, 20, 80.0),
        (3, 30, 60.0),
    ]
    assert model.best == 2
    laid_out(tmp_path, "2_Step-21.ckpt.index")
    (only,) = find_model(tmp_path).weights
    assert (only.steps, only.score) == (21, 80.0), "a name's own steps count first"


def test_a_best_one_that_is_not_there_is_none(tmp_path):
    laid_out(tmp_path, "model_metadata.json", "model_1.pb", "model_2.pb")
    (tmp_path / "deepracer_checkpoints.json").write_text(marks((9, 80.0), (2, 60.0)))
    assert find_model(tmp_path).best is None


def test_one_file_has_its_car_beside_it_or_beside_its_folder(tmp_path):
    laid_out(tmp_path, "model_metadata.json", "agent/model.pb", "agent/3_Step-9.ckpt.index", "notes.txt")
    for name in ("agent/model.pb", "agent/3_Step-9.ckpt.index", "agent/3_Step-9.ckpt"):
        model = find_model(tmp_path / name)
        assert model.metadata == tmp_path / "model_metadata.json"
        assert (model.weights[0].iteration, len(model.weights)) == (3 if "3" in name else 0, 1)
    laid_out(tmp_path, "agent/model_metadata.json")
    assert find_model(tmp_path / "agent/model.pb").metadata == tmp_path / "agent/model_metadata.json"
    given = find_model(tmp_path / "agent/model.pb", tmp_path / "model_metadata.json")
    assert given.metadata == tmp_path / "model_metadata.json"
    assert find_model(tmp_path, tmp_path / "agent/model_metadata.json").metadata.parent.name == "agent"


def test_what_is_no_model_is_refused(tmp_path):
    laid_out(tmp_path, "agent/model.pb", "notes.txt")
    for path, words in (
        (tmp_path, "it holds no model_metadata.json"),
        (tmp_path / "agent" / "model.pb", "no model_metadata.json lies beside it"),
        (tmp_path / "notes.txt", "its name is no graph's and no checkpoint's"),
        (tmp_path / "none", "there is no such file or folder"),
        (laid_out(tmp_path / "empty", "notes.txt"), "it holds no weights"),
    ):
        with pytest.raises(ForeignModelError, match=words):
            find_model(path)
    with pytest.raises(MetadataError, match="no.json: there is no such file"):
        find_model(tmp_path / "agent" / "model.pb", tmp_path / "no.json")


def test_a_model_of_awss_is_known_by_its_names(tmp_path):
    laid_out(tmp_path, "g/model.pb", "c/3_Step-9.ckpt.index", "n/notes.txt")
    wanted = {"g": True, "c": True, "n": False, "g/model.pb": True, "c/3_Step-9.ckpt.index": True,
              "c/3_Step-9.ckpt": True, "c/4_Step-9.ckpt": False, "n/notes.txt": False}  # fmt: skip
    assert {name: looks_like_aws_model(tmp_path / name) for name in wanted} == wanted
