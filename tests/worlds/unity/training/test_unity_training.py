"""Training in a Unity scene, over the real wire, with the stand-in at its other end; and the way back into Unity."""

import json
import socket
import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest
import typer
from typer.testing import CliRunner

from racecraft.cli.runs import export as export_command
from racecraft.contract.errors import SettingError, UserInputError
from racecraft.formats.checkpoint import Checkpoints, load_state, save_state
from racecraft.formats.run_folder import RunFolder
from racecraft.lessons.checking import AnswerError
from racecraft.training.callbacks import NullCallback
from racecraft.training.worlds import train
from racecraft.worlds.unity.cli import unity as unity_command
from racecraft.worlds.unity.env.wire import EDITOR_PORT
from racecraft.worlds.unity.lessons import trained as lesson
from racecraft.worlds.unity.training.plan import UnityRequest, stops_for
from racecraft.worlds.unity.training.trainer import OBSERVATIONS

pytest.importorskip("grpc", reason="the extra racecraft[unity] is not installed")

APP = typer.Typer()
APP.add_typer(unity_command.app, name="unity")
APP.command(name="export")(export_command.export)


@pytest.fixture(scope="module")
def basic(tmp_path_factory):
    """One training of Basic, as a user types it: the run folder, the figures."""
    run = tmp_path_factory.mktemp("runs") / "basic"
    result = CliRunner().invoke(APP, ["unity", "train", "builtin:Basic", "--run", str(run), "--json"])
    assert result.exit_code == 0, result.output
    return run, json.loads(result.stdout)


class Stops(NullCallback):
    """Remembers the stops."""

    def begin(self, title, stops, score_name):
        self.stops = stops


def test_basic_is_learnt(basic):
    """A mean of 0.92 over 20 greedy episodes, 0.93 being the best; `benchmarks/unity.py` tells how soon."""
    _, summary = basic
    assert summary["solved"]
    assert summary["evaluation"]["episodes"] == 20
    assert 0.92 <= summary["evaluation"]["mean_return"] <= 0.930001
    assert summary["stopped_by"] == "score=0.92"


def test_the_run_keeps_what_a_stranger_needs(basic):
    run, summary = basic
    job = RunFolder.open(run).read_job()
    assert (job["kind"], job["asked"]["behavior"], job["seed"]) == ("unity", "Basic?team=0", 1)
    _, card = Checkpoints(RunFolder.open(run).checkpoints).load_policy("best")
    assert card["behavior"]["actions"] == {"continuous": 0, "branches": [3]}
    seen = load_state(run / OBSERVATIONS)["Basic"]
    assert (seen.sum(axis=1) == 1).all()
    assert seen.shape[1:] == (20,)
    assert summary["env_steps"] == summary["iterations"] * 32 * 32


def test_a_run_goes_back_into_unity(basic, tmp_path):
    """The file written is run by onnxruntime from every place between the two goals: it goes right, as was learnt."""
    onnxruntime = pytest.importorskip("onnxruntime", reason="the extra racecraft[onnx] is not installed")
    result = CliRunner().invoke(APP, ["export", str(basic[0]), "--to", "unity", "--output", str(tmp_path), "--json"])
    assert result.exit_code == 0, result.output
    told = json.loads(result.stdout)
    assert told["recorded"]
    assert told["checked_on"] >= 20
    assert told["largest_difference"] == 0
    session = onnxruntime.InferenceSession(told["file"], providers=["CPUExecutionProvider"])
    feeds = {"obs_0": np.eye(20, dtype=np.float32)[10:17], "action_masks": np.ones((7, 3), np.float32)}
    assert session.run(["deterministic_discrete_actions"], feeds)[0].tolist() == [[2]] * 7


def test_a_run_of_another_kind_and_a_strange_target_are_refused(tmp_path):
    RunFolder.create(tmp_path / "car", {"kind": "deepracer"})
    with pytest.raises(SettingError, match="one of `racecraft train`; expected one of Unity. Export it with --to car"):
        CliRunner().invoke(APP, ["export", str(tmp_path / "car"), "--to", "unity"], catch_exceptions=False)
    with pytest.raises(SettingError, match="Did you mean 'unity'"):
        CliRunner().invoke(APP, ["export", str(tmp_path), "--to", "untiy"], catch_exceptions=False)


def test_without_onnxruntime_the_file_is_written_and_the_lack_is_said(basic, tmp_path, monkeypatch):
    monkeypatch.setitem(__import__("sys").modules, "onnxruntime", None)
    result = CliRunner().invoke(APP, ["export", str(basic[0]), "--to", "unity", "--output", str(tmp_path / "x.onnx")])
    assert "onnxruntime is not installed" in result.stdout
    assert (tmp_path / "x.onnx").exists()


def test_observations_of_another_shape_are_not_taken_for_recorded_ones(basic, tmp_path):
    import shutil

    from racecraft.worlds.unity.export.unity_run import export_to_unity

    pytest.importorskip("onnxruntime", reason="the extra racecraft[onnx] is not installed")
    copy = tmp_path / "copy"
    shutil.copytree(basic[0], copy)
    save_state(copy / OBSERVATIONS, {"Basic": np.zeros((5, 3), np.float32)})
    (exported,) = export_to_unity(copy)
    assert not exported.recorded
    assert exported.path == copy / "export" / "Basic.onnx"


def test_the_lessons_judge_what_was_trained_and_compare_its_decisions(basic):
    pytest.importorskip("onnxruntime", reason="the extra racecraft[onnx] is not installed")
    found, compared = lesson.judged(basic[0]), lesson.compared(basic[0])
    assert (round(found.mean, 2), found.algorithm) == (0.93, "ppo")
    assert (compared.onnx, compared.endpoint) == (lesson.QUESTIONS, lesson.QUESTIONS)
    assert "refused" in compared.after, "the endpoint is gone"


def test_the_lessons_take_no_model_of_another_world(tmp_path):
    run = RunFolder.create(tmp_path / "car", {"kind": "deepracer", "asked": {"track": "reinvent_base"}})
    with pytest.raises(AnswerError, match="found a deepracer training"):
        lesson.judged(run.path)


YAML = """
behaviors:
  Basic:
    trainer_type: sac
    hyperparameters: {batch_size: 32, learning_rate: 0.002, num_epoch: 2}
    network_settings: {hidden_units: 20, num_layers: 1}
    max_steps: 300
env_settings:
  env_path: builtin:Basic
  env_args: ["--agents", "4"]
  seed: 5
"""


def test_a_trainer_configuration_is_followed(tmp_path):
    pytest.importorskip("yaml", reason="pyyaml is not installed")
    (tmp_path / "basic.yaml").write_text(YAML)
    watching = Stops()
    request = UnityRequest(config=tmp_path / "basic.yaml", run=tmp_path / "run", overrides=("rollout.horizon=50",))
    with pytest.raises(UserInputError, match="trainer_type 'sac' .* has choices; expected ppo. --nearest"):
        train(request, watching)
    trained = train(replace(request, nearest=True), watching)
    job = trained.run.read_job()
    assert watching.stops == "score=0.92 or steps=300"
    assert trained.outcome.steps == 400  # the first whole iteration of 4 x 50 beyond 300
    assert (job["seed"], job["settings"]["rollout"]["num_worlds"]) == (5, 4)
    assert job["settings"]["ppo"]["learning_rate"] == 0.002
    assert job["settings"]["network"]["hidden_units"] == [20]
    assert job["algorithm"] == "ppo"
    assert any("an action of 'Basic' has choices; PPO learns instead" in note for note in trained.summary()["notes"])


def test_what_cannot_be_used_is_refused_before_a_player_starts(monkeypatch):
    monkeypatch.setattr("racecraft.worlds.unity.training.trainer.UnityWorld", None)
    for request, letter in (
        (UnityRequest(), "no build is named"),
        (UnityRequest("builtin:Basik"), "Basic"),
        (UnityRequest("builtin:Basic", stops=("scor=1",)), "Did you mean 'score'"),
        (UnityRequest("builtin:Basic", overrides=("ppo.epoch=1",)), "Did you mean 'epochs'"),
    ):
        with pytest.raises(UserInputError, match=letter):
            train(request, NullCallback())


def test_the_editor_calls_port_5004_and_is_judged_by_what_it_trains_on(tmp_path):
    """The stand-in plays the Editor: somebody else started it, and it calls the Editor's port."""
    with socket.socket() as probe:
        if probe.connect_ex(("127.0.0.1", EDITOR_PORT)) == 0:
            pytest.skip(f"somebody listens on port {EDITOR_PORT}")
    said = []

    def press_play(text):
        said.append(text)
        if "press Play" in text:
            program = [sys.executable, "-m", "racecraft.worlds.unity.env.basic_scene", "--agents", "8"]
            started.append(subprocess.Popen([*program, "--mlagents-port", str(EDITOR_PORT)]))

    started = []
    request = UnityRequest("editor", stops=("iterations=2",), run=tmp_path / "run", overrides=("evaluation.every=2",))
    trained = train(request, NullCallback(), press_play)
    assert said[0] == "waiting on port 5004 for the Unity Editor: press Play there"
    assert trained.outcome.steps == 2 * 64 * 8
    assert trained.outcome.last.details["episodes"] > 0
    assert started[0].wait(60) == 0


def test_a_scene_without_a_known_score_stops_by_the_clock():
    assert [str(stop) for stop in stops_for(UnityRequest(), None, "Game.x86_64")] == ["minutes=30"]
    assert [str(stop) for stop in stops_for(UnityRequest(), 9000, "Game.x86_64")] == ["steps=9000"]
