"""A run folder that is sent elsewhere, its originals gone: it is judged and goes on, and tells nobody its origin."""

import json
import shutil

import numpy as np
import pytest
from tests.cli.conftest import TINY

from racecraft.worlds.deepracer.tracks.catalogue import load_track

HELPER = "from shapes_here import deep\n\n\ndef pay(params):\n    return 1.0 - deep.far(params)\n"
DEEP = "def far(params):\n    return params['distance_from_center'] / 10\n"
REWARD = """
import racing_helper

calls = 0


def reward_function(params):
    global calls
    calls += 1
    if params["steps"] == 1:
        calls = 0
    return racing_helper.pay(params)
"""


@pytest.fixture
def sent(racecraft, tmp_path, monkeypatch):
    """Train with everything named by absolute paths, move the run, delete the rest; return the run's new place."""
    made = tmp_path / "where-it-was-made"
    car = made / "my-car"
    (car / "shapes_here").mkdir(parents=True)
    (car / "reward_function (1).py").write_text(REWARD)
    (car / "racing_helper.py").write_text(HELPER)
    (car / "shapes_here" / "deep.py").write_text(DEEP)
    (car / "run.env").write_text("DR_CAR_NAMES=x\nDR_CAR_COLOR=Blue\n")
    np.save(made / "garage.npy", load_track("Oval_track").rows * 1.01)
    short = ("--stop", "iterations=1", "--no-pictures", *TINY)
    old = racecraft("train", "--track", made / "garage.npy", "--run", made / "old", *short)
    assert old.code == 0, old.err
    said = racecraft(
        "train", car, "--track", made / "garage.npy", "--run", made / "r", "--stop", "iterations=2", "--from",
        made / "old", *TINY,
    )  # fmt: skip
    assert said.code == 0, said.err
    assert "reward_function (1).py: taken for reward_function.py" in said.out
    assert "`params['steps'] == 1` never holds" in said.out
    there = tmp_path / "elsewhere" / "received"
    there.parent.mkdir()
    shutil.move(made / "r", there)
    shutil.rmtree(made)
    monkeypatch.chdir(there.parent)
    return there


def test_a_run_that_was_sent_is_judged_and_goes_on_and_holds_no_path_of_where_it_was_made(racecraft, sent, tmp_path):
    """Another seed is refused, an equal one is not."""
    again = racecraft("train", "--run", "received", "--resume", "--seed", "2")
    assert (again.code, "--seed cannot change" in again.err) == (2, True)
    judged = racecraft("evaluate", "received", "--laps", "1", "--json")
    assert judged.code == 0, judged.err
    assert json.loads(judged.out)["track"] == "garage"
    resumed = racecraft(
        "train", "--run", "received", "--resume", "--stop", "iterations=3", "--seed", "1", "--no-pictures"
    )
    assert resumed.code == 0, resumed.err
    assert "what the reward function kept between calls starts anew in every car (reward_function.py:2:" in resumed.out
    assert racecraft("report", "received").code == 0
    assert (sent / "shapes_here" / "deep.py").read_text() == DEEP
    telling = [path for path in sent.rglob("*") if path.is_file() and b"where-it-was-made" in path.read_bytes()]
    assert telling == []
    assert str(tmp_path) not in (sent / "job.json").read_text()
