"""Which files of a folder are a racer's three, by names that are nearly right."""

import pytest

from racecraft.contract.errors import UserInputError
from racecraft.worlds.deepracer.files.racer_files import find_racer_files

REWARD, METADATA, HYPERPARAMETERS = "reward_function.py", "model_metadata.json", "hyperparameters.json"
PAYS = "import math\ndef reward_function(params):\n    return 1.0\n"

NEAR = {
    REWARD: ["reward_function (1).py", "Reward-Function.PY", "reward_function.txt", "reward_funtion.py", "idea.py"],
    METADATA: ["model_metadata copy 2.json", "action_space.json", "model_metada.json"],
    HYPERPARAMETERS: ["hyperparameters .json.txt", "hyperparams.json"],
}


def files_in(folder, *names, text=PAYS):
    for name in names:
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text(text)
    return find_racer_files(folder)


@pytest.mark.parametrize(("right", "near"), [(right, near) for right, names in NEAR.items() for near in names])
def test_a_file_of_nearly_the_name_is_taken_and_told_of(tmp_path, right, near):
    found = files_in(tmp_path, near)
    wanted = {right: tmp_path / near}
    assert found.reward == wanted.get(REWARD)
    assert found.metadata == wanted.get(METADATA)
    assert found.hyperparameters == wanted.get(HYPERPARAMETERS)
    assert (found.notes, found.is_empty) == ((f"{near}: taken for {right}",), False)


@pytest.mark.parametrize("other", ["reward_function.md", "idea.py.txt", "waypoints.json"])
def test_another_file_is_none_of_them(tmp_path, other):
    found = files_in(tmp_path, other)
    assert (found.notes, found.is_empty) == ((), True)


def test_a_python_file_is_a_reward_only_where_it_defines_one(tmp_path):
    assert files_in(tmp_path, "idea.py", text="# def reward_function(params):\n").is_empty


def test_a_folder_of_such_a_name_is_no_file(tmp_path):
    (tmp_path / "reward.py").mkdir()
    assert find_racer_files(tmp_path).is_empty


@pytest.mark.parametrize(
    ("name", "part"),
    [(REWARD, "reward"), (f"model/{METADATA}", "metadata"), (f"ip/{HYPERPARAMETERS}", "hyperparameters")],
)
def test_a_right_name_is_taken_without_a_word(tmp_path, name, part):
    found = files_in(tmp_path, name)
    assert getattr(found, part) == tmp_path / name
    assert [getattr(found, other) for other in {"reward", "metadata", "hyperparameters"} - {part}] == [None, None]
    assert (found.notes, found.is_empty) == ((), False)


def test_beside_the_right_name_copies_are_told_of_and_others_are_not(tmp_path):
    found = files_in(tmp_path, REWARD, "reward_function (1).py", "reward.py", f"ip/{HYPERPARAMETERS}",
                     "hyperparameters (2).json")  # fmt: skip
    assert found.reward == tmp_path / REWARD
    assert found.notes == (
        "reward_function (1).py: not used, reward_function.py is",
        "hyperparameters (2).json: not used, ip/hyperparameters.json is",
    )


def test_of_two_that_may_be_meant_neither_is(tmp_path):
    with pytest.raises(UserInputError, match=r"holds no reward_function.py but 'idea\.py' and 'reward\.py'; expected"):
        files_in(tmp_path, "reward.py", "idea.py")
