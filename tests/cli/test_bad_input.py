"""Everything a user may get wrong: exit code 2, a letter with place, finding and cure; nothing lost."""

import json
import os

import numpy as np
import pytest
from tests.cli.conftest import TINY
from tests.forked import ran

from racecraft.formats.run_folder import RunFolder
from racecraft.worlds.deepracer.tracks.catalogue import load_track

REWARD = "def reward_function(params):\n    return 1.0\n"
PAYS_AN_OBJECT = """\
import os, sys
class Pay:
    def __float__(self):
        {}
def reward_function(params):
    return Pay()
"""
METADATA = {
    "action_space": [{"steering_angle": -30, "speed": 0.6}, {"steering_angle": 30, "speed": 0.6}],
    "sensor": ["FRONT_FACING_CAMERA"],
    "neural_network": "DEEP_CONVOLUTIONAL_NETWORK_SHALLOW",
    "version": "5",
}


def folder(tmp_path, **files):
    """Write a racer's folder: keyword names with __ for the dot; texts as they are, other values as JSON."""
    place = tmp_path / "car"
    place.mkdir()
    for name, value in files.items():
        (place / name.replace("__", ".")).write_text(value if isinstance(value, str) else json.dumps(value))
    return place


def route(tmp_path, change=lambda rows: rows):
    path = tmp_path / "mine.npy"
    np.save(path, change(load_track("Oval_track").rows.copy()))
    return path


def with_nan(rows):
    rows[17, 3] = np.nan
    return rows


def changed(**values):
    return {**METADATA, **values}


CASES = {
    # What the letter must hold, and the arguments: a function of the temporary folder.
    "a folder that is not there": (["nowhere", "racecraft new"], lambda t: ["train", "nowhere"]),
    "a file in place of a folder": (
        ["is a file", "expected a folder"],
        lambda t: ["train", (t / "x").write_text("") is None or t / "x"],
    ),
    "an empty reward file": (
        ["reward_function.py", "empty"],
        lambda t: ["train", folder(t, reward_function__py="")],
    ),
    "a reward with a syntax error": (
        ["reward_function.py:2", "valid Python"],
        lambda t: ["train", folder(t, reward_function__py="def reward_function(params):\n    return (\n")],
    ),
    "a reward by another name": (
        ["there is no function `reward_function`", "reward_fuction"],
        lambda t: ["train", folder(t, reward_function__py="def reward_fuction(params):\n    return 1.0\n")],
    ),
    "a reward that wants two arguments": (
        ["reward_function.py:1", "one parameter"],
        lambda t: ["train", folder(t, reward_function__py="def reward_function(a, b):\n    return 1.0\n")],
    ),
    "a reward whose import is missing": (
        ["ModuleNotFoundError", "no_such_package", "Install"],
        lambda t: ["train", folder(t, reward_function__py="import no_such_package\n" + REWARD)],
    ),
    "a reward that raises on tick 20": (
        ["reward_function.py:3", "ZeroDivisionError", "steps = 20"],
        lambda t: [
            "train",
            folder(
                t,
                reward_function__py=(
                    "def reward_function(params):\n    if params['steps'] >= 20:\n        return 1 / 0\n"
                    "    return 1.0\n"
                ),
            ),
        ],
    ),
    "a reward that returns nothing": (
        ["reward_function returned None", "expected a number"],
        lambda t: ["train", folder(t, reward_function__py="def reward_function(params):\n    pass\n")],
    ),
    "a reward whose number leaves the program": (
        ["reward_function.py:4: reward_function raised SystemExit: 0", "Mend this line"],
        lambda t: ["train", folder(t, reward_function__py=PAYS_AN_OBJECT.format("sys.exit(0)"))],
    ),
    "a reward whose number ends its process": (
        ["reward_function.py:5: reward_function's process ended (exit code 0)", "Take out what ends it"],
        lambda t: ["train", folder(t, reward_function__py=PAYS_AN_OBJECT.format("os._exit(0)"))],
    ),
    "a checked reward whose number leaves the program": (
        ["reward_function.py:4: reward_function raised SystemExit: 0", "Mend this line"],
        lambda t: ["check", folder(t, reward_function__py=PAYS_AN_OBJECT.format("sys.exit(0)"))],
    ),
    "a reward that is too large": (
        ["returned 1e+06", "-1e5 to 1e5"],
        lambda t: ["train", folder(t, reward_function__py="def reward_function(params):\n    return 1e6\n")],
    ),
    "metadata that is no JSON": (
        ["model_metadata.json:1", "JSON"],
        lambda t: ["train", folder(t, model_metadata__json="{'action_space': []}")],
    ),
    "an angle that is no number": (
        ["model_metadata.json", "NaN", "steering_angle"],
        lambda t: [
            "train",
            folder(t, model_metadata__json=changed(action_space=[{"steering_angle": "NaN", "speed": 1}] * 2)),
        ],
    ),
    "a misspelt sensor": (
        ["FRONT_FACING_CAMRA", "Did you mean"],
        lambda t: ["train", folder(t, model_metadata__json=changed(sensor=["FRONT_FACING_CAMRA"]))],
    ),
    "SAC for a car with a list of actions": (
        ["--algorithm sac decides numbers", "one choice", "ppo"],
        lambda t: ["train", folder(t, hyperparameters__json={"lr": 0.001}), "--algorithm", "sac"],
    ),
    "a learning rate that is a word": (
        ["hyperparameters.json", "lr", "quick"],
        lambda t: ["train", folder(t, hyperparameters__json={"lr": "quick"})],
    ),
    "an unknown track": (["Did you mean 'reinvent_base'"], lambda t: ["train", "--track", "reinvent_bas"]),
    "a waypoint with NaN": (["mine.npy", "row 17"], lambda t: ["train", "--track", route(t, with_nan)]),
    "an unknown car": (["v5", "v4"], lambda t: ["train", "--car", "v5"]),
    "an unknown stop": (["Did you mean 'minutes'"], lambda t: ["train", "--stop", "minuts=3"]),
    "no time at all": (["a number above 0 after 'minutes='"], lambda t: ["train", "--stop", "minutes=0"]),
    "a misspelt setting": (["rollout has no setting 'horizn'"], lambda t: ["train", "--set", "rollout.horizn=3"]),
    "a setting without its group": (
        ["Did you mean 'ppo.learning_rate'"],
        lambda t: ["train", "--set", "learning_rate=1"],
    ),
    "a setting out of range": (["race.start_advance", "0 to 1"], lambda t: ["train", "--set", "race.start_advance=7"]),
    "a frame too small for the network": (
        ["finds no room"],
        lambda t: ["train", "--set", "camera.width=8", "--set", "camera.height=6", "--set", "network.conv_kernels=7,7"],
    ),
    "a run folder with other things in it": (
        ["no run", "Give another"],
        lambda t: ["train", "--run", folder(t, notes__txt="mine")],
    ),
    "a run folder that is a file": (
        ["a file stands in its place"],
        lambda t: ["train", "--run", (t / "r").write_text("") is None or t / "r"],
    ),
    "resuming nothing": (["--resume needs --run"], lambda t: ["train", "--resume"]),
    "resuming with another seed": (
        ["--seed cannot change"],
        lambda t: ["train", "--resume", "--run", "x", "--seed", "3"],
    ),
    "cloning from nowhere": (["there is no such folder"], lambda t: ["train", "--from", "runs/none:best"]),
    "a new model where something stands": (
        ["is not empty"],
        lambda t: ["new", folder(t, reward_function__py=REWARD)],
    ),
    "an unknown Gymnasium id": (["CartPole-v7"], lambda t: ["gym", "train", "CartPole-v7"]),
    "an unknown option": (
        ["racecraft: `racecraft train` has no option '--trak'. Did you mean '--track'?"],
        lambda t: ["train", "--trak", "x"],
    ),
    "an unknown command": (["has no command 'wach'. Did you mean 'watch'?"], lambda t: ["wach"]),
    "a group without a command": (["`racecraft dr` has no command", "update-env"], lambda t: ["dr", "--folder", t]),
}


@pytest.mark.parametrize("name", CASES)
def test_the_letter_says_where_and_what(name, racecraft, tmp_path):
    wanted, arguments = CASES[name]
    given = arguments(tmp_path)
    if given[0] == "train" and "stop" not in name and "resum" not in name:
        given += ["--stop", "iterations=5", "--no-pictures"]  # a case that is not refused shall end soon
    said = racecraft(*given, *(TINY if name.startswith("a reward") else ()))
    assert said.code == 2, said.err
    assert "Traceback" not in said.err
    for part in wanted:
        assert part in " ".join(said.err.split()), said.err


def test_a_reward_that_ends_its_process_is_told_by_the_check(tmp_path):
    """In a process of the test's own, which the reward shall not end."""
    car = folder(tmp_path, reward_function__py=PAYS_AN_OBJECT.format("os._exit(0)"))
    ended = ran(["check", car], tmp_path)
    assert ended.returncode == 2, ended.stderr
    assert "reward_function.py:5: reward_function's process ended (exit code 0)" in ended.stderr
    assert "Traceback" not in ended.stderr


def test_what_was_trained_before_a_reward_failed_is_kept(racecraft, tmp_path):
    """The reward counts a car's calls in a global and raises in the third iteration; two iterations stay usable."""
    source = (
        "calls = 0\n\n\ndef reward_function(params):\n    global calls\n    calls += 1\n"
        "    if calls > 40:\n        raise ValueError('enough')\n    return 1.0\n"
    )
    said = racecraft(
        "train", folder(tmp_path, reward_function__py=source), "--run", "r", "--stop", "iterations=9", *TINY
    )
    assert said.code == 2
    assert "reward_function.py:8" in said.err
    assert len(RunFolder.open("r").read_metrics()) >= 1
    judged = racecraft("evaluate", "r", "--checkpoint", "last", "--laps", "1", "--json")
    assert judged.code == 0, judged.err
    assert json.loads(judged.out)["checkpoint"] >= 1


def test_two_trainings_cannot_share_a_folder(racecraft, run):
    again = racecraft("train", "--run", "r", "--stop", "iterations=1", *TINY)
    assert again.code == 2
    assert "a run stands here already" in again.err
    with RunFolder.open("r").lock():
        taken = racecraft("train", "--run", "r", "--resume", "--stop", "iterations=2")
    assert taken.code == 2
    assert "another training holds it" in taken.err


@pytest.mark.skipif(not hasattr(os, "geteuid") or os.geteuid() == 0, reason="root may write everywhere")
def test_a_place_one_may_not_write_to_is_said(racecraft, tmp_path):
    closed = tmp_path / "closed"
    closed.mkdir(mode=0o500)
    said = racecraft("train", "--run", closed / "r", *TINY)
    assert said.code == 2
    assert "cannot be written" in said.err
