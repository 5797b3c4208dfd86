"""A racer's folder as it comes: near names, several of them, none at all."""

import json

import pytest

from racecraft.contract.errors import UserInputError
from racecraft.worlds.deepracer.files.reward_file import default_reward_source
from racecraft.worlds.deepracer.training.model_folder import read_model_folder

METADATA = {
    "action_space": [
        {"steering_angle": a, "speed": v, "index": k} for k, (a, v) in enumerate([(-20, 1), (0, 2), (20, 1)])
    ],
    "sensor": ["FRONT_FACING_CAMERA"],
    "neural_network": "DEEP_CONVOLUTIONAL_NETWORK_SHALLOW",
    "version": "4",
}


def text_of(name):
    return {
        "reward_function.py": default_reward_source(),
        "model_metadata.json": json.dumps(METADATA),
        "hyperparameters.json": '{"lr": 0.0001}',
    }[name]


@pytest.mark.parametrize(
    ("right", "near"),
    [
        ("reward_function.py", "my_fast_idea.py"),
        ("model_metadata.json", "model_metadata (1).json"),
        ("hyperparameters.json", "hyperparamters.json"),
    ],
)
def test_a_file_of_nearly_the_right_name_is_taken_and_told_of(tmp_path, right, near):
    (tmp_path / near).write_text(text_of(right))
    model = read_model_folder(tmp_path)
    assert f"{near}: taken for {right}" in model.notes
    got = {
        "reward_function.py": model.reward is not None,
        "model_metadata.json": len(model.metadata.actions) == 3,
        "hyperparameters.json": model.hyperparameters.lr == 0.0001,
    }
    assert got[right]


@pytest.mark.parametrize("other", ["helper.py", "hyperparameters.yaml"])
def test_a_folder_without_any_of_the_three_is_refused(tmp_path, other):
    (tmp_path / other).write_text("x = 1\n")
    with pytest.raises(
        UserInputError, match="holds none of a racer's files; expected a folder with reward_function.py"
    ):
        read_model_folder(tmp_path)
