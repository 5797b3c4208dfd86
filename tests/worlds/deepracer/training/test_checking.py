"""All faults of a racer's folder at once, each with what to do about it."""

import json
import sys

import pytest

from racecraft.contract.errors import RewardError, SeveralFaultsError, UserInputError
from racecraft.worlds.deepracer.files.model_metadata import MAX_ACTIONS, read_model_metadata
from racecraft.worlds.deepracer.training.checking import check_folder

METADATA = {
    "action_space": [{"steering_angle": angle, "speed": 1} for angle in (-20, 0, 20)],
    "sensor": ["FRONT_FACING_CAMERA"],
    "neural_network": "DEEP_CONVOLUTIONAL_NETWORK_SHALLOW",
    "version": "5",
}
REWARD = "def reward_function(params):\n"


def lay(folder, **files):
    for name, content in files.items():
        ends = {"reward_function": ".py", "run": ".env"}
        path = folder / f"{name}{ends.get(name, '.json')}"
        path.write_bytes(content if isinstance(content, bytes) else content.encode())


def faults_of(folder):
    with pytest.raises(UserInputError) as caught:
        check_folder(folder)
    return [str(fault) for fault in getattr(caught.value, "faults", [caught.value])]


def test_every_fault_of_every_file_is_in_one_error(tmp_path):
    broken = {**METADATA, "sensor": ["RADAR"], "version": "9"}
    broken["action_space"] = [{"steering_angle": "left", "speed": 1}, {"steering_angle": 0}, *METADATA["action_space"]]
    lay(
        tmp_path,
        run="DR_RACE_TYPE=NOPE\nDR_CAR_COLOR=Mauve\nDR_WORLD_NAME Oval\nDR_EVAL_NUMBER_OF_TRIALS=2.5\n"
        "DR_WORLD_NAME=Ovaltrak\nDR_LOCAL_S3_PRETRAINED=True\nDR_LOCAL_S3_PRETRAINED_PREFIX=gone\n"
        "DR_TRAIN_MIN_EVAL_TRIALS='3\n",
        reward_function="def reward_function(params)\n    return 1\n",
        hyperparameters='{"lr": "fast",\n "batch_size": -3, "num_epochs": 4}',
        model_metadata=json.dumps(broken, indent=1),
    )
    told = faults_of(tmp_path)
    expected = (*(f"run.env:{line}:" for line in (1, 2, 3, 4, 5, 7, 8)), "reward_function.py:1",
                "action_space[0].steering_angle", "action_space[1]", "'RADAR'", "version",
                "json:1: lr", "json:2: batch_size")  # fmt: skip
    assert len(told) == len(expected)
    for one in expected:
        assert any(one in fault for fault in told), one


def test_a_reward_that_fails_is_told_beside_a_faulty_value(tmp_path):
    lay(tmp_path, reward_function="def reward_function(params):\n    return 1 / 0\n", hyperparameters='{"lr": 9}')
    told = faults_of(tmp_path)
    assert len(told) == 2
    assert "reward_function.py:2: reward_function raised ZeroDivisionError" in told[1]


def test_a_sound_folder_trains_nothing_and_leaves_nothing(tmp_path):
    lay(tmp_path, reward_function="def reward_function(params):\n    return params['speed']\n")
    checked = check_folder(tmp_path)
    assert checked.plan.track.name == "reinvent_base"
    assert checked.rewards["on the way"] == 2.0
    assert [path.name for path in tmp_path.iterdir()] == ["reward_function.py"]


@pytest.mark.skipif(sys.platform != "linux", reason="reward functions are limited by Linux's kernel")
def test_a_reward_is_checked_with_the_rights_that_its_training_gives_it(tmp_path):
    folder, secret = tmp_path / "car", tmp_path / "secret"
    folder.mkdir()
    secret.write_text("3")
    lay(folder, reward_function=f"def reward_function(params):\n    return float(open({str(secret)!r}).read())\n")
    with pytest.raises(RewardError, match=r"reward_function\.py:2: .*secret"):
        check_folder(folder)
    assert check_folder(folder, trust_reward=True).rewards["on the way"] == 3.0


@pytest.mark.parametrize(
    ("name", "content", "hint"),
    [
        ("reward_function", f"{REWARD}    # Größe\n    return 1\n".encode("latin-1"), "Save it as UTF-8."),
        ("reward_function", f"{REWARD}    return params[‘speed’]\n", "Type ' instead of ‘."),
        ("reward_function", f"{REWARD}\u00a0   return 1\n", "Type an ordinary space"),
        ("reward_function", "<html><body>404</body></html>", "a web page (HTML)"),
        ("hyperparameters", '{"lr”: 0.001}', 'Type " instead of ”.'),
        ("hyperparameters", '{"lr": 0.001, <!-- slow -->\n "num_epochs": 4}', "JSON has none"),
        ("model_metadata", b"", "Download it again"),
    ],
)  # fmt: skip
def test_a_fault_says_what_to_do(tmp_path, name, content, hint):
    lay(tmp_path, **{name: content})
    (told,) = faults_of(tmp_path)
    assert hint in told


def test_comments_are_passed_over_with_what_to_do_for_aws(tmp_path):
    lay(tmp_path, hyperparameters='# mine\n{"lr": 0.001, // it\'s slow\n "num_epochs": 4 /* "x" */ }')
    notes = check_folder(tmp_path).plan.notes
    assert "hyperparameters.json: comments were passed over; take them out for AWS, which reads none" in notes


@pytest.mark.parametrize(
    ("typed", "meant"), [("front_camera", "FRONT_FACING_CAMERA"), ("STEREO_CAMERA", "STEREO_CAMERAS")]
)
def test_other_names_of_a_sensor_are_read_as_it_and_told(tmp_path, typed, meant):
    lay(tmp_path, model_metadata=json.dumps({**METADATA, "sensor": [typed]}))
    metadata = read_model_metadata(tmp_path / "model_metadata.json")
    assert metadata.sensors == (meant,)
    assert f"sensor '{typed}' is read as '{meant}'" in metadata.notes


def test_a_hundred_thousand_actions_are_refused_in_a_line(tmp_path):
    many = [{"steering_angle": "x", "speed": 1}] * 100_000
    lay(tmp_path, model_metadata=json.dumps({**METADATA, "action_space": many}))
    (told,) = faults_of(tmp_path)
    assert f"100000 actions; expected 2 to {MAX_ACTIONS:,}" in told


def test_many_faults_are_cut_short(tmp_path):
    many = [{"steering_angle": "x" * 100_000, "speed": 1}] * 200
    lay(tmp_path, model_metadata=json.dumps({**METADATA, "action_space": many}))
    with pytest.raises(SeveralFaultsError, match="and 180 more") as caught:
        check_folder(tmp_path)
    assert len(str(caught.value)) < 20_000
