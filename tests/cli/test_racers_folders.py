"""What a racer's folder and its run.env come to on the command line."""

import io
import json
import tarfile
from functools import reduce

import numpy as np
import pytest
from tests.cli.conftest import TINY

from racecraft.formats.checkpoint import Checkpoints
from racecraft.formats.run_folder import RunFolder

METADATA = {
    "sensor": ["FRONT_FACING_CAMERA"],
    "neural_network": "DEEP_CONVOLUTIONAL_NETWORK_SHALLOW",
    "version": "4",
}
SHORT = ("--stop", "iterations=1", "--no-pictures", *TINY)


def test_an_empty_folder_does_not_train_in_silence(racecraft, tmp_path):
    (tmp_path / "empty").mkdir()
    said = racecraft("train", "empty", "--stop", "iterations=1")
    assert (said.code, "holds none of a racer's files" in said.err) == (2, True)
    assert not (tmp_path / "runs").exists()


REWARD = "def reward_function(params):\n    return 1.0\n"
CLUB = {
    "club/reward_function.py": REWARD,
    "club/model/model_metadata.json": json.dumps({**METADATA, "action_space": [{"steering_angle": 0, "speed": 1}] * 2}),
}


def packed(path, files):
    """Write a tar of texts by name."""
    with tarfile.open(path, "w") as archive:
        for name, text in files.items():
            member = tarfile.TarInfo(name)
            member.size = len(text.encode())
            archive.addfile(member, io.BytesIO(text.encode()))


def test_files_without_weights_become_a_folder_that_can_be_trained(racecraft, tmp_path):
    packed(tmp_path / "club.tar", {**CLUB, "club/metrics/TrainingMetrics.json": '{"metrics": []}'})
    refused = racecraft("import", "club.tar", "r")
    assert (refused.code, "holds no weights" in refused.err, "racecraft new FOLDER --files" in refused.err) == (
        2,
        True,
        True,
    )
    made = json.loads(racecraft("new", "car", "--files", "club.tar", "--json").out)
    assert (made["files"], made["has_logs"]) == (["reward_function.py", "model_metadata.json"], True)
    assert "no hyperparameters.json: the preset's values" in made["notes"]
    assert (tmp_path / "car" / "reward_function.py").read_text() == REWARD
    assert len(json.loads((tmp_path / "car" / "model_metadata.json").read_text())["action_space"]) == 2
    (tmp_path / "mine.py").write_text(REWARD)
    alone = json.loads(racecraft("new", "alone", "--files", "mine.py", "--json").out)
    assert (alone["files"], alone["has_logs"]) == (["reward_function.py"], False)


FILES = {
    "no reward function": ({"club/hyperparameters.json": "{}"}, "club.tar: it holds no reward_function.py"),
    "a damaged file": ({**CLUB, "club/hyperparameters.json": "{"}, "club.tar: club/hyperparameters.json:1"),
    "nothing of a racer's": ({"club/notes.txt": "x"}, "it holds no file of a model"),
}


@pytest.mark.parametrize("name", FILES)
def test_files_that_cannot_be_taken_are_named_and_leave_nothing(racecraft, tmp_path, name):
    packed(tmp_path / "club.tar", FILES[name][0])
    refused = racecraft("new", "car", "--files", "club.tar")
    assert (refused.code, FILES[name][1] in refused.err) == (2, True), refused.err
    assert not (tmp_path / "car").exists()


def car_with(tmp_path, name, *actions):
    folder = tmp_path / name
    folder.mkdir()
    space = [{"steering_angle": angle, "speed": speed} for angle, speed in actions]
    (folder / "model_metadata.json").write_text(json.dumps({**METADATA, "action_space": space}))
    return folder


def test_a_clone_may_have_other_speeds_and_angles_and_not_another_number_of_them(racecraft, tmp_path):
    slow = car_with(tmp_path, "slow", (-20, 1), (0, 1), (20, 1))
    fast = car_with(tmp_path, "fast", (-20, 1), (0, 2.5), (15, 1.5))
    more = car_with(tmp_path, "more", (-20, 1), (-10, 1), (0, 1), (20, 1))
    assert racecraft("train", slow, "--run", "a", *SHORT).code == 0
    cloned = racecraft("train", fast, "--from", "a:last", "--run", "b", *SHORT)
    assert cloned.code == 0, cloned.err
    told = (
        "2 of 3 actions differ from those the weights were trained with: action 1 was 0° at 1 m/s and is 0° at 2.5 m/s"
    )
    assert told in cloned.out
    assert told in (tmp_path / "b" / "log.txt").read_text()
    begun, lent = (
        Checkpoints(tmp_path / run / "checkpoints").load_policy(at)[0] for run, at in (("b", "0"), ("a", "last"))
    )
    assert all(np.array_equal(begun[name], lent[name]) for name in lent)
    refused = racecraft("train", more, "--from", "a", "--run", "c", *SHORT)
    assert refused.code == 2
    assert (
        "was trained with a list of 3 actions, now there is a list of 4 actions; expected the same kind" in refused.err
    )


OUTWEIGHED = {  # variable: (its value, what is typed, where job.json says what came of it, what it says)
    "DR_WORLD_NAME": ("Oval_track", ("--track", "Bowtie_track"), "track.name", "Bowtie_track"),
    "DR_TRAIN_REVERSE_DIRECTION": ("True", ("--set", "race.reverse=false"), "settings.race.reverse", False),
    "DR_TRAIN_MIN_EVAL_TRIALS": ("3", ("--set", "evaluation.episodes=2"), "settings.evaluation.episodes", 2),
    "RACECRAFT_SET": ("race.reverse=true", ("--set", "race.reverse=false"), "settings.race.reverse", False),
    "RACECRAFT_STOP": ("steps=100", ("--stop", "iterations=1"), "asked.stops", ["iterations=1"]),
    "DR_LOCAL_S3_PRETRAINED": ("True", ("--from", "old:0"), "asked.from", "old:0"),
    "DR_LOCAL_S3_PRETRAINED_PREFIX": ("nowhere", ("--from", "old:0"), "asked.from", "old:0"),
    "DR_LOCAL_S3_PRETRAINED_CHECKPOINT": ("best", ("--from", "old:0"), "asked.from", "old:0"),
}  # fmt: skip


@pytest.fixture
def old(run, tmp_path):
    run.rename(tmp_path / "old")


def test_the_command_line_outweighs_run_env(racecraft, tmp_path, old):
    (tmp_path / "car").mkdir()
    lines = [f"{name}={value}\n" for name, (value, *_) in OUTWEIGHED.items()]
    (tmp_path / "car" / "run.env").write_text("".join(lines))
    typed = dict.fromkeys(typed for _, typed, *_ in OUTWEIGHED.values())
    words = [word for pair in typed for word in pair]
    said = racecraft("train", "car", "--run", "new", "--no-pictures", *TINY, *words)
    assert said.code == 0, said.err
    job = RunFolder.open("new").read_job()
    found = {name: reduce(dict.__getitem__, place.split("."), job) for name, (_, _, place, _) in OUTWEIGHED.items()}
    assert found == {name: expected for name, (*_, expected) in OUTWEIGHED.items()}


def test_a_film_of_another_kind_is_refused_before_the_drive(racecraft, old, monkeypatch):
    def drive(*_):
        raise AssertionError("it drove")

    monkeypatch.setattr("racecraft.worlds.deepracer.analysis.judged_drive.drive_laps", drive)
    said = racecraft("evaluate", "old", "--video", "x.gif")
    assert (said.code, "expected a name that ends in .mp4" in said.err) == (2, True)


ENDLESS = """
def reward_function(params):
    while True:
        try:
            len(params)
        except:
            pass
"""


def test_a_reward_that_hangs_ends_the_training_with_its_line(racecraft, tmp_path):
    (tmp_path / "car").mkdir()
    (tmp_path / "car" / "reward.py").write_text(ENDLESS)
    said = racecraft("train", "car", "--run", "r", *SHORT, "--set", "race.reward_seconds=0.2")
    assert said.code == 2
    assert "reward_function had not returned after 0.2 s; expected a number. Mend the loop" in said.err
    assert f"{'reward.py'}:" in said.err


def test_minutes_end_an_iteration_that_a_slow_reward_draws_out(racecraft, tmp_path):
    """An iteration of 4 cars and 10,000 ticks at 10 ms a call would last 400 s; the stop is 0.6 s."""
    (tmp_path / "car").mkdir()
    (tmp_path / "car" / "reward_function.py").write_text(
        "import time\ndef reward_function(params):\n    time.sleep(0.01)\n    return 1.0\n"
    )
    typed = ("--run", "r", "--no-pictures", "--json", *TINY, "--set", "rollout.horizon=10000", "--stop", "minutes=0.01")
    said = racecraft("train", "car", *typed)
    assert said.code == 0, said.err
    told = json.loads(said.out)
    assert (told["stopped_by"], told["iterations"]) == ("minutes=0.01", 0)


def test_a_reward_that_fails_at_once_is_not_said_to_have_taught_anything(racecraft, tmp_path):
    folder = tmp_path / "car"
    folder.mkdir()
    (folder / "reward_function.py").write_text("def reward_function(params):\n    return params['speeed']\n")
    said = racecraft("train", folder, "--run", "my runs/a", *SHORT)
    assert said.code == 2
    assert "nothing was learned yet; --run 'my runs/a' --resume begins again with the files that stand" in said.out
    (tmp_path / "my runs/a/reward_function.py").write_text("def reward_function(params):\n    return 1.0\n")
    again = racecraft("train", "--run", "my runs/a", "--resume", "--no-pictures")
    assert again.code == 0, again.err
