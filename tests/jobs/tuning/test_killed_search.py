"""A search that is killed goes on: what its trials learned meanwhile counts. Real processes, real kill -9."""

import json
import os
import random
import signal
import subprocess
import sys
import time

import pytest
from tests.jobs.conftest import home  # noqa: F401 - a fixture
from tests.jobs.makers import wait_until

from racecraft.jobs import submit as submitting
from racecraft.jobs.tuning import training_trials

TRIALS = 2
WORDS = (
    "tune", "--trials", str(TRIALS), "--parallel", "1", "--run", "search",
    "--param", "ppo.learning_rate=1e-4..1e-2:log",
    "--json", "gym", "train", "CartPole-v1", "--no-pictures", "--stop", "iterations=2", "--set", "evaluation.every=1",
    "--set", "evaluation.episodes=1", "--set", "rollout.horizon=16",
)  # fmt: skip


def start(folder):
    command = [sys.executable, "-m", "racecraft", *WORDS]
    return subprocess.Popen(command, cwd=folder, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)


def kill_and_go_on(home, folder, moment):  # noqa: F811
    """Kill the search `moment` s after its first trial's job is there; run the same command again to its end."""
    search = start(folder)
    wait_until(lambda: search.poll() is not None or home.store().jobs())
    time.sleep(moment)
    os.kill(search.pid, signal.SIGKILL)
    search.communicate()
    out, errors = start(folder).communicate(timeout=300)
    result = json.loads(out.splitlines()[-1])
    assert "best" in result, errors
    return json.loads((folder / "search" / "tuning.json").read_text())["trials"]


def test_a_search_that_is_killed_counts_the_trial_that_went_on(home, tmp_path):  # noqa: F811
    trials = kill_and_go_on(home, tmp_path, 0.0)
    assert [one["state"] for one in trials] == ["complete"] * TRIALS
    assert len(home.store().jobs()) == TRIALS, "no trial was started twice"


def test_a_trial_whose_search_was_killed_before_it_started_a_supervisor_gets_one(home, tmp_path, monkeypatch):  # noqa: F811
    started = []
    monkeypatch.setattr(submitting, "ensure_supervisor", lambda home: None)
    monkeypatch.setattr(training_trials, "ensure_supervisor", started.append)
    words = ("gym", "train", "CartPole-v1")
    launch = training_trials.TrainingTrials(tmp_path, words, training_trials.Objective("best_score"), 1, home)
    launch(0, {})
    assert launch.find(0) is not None
    assert started == [home]


@pytest.mark.long
@pytest.mark.parametrize("seed", range(10))
def test_a_search_is_killed_at_random_moments(home, tmp_path, seed):  # noqa: F811
    trials = kill_and_go_on(home, tmp_path, random.Random(seed).uniform(0.0, 12.0))
    complete = [one for one in trials if one["state"] == "complete"]
    assert len(complete) >= TRIALS - 1, "only a trial without a job yet may be lost"
