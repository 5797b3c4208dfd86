"""A racer's folder as it comes: near names, several of them, none at all."""

import json

import pytest

from racecraft.contract.errors import UserInputError
from racecraft.worlds.deepracer.files.racer_files import find_racer_files
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

NEAR = {
    "reward_function.py": [
        "reward.py", "reward_function (1).py", "reward-function.py", "Reward_Function.py", "rewardfunction.py",
        "reward_function - Copy.py", "reward_function_v2.py", "reward_function.py.txt", "reward function.py",
        "reward_funtion.py", "my_fast_idea.py", "reward_function", "reward_function.txt",
    ],
    "model_metadata.json": [
        "model_metadata (1).json", "model-metadata.json", "metadata.json", "Model_Metadata.JSON",
        "model_metadata.json.txt", "model_metadata copy 2.json", "model_metada.json",
    ],
    "hyperparameters.json": [
        "hyperparameters .json", "hyperparameters (3).json", "hyperparams.json", "hyper_parameters.json",
        "hyperparameter.json", "hyperparamters.json",
    ],
}  # fmt: skip


def text_of(name):
    return {
        "reward_function.py": default_reward_source(),
        "model_metadata.json": json.dumps(METADATA),
        "hyperparameters.json": '{"lr": 0.0001}',
    }[name]


@pytest.mark.parametrize(("right", "near"), [(right, near) for right, names in NEAR.items() for near in names])
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


@pytest.mark.parametrize(
    "other", ["helper.py", "waypoints.json", "notes.txt", "README.md", "training_params.yaml", "reward_function.md",
             "hyperparameters.yaml"],
)  # fmt: skip
def test_a_folder_without_any_of_the_three_is_refused(tmp_path, other):
    (tmp_path / other).write_text("x = 1\n")
    with pytest.raises(
        UserInputError, match="holds none of a racer's files; expected a folder with reward_function.py"
    ):
        read_model_folder(tmp_path)


def test_of_several_near_names_none_is_guessed(tmp_path):
    for name in ("reward_function (1).py", "reward_function (2).py"):
        (tmp_path / name).write_text(default_reward_source())
    with pytest.raises(UserInputError, match=r"'reward_function \(1\)\.py' and 'reward_function \(2\)\.py'.*Rename"):
        find_racer_files(tmp_path)


def test_the_right_name_goes_first_and_a_newer_copy_beside_it_is_named(tmp_path):
    for name in ("reward_function.py", "reward_function (1).py", "reward.py"):
        (tmp_path / name).write_text(default_reward_source())
    files = find_racer_files(tmp_path)
    assert files.reward == tmp_path / "reward_function.py"
    assert files.notes == ("reward_function (1).py: not used, reward_function.py is",)
