"""Runs in Gymnasium environments and Unity scenes that are broken off and go on; weights of an earlier run."""

import json
import signal
import subprocess
import sys
import time

import gymnasium
import numpy as np
import pytest
import typer
from gymnasium import spaces
from typer.testing import CliRunner

from racecraft.analysis.run_facts import read_facts
from racecraft.analysis.run_summary import request_text
from racecraft.contract.errors import RunFolderError, SettingError
from racecraft.formats.checkpoint import Checkpoints
from racecraft.formats.run_folder import RunFolder
from racecraft.worlds.gymnasium.cli import gym as gym_command
from racecraft.worlds.unity.cli import unity as unity_command

APP = typer.Typer()
APP.add_typer(unity_command.app, name="unity")
APP.add_typer(gym_command.app, name="gym")
TINY = ("--set", "rollout.num_worlds=2", "--set", "rollout.horizon=16", "--set", "evaluation.every=2")
SMALL = (*TINY, "--set", "evaluation.episodes=4", "--set", "network.hidden_units=8")


def racecraft(*words):
    words += ("--no-pictures",)
    result = CliRunner().invoke(APP, [str(word) for word in words], catch_exceptions=False)
    assert result.exit_code == 0, result.output
    return result.output


def curve(run):
    rows = [json.loads(line) for line in (run / "metrics.jsonl").read_text().splitlines()]
    timed = ("seconds", "steps_per_second")
    return [{name: value for name, value in row.items() if not name.startswith(timed)} for row in rows]


def weights(run, which):
    return Checkpoints(run / "checkpoints").load_policy(which)[0]


class Forgetful(gymnasium.Env):
    """Shows numbers that hang on no seed; its episodes last five ticks."""

    observation_space = spaces.Box(-1, 1, (2,), np.float32)
    action_space = spaces.Discrete(2)
    chance = np.random.default_rng(0)

    def reset(self, *, seed=None, options=None):
        self.tick = 0
        return self._seen(), {}

    def step(self, action):
        self.tick += 1
        return self._seen(), float(action), self.tick == 5, False, {}

    def _seen(self):
        return self.chance.uniform(-1, 1, 2).astype(np.float32)


@pytest.fixture
def forgetful():
    gymnasium.register("Forgetful-v0", Forgetful)
    yield "Forgetful-v0"
    del gymnasium.registry["Forgetful-v0"]


AVERAGED = ("--set", "evaluation.averaged=0.5")


@pytest.mark.parametrize(
    "more",
    [
        (),
        ("--set", "ppo.asynchronous=true"),
        ("--set", "ppo.asynchronous=true", *AVERAGED),
        (*AVERAGED, "--set", "network.stack_size=2"),
    ],
)
def test_a_gymnasium_run_goes_on_to_the_same_curve(tmp_path, more):
    whole, broken = tmp_path / "whole", tmp_path / "broken"
    racecraft("gym", "train", "CartPole-v1", "--run", whole, "--stop", "iterations=6", *SMALL, *more)
    racecraft("gym", "train", "CartPole-v1", "--run", broken, "--stop", "iterations=3", *SMALL, *more)
    said = racecraft("gym", "train", "--run", broken, "--resume", "--stop", "iterations=6")
    assert "goes on after iteration 3\n" in said
    rows = curve(broken)
    assert rows[2]["evaluation_score"] is not None, "no training ends unjudged"
    rows[2]["evaluation_score"] = None
    assert rows == curve(whole)
    for name, array in weights(whole, "last").items():
        np.testing.assert_array_equal(weights(broken, "last")[name], array)


@pytest.mark.parametrize("more", [(), ("--set", "replay.prioritised=true", "--set", "dqn.n_step=3", *AVERAGED)])
def test_a_run_that_learns_from_a_small_replay_goes_on_bit_by_bit(tmp_path, more):
    words = ("gym", "train", "CartPole-v1", "--algorithm", "dqn", "--set", "replay.learning_starts=40", *SMALL, *more)
    whole, broken = tmp_path / "whole", tmp_path / "broken"
    racecraft(*words, "--run", whole, "--stop", "iterations=6")
    racecraft(*words, "--run", broken, "--stop", "iterations=4")
    said = racecraft("gym", "train", "--run", broken, "--resume", "--stop", "iterations=6")
    assert "goes on after iteration 4\n" in said
    assert "memory" not in said
    rows = curve(broken)
    assert rows == curve(whole)
    assert rows[-1]["gradient_steps"] > 0
    for name, array in weights(whole, "last").items():
        np.testing.assert_array_equal(weights(broken, "last")[name], array)


def test_a_replay_too_large_for_checkpoints_begins_anew_and_that_is_said(tmp_path):
    run = tmp_path / "run"
    words = ("--algorithm", "dqn", "--set", "replay.learning_starts=40", "--set", "replay.keep_mib=0.001", *SMALL)
    racecraft("gym", "train", "CartPole-v1", "--run", run, "--stop", "iterations=3", *words)
    said = racecraft("gym", "train", "--run", run, "--resume", "--stop", "iterations=4")
    assert "too large to be kept (replay.keep_mib), so its memory begins anew" in said
    assert curve(run)[-1].get("gradient_steps") is None, "32 of 40 transitions are remembered again"


def test_what_a_replay_cannot_be_is_refused_before_a_folder_is_made(tmp_path):
    new = tmp_path / "new"
    words = ("gym", "train", "CartPole-v1", "--run", new, *SMALL)
    with pytest.raises(SettingError, match=r"replay.capacity=900000000 needs .* GiB"):
        racecraft(*words, "--algorithm", "dqn", "--set", "replay.capacity=900000000")
    with pytest.raises(SettingError, match=r"There is no setting 'replay.capacity' here"):
        racecraft(*words, "--set", "replay.capacity=1000")
    with pytest.raises(SettingError, match=r"--algorithm dqn decides one choice; an action of Pendulum-v1 is numbers"):
        racecraft("gym", "train", "Pendulum-v1", "--algorithm", "dqn", "--run", new, *SMALL)
    assert not new.exists()


def test_apex_goes_on_from_where_learner_and_actors_last_met(tmp_path):
    run = tmp_path / "run"
    words = ("--algorithm", "apex", "--set", "replay.learning_starts=40", *SMALL)
    racecraft("gym", "train", "CartPole-v1", "--run", run, "--stop", "iterations=4", *words)
    racecraft("gym", "train", "--run", run, "--resume", "--stop", "iterations=6")
    assert [row["iteration"] for row in curve(run)] == [1, 2, 3, 4, 5, 6]
    assert curve(run)[-1]["gradient_steps"] > 0


def test_an_environment_without_a_memory_begins_its_episodes_anew_and_that_is_said(tmp_path, forgetful):
    run = tmp_path / "run"
    racecraft("gym", "train", forgetful, "--run", run, "--stop", "iterations=2", *SMALL)
    said = racecraft("gym", "train", "--run", run, "--resume", "--stop", "iterations=4")
    assert "goes on after iteration 2; the world's inner state cannot be kept" in said
    job = json.loads((run / "job.json").read_text())
    assert (job["asked"]["stops"], job["resumed"]) == (
        ["iterations=2"], [{"after_iteration": 2, "stops": ["iterations=4"]}]
    )  # fmt: skip
    assert "It was resumed once, after iteration 2, until 4 iterations are done." in request_text(
        read_facts(RunFolder.open(run))
    )
    assert [row["iteration"] for row in curve(run)] == [1, 2, 3, 4]
    assert curve(run)[-1]["steps"] == 4 * 2 * 16


def test_a_unity_run_goes_on_with_new_episodes_and_that_is_said(tmp_path):
    pytest.importorskip("grpc", reason="the extra racecraft[unity] is not installed")
    run = tmp_path / "run"
    racecraft("unity", "train", "builtin:Basic", "--run", run, "--stop", "iterations=2", *SMALL)
    before, learnt = curve(run), weights(run, "2")
    said = racecraft("unity", "train", "--run", run, "--resume", "--stop", "iterations=3", "--json")
    assert "goes on after iteration 2; the world's inner state cannot be kept" in said
    after = curve(run)
    assert after[:2] == before
    assert after[2]["steps"] == 3 * 2 * 16
    assert 0 < max(np.abs(array - learnt[name]).max() for name, array in weights(run, "3").items()) < 0.05


def test_a_resumed_unity_run_keeps_its_configuration(tmp_path):
    """The YAML is copied into the run folder; the one it was read from may be gone."""
    pytest.importorskip("grpc", reason="the extra racecraft[unity] is not installed")
    yaml, run = tmp_path / "basic.yaml", tmp_path / "run"
    yaml.write_text(
        "behaviors: {Basic: {trainer_type: sac, max_steps: 40}}\n"
        'env_settings: {env_path: builtin:Basic, env_args: ["--agents", "3"]}\n'
    )
    text = yaml.read_text()
    said = racecraft("unity", "train", "--config", yaml, "--run", run, "--set", "rollout.horizon=8", "--nearest")
    assert said.index("PPO learns instead") < said.index("or steps=40")  # before the first tick
    assert any("PPO learns instead" in note for note in json.loads((run / "job.json").read_text())["notes"])
    yaml.unlink()
    assert (run / "trainer.yaml").read_text() == text
    racecraft("unity", "train", "--run", run, "--resume", "--stop", "steps=60")
    assert curve(run)[-1]["steps"] == 72  # three agents of eight ticks each, three times
    (run / "trainer.yaml").unlink()
    with pytest.raises(RunFolderError, match=r"trainer.yaml: is missing; the run was begun with a configuration"):
        racecraft("unity", "train", "--run", run, "--resume")


def test_a_new_run_may_begin_with_the_weights_of_an_old_one(tmp_path):
    old, new = tmp_path / "old", tmp_path / "new"
    racecraft("gym", "train", "CartPole-v1", "--run", old, "--stop", "iterations=2", *SMALL)
    racecraft(
        "gym", "train", "CartPole-v1", "--run", new, "--from", f"{old}:2", "--stop", "iterations=1", "--seed", 2, *SMALL
    )
    for name, array in weights(old, "2").items():
        np.testing.assert_array_equal(weights(new, "0")[name], array)


def test_weights_that_do_not_fit_are_refused_before_a_folder_is_made(tmp_path):
    old = tmp_path / "old"
    racecraft("gym", "train", "CartPole-v1", "--run", old, "--stop", "iterations=1", *SMALL)
    words = ("gym", "train", "CartPole-v1", "--run", tmp_path / "new", "--from", old, *TINY)
    with pytest.raises(RunFolderError, match="its network is of another shape"):
        racecraft(*words)
    with pytest.raises(RunFolderError, match="one of `racecraft gym train`; expected one of `racecraft unity train`"):
        racecraft("unity", "train", "builtin:Basic", "--run", tmp_path / "new", "--from", old)
    assert not (tmp_path / "new").exists()


def test_a_run_that_has_reached_its_stop_says_that_nothing_is_left_to_train(tmp_path):
    racecraft("gym", "train", "CartPole-v1", "--run", tmp_path / "r", "--stop", "iterations=2", *SMALL)
    before = curve(tmp_path / "r")
    said = racecraft("gym", "train", "--run", tmp_path / "r", "--resume", "--stop", "steps=60")
    assert "steps=60 holds already, so nothing is trained" in " ".join(said.split())
    assert "2 iterations and 64 steps; for ten minutes more: --stop minutes=11" in " ".join(said.split())
    assert curve(tmp_path / "r") == before


def test_what_cannot_be_resumed_is_refused(tmp_path):
    run = tmp_path / "run"
    racecraft("gym", "train", "CartPole-v1", "--run", run, "--stop", "iterations=1", *SMALL)
    with pytest.raises(RunFolderError, match="expected one of `racecraft unity train`"):
        racecraft("unity", "train", "--run", run, "--resume")
    with pytest.raises(SettingError, match="--resume needs --run RUN"):
        racecraft("gym", "train", "--resume")
    with pytest.raises(SettingError, match="--seed cannot change"):
        racecraft("gym", "train", "--run", run, "--resume", "--seed", 4)
    with pytest.raises(SettingError, match="ID cannot change"):
        racecraft("gym", "train", "Acrobot-v1", "--run", run, "--resume")
    with pytest.raises(SettingError, match="no environment is named"):
        racecraft("gym", "train")


@pytest.mark.long
def test_a_unity_training_survives_ctrl_c_and_a_kill(tmp_path):
    """Real processes: interrupted, gone on with, killed outright, gone on with; no iteration is lost or told twice."""
    pytest.importorskip("grpc", reason="the extra racecraft[unity] is not installed")
    run = tmp_path / "run"
    for words, blow, code in (
        (("builtin:Basic",), signal.SIGINT, 0),
        (("--resume",), signal.SIGKILL, -signal.SIGKILL),
        (("--resume",), signal.SIGINT, 0),
    ):
        command = [sys.executable, "-m", "racecraft", "unity", "train", *words, "--run", str(run)]
        process = subprocess.Popen(
            [*command, "--stop", "minutes=5"], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True
        )
        next(line for line in process.stdout if line.startswith("iteration"))
        time.sleep(1.0)
        process.send_signal(blow)
        said, _ = process.communicate(timeout=60)
        assert process.returncode == code, said
    rows = curve(run)
    assert [row["iteration"] for row in rows] == list(range(1, len(rows) + 1))
    assert rows[-1]["steps"] == len(rows) * 32 * 32
