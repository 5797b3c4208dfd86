"""Real Ray, real processes, real kills: on one machine, with several nodes where a test says so.

Ray is an extra; without it these are skipped (`pip install 'racecraft[cluster]'`).
"""

import json
import os
import random
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from tests.cluster.test_spread_training import assert_same, curve
from tests.cluster.workers_here import spread_here

from racecraft.training.callbacks import NullCallback
from racecraft.training.worlds import resume, train
from racecraft.worlds.gymnasium.training.trainer import GymRequest

pytest.importorskip("ray", reason="needs ray: pip install 'racecraft[cluster]'")

PATIENCE = 240.0
"""Seconds that anything may take on a machine with much else to do."""
SMALL = (
    "rollout.num_worlds=4",
    "rollout.horizon=256",
    "evaluation.every=5",
    "evaluation.episodes=2",
    "network.hidden_units=8",
)
ITERATIONS = 30
RAYS_OWN = ("raylet", "gcs_server", "ray::", "ray._private", "ray/_private")


def words(run, cluster, iterations=ITERATIONS, more=(), algorithm="ppo"):
    asked = [f"--algorithm={algorithm}", f"--cluster={cluster}", f"--run={run}", f"--stop=iterations={iterations}"]
    settings = [word for one in (*SMALL, *more) for word in ("--set", one)]
    return [sys.executable, "-m", "racecraft", "gym", "train", "CartPole-v1", *asked, *settings]


def begin(run, cluster, iterations=ITERATIONS, more=(), algorithm="ppo"):
    """Start `racecraft gym train --cluster` in a session of its own; what it says goes beside the run."""
    with run.with_suffix(".log").open("w") as log:
        return subprocess.Popen(
            words(run, cluster, iterations, more, algorithm), stdout=log, stderr=log, start_new_session=True
        )


def until(holds, what):
    end = time.monotonic() + PATIENCE
    while not holds():
        assert time.monotonic() < end, f"{what} did not happen within {PATIENCE:.0f} s"
        time.sleep(0.05)


def iterations(run):
    file = run / "metrics.jsonl"
    return len(file.read_text().splitlines()) if file.exists() else 0


def processes(sessions):
    """Yield (pid, command) of every process of Ray that lives in some sessions; others on this machine are not ours."""
    for place in Path("/proc").glob("[0-9]*"):
        try:
            told, stat = (place / "cmdline").read_bytes(), (place / "stat").read_text()
        except OSError:
            continue
        state, _, _, session = stat.rpartition(")")[2].split()[:4]
        command = told.replace(b"\0", b" ").decode(errors="replace")
        if state != "Z" and int(session) in sessions and any(name in command for name in RAYS_OWN):
            yield int(place.name), command


def are_gone(*sessions):
    return not list(processes(sessions))


def workers(session):
    return [pid for pid, command in processes({session}) if "ray::Worker" in command]


@pytest.fixture
def undisturbed(tmp_path):
    """Return a run whose two workers never met with anything."""
    run = tmp_path / "undisturbed"
    stops = (f"iterations={ITERATIONS}",)
    train(
        GymRequest("CartPole-v1", run=run, stops=stops, overrides=SMALL),
        NullCallback(),
        lambda text: None,
        spread_here(2)[0],
    )
    return run


def end_after_kills(training, run, moments, most_seconds, seed):
    """Kill a worker a little after each of these iterations, and let the training come to its end."""
    chance, killed = random.Random(seed), 0
    try:
        for at in moments:
            until(lambda at=at: iterations(run) >= at or training.poll() is not None, f"iteration {at}")
            time.sleep(chance.uniform(0.0, most_seconds))
            if theirs := workers(training.pid):
                os.kill(chance.choice(theirs), signal.SIGKILL)
                killed += 1
        assert training.wait(PATIENCE) == 0, run.with_suffix(".log").read_text()
    finally:
        training.kill()
    assert killed == len(moments)
    assert run.with_suffix(".log").read_text().count("was lost") >= 1
    until(lambda: are_gone(training.pid), "the end of every process")


def test_workers_killed_at_random_moments_lose_no_update(tmp_path, undisturbed):
    run = tmp_path / "run"
    end_after_kills(begin(run, 2), run, (3, 9, 16), most_seconds=0.1, seed=7)
    assert_same(undisturbed, run)


@pytest.mark.parametrize("how", [signal.SIGINT, signal.SIGKILL])
def test_a_head_that_is_ended_leaves_no_process_and_goes_on_to_the_same_curve(tmp_path, undisturbed, how):
    run = tmp_path / "run"
    training = begin(run, 2)
    until(lambda: iterations(run) >= 4 or training.poll() is not None, "iteration 4")
    if how == signal.SIGINT:
        os.killpg(training.pid, how)  # as a terminal does
    else:
        training.kill()
    training.wait(PATIENCE)
    until(lambda: are_gone(training.pid), "the end of every process")
    assert iterations(run) < ITERATIONS
    resume(run, (f"iterations={ITERATIONS}",), NullCallback(), lambda text: None, spread=spread_here(2)[0])
    assert [row for row in curve(run) if row["evaluation_score"] is None or row["iteration"] % 5 == 0]
    assert_same_but_for_the_last_look(undisturbed, run)


def assert_same_but_for_the_last_look(one, other):
    """Compare what was learned: Ctrl-C may have been answered with an evaluation out of turn."""
    learned = ("iteration", "steps", "mean_reward", "policy_loss", "value_loss", "entropy")
    assert [[row[name] for name in learned] for row in curve(one)] == [
        [row[name] for name in learned] for row in curve(other)
    ]


@pytest.mark.long
def test_apex_learns_on_when_its_workers_are_killed(tmp_path):
    """Its learner works beside the worlds, so no curve is the same twice; but it goes on, and beats chance."""
    run = tmp_path / "run"
    apex = ("rollout.num_worlds=8", "rollout.horizon=32", "network.hidden_units=128,128", "evaluation.episodes=10")
    training = begin(run, 2, 60, ("evaluation.every=10", *apex), "apex")
    end_after_kills(training, run, (10, 25, 40), most_seconds=0.5, seed=5)
    rows = curve(run)
    assert [row["iteration"] for row in rows] == list(range(1, 61))
    assert [row["steps"] for row in rows] == [256 * row["iteration"] for row in rows], "nothing is lost or doubled"
    late = [row["evaluation_score"] for row in rows[19:] if row["evaluation_score"] is not None]
    assert max(late) > 40.0, "chance stands for some 20 ticks, and a policy of no choice for 10"


def test_a_node_that_fails_is_made_up_for_by_the_others(tmp_path, undisturbed):
    from ray.cluster_utils import Cluster

    run = tmp_path / "run"
    cluster = Cluster(initialize_head=True, head_node_args={"num_cpus": 0, "include_dashboard": False})
    training = None
    try:
        nodes = [cluster.add_node(num_cpus=1) for _ in range(2)]
        asked = f"2@{cluster.address}"
        training = begin(run, asked)
        until(lambda: iterations(run) >= 4 or training.poll() is not None, "iteration 4")
        cluster.remove_node(nodes[0], allow_graceful=False)
        assert training.wait(PATIENCE) == 0, run.with_suffix(".log").read_text()
    finally:
        if training is not None:
            training.kill()
        cluster.shutdown()
    assert "was lost" in run.with_suffix(".log").read_text()
    assert json.loads((run / "job.json").read_text())["cluster"] == {"asked": asked, "workers": 2, "machines": 1}
    assert_same(undisturbed, run)
    until(lambda: are_gone(training.pid, os.getsid(0)), "the end of every process")


def test_a_cluster_that_does_not_stand_is_named(tmp_path):
    told = subprocess.run(words(tmp_path / "run", "127.0.0.1:1"), capture_output=True, text=True, timeout=PATIENCE)
    assert told.returncode == 2
    assert "no Ray cluster answers at 127.0.0.1:1" in told.stderr
    assert not (tmp_path / "run").exists()


FAILS = """\
import gymnasium, numpy as np


class Maze(gymnasium.Env):
    observation_space = gymnasium.spaces.Box(-1, 1, (3,), np.float32)
    action_space = gymnasium.spaces.Discrete(2)
    ticks = 0

    def reset(self, *, seed=None, options=None):
        return np.zeros(3, np.float32), {}

    def step(self, action):
        Maze.ticks += 1
        return np.zeros(3, np.float32), 1.0, self.ends[Maze.ticks], False, {}

    ends = [True] * 2000
"""


def test_a_token_that_is_missing_is_named(tmp_path, monkeypatch):
    monkeypatch.setenv("RAY_AUTH_MODE", "token")
    monkeypatch.setenv("HOME", str(tmp_path))
    monkeypatch.delenv("RAY_AUTH_TOKEN", raising=False)
    done = subprocess.run(words(tmp_path / "run", "1@127.0.0.1:6390"), capture_output=True, text=True, check=False)
    assert done.returncode == 2
    assert "Ray's token is missing" in done.stderr
    assert "Traceback" not in done.stderr


def test_an_environment_that_raises_at_a_worker_is_told_with_its_line_and_nothing_goes_on(tmp_path):
    (tmp_path / "maze_that_fails.py").write_text(FAILS)
    asked = [word.replace("CartPole-v1", "maze_that_fails:Maze") for word in words(tmp_path / "run", 2)]
    training = subprocess.Popen(
        asked, cwd=tmp_path, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, start_new_session=True
    )
    try:
        said, _ = training.communicate(timeout=PATIENCE)
    finally:
        training.kill()
    assert training.returncode == 2, said
    assert "maze_that_fails.py:14: Maze.step raised IndexError: list index out of range" in said
    assert "what was learned until then stands in" in said
    assert iterations(tmp_path / "run") == 3
    until(lambda: are_gone(training.pid), "the end of every process")
