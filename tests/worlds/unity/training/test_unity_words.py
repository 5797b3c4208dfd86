"""The words of `mlagents-learn`: what is typed reaches the players, is remembered, and plays without learning."""

import json

import numpy as np
import pytest
import typer
from typer.testing import CliRunner

from racecraft.algorithms.ppo import PpoLearner
from racecraft.contract.errors import RunFolderError, SettingError, UserInputError
from racecraft.evaluation.evaluate_run import evaluate_run
from racecraft.formats.checkpoint import Checkpoints
from racecraft.formats.run_folder import RunFolder
from racecraft.players.trained import load_policy
from racecraft.training.callbacks import NullCallback
from racecraft.training.worlds import resume, train
from racecraft.worlds.unity.cli import unity as unity_command
from racecraft.worlds.unity.env.errors import PortTakenError
from racecraft.worlds.unity.export.unity_run import export_to_unity
from racecraft.worlds.unity.training.inference import play_scene
from racecraft.worlds.unity.training.plan import UnityRequest, plan_resume, plan_unity

pytest.importorskip("grpc", reason="the extra racecraft[unity] is not installed")

APP = typer.Typer()
APP.add_typer(unity_command.app, name="unity")
TYPED = (
    "unity", "train", "builtin:Basic", "--num-envs", "2", "--time-scale", "5", "--stop", "iterations=1", "--set",
    "rollout.horizon=8", "--set", "evaluation.every=9",
)  # fmt: skip


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    """A short training by two players of six agents each, as a user types it; never judged but at its end."""
    folder = tmp_path_factory.mktemp("runs") / "basic"
    typed = (*TYPED, "--run", str(folder), "--json", "--env-args", "--agents", "6")
    result = CliRunner().invoke(APP, typed)
    assert result.exit_code == 0, result.output
    return folder


def test_what_was_typed_reaches_the_players_and_is_remembered(run):
    job = RunFolder.open(run).read_job()
    assert job["settings"]["rollout"]["num_worlds"] == 12
    words = plan_resume(run).world_arguments()
    assert (words["num_players"], words["time_scale"], words["args"]) == (2, 5.0, ("--agents", "6"))
    assert plan_resume(run).world_arguments(for_judge=True)["num_players"] == 1


def test_agents_are_shared_out_among_the_players_and_as_many_when_it_goes_on(tmp_path):
    several = ("rollout.num_worlds=8", "rollout.horizon=8", "evaluation.every=9", "evaluation.episodes=4")
    train(
        UnityRequest("builtin:Basic", num_envs=2, overrides=several, stops=("iterations=1",), run=tmp_path / "run"),
        NullCallback(), str,
    )  # fmt: skip
    run = RunFolder.open(tmp_path / "run")
    assert run.read_job()["settings"]["rollout"]["num_worlds"] == 8
    resume(run.path, ("iterations=2",), NullCallback(), str)
    assert [row["steps"] for row in run.read_metrics()] == [64, 128]


def test_words_that_follow_env_args_are_the_players_own(monkeypatch):
    heard = []

    def hear(request, watching, tell, spread):
        heard.append(request)
        raise typer.Exit

    monkeypatch.setattr("racecraft.training.worlds.train", hear)
    CliRunner().invoke(APP, (*TYPED, "--env-args", "--level", "2", "--seed", "7"), catch_exceptions=False)
    assert heard[0].env_args == ("--level", "2", "--seed", "7")
    assert heard[0].seed is None, "what follows is not read as ours"


def test_the_judge_listens_behind_the_last_of_those_that_teach(tmp_path):
    request = UnityRequest("builtin:Basic", num_envs=3, base_port=6105)
    assert plan_unity(request).world_arguments()["base_port"] == 6105
    assert plan_unity(request).world_arguments(for_judge=True)["base_port"] == 6108
    assert "base_port" not in plan_unity(UnityRequest("builtin:Basic")).world_arguments()
    pytest.importorskip("yaml", reason="pyyaml is not installed")
    (tmp_path / "c.yaml").write_text("env_settings: {base_port: 7000, num_envs: 2, env_args: [--agents, '3']}\n")
    planned = plan_unity(UnityRequest("builtin:Basic", tmp_path / "c.yaml", time_scale=1.0))
    assert planned.world_arguments(for_judge=True)["base_port"] == 7002
    assert planned.world_arguments()["args"] == ("--agents", "3")
    assert plan_unity(UnityRequest("editor", base_port=6105)).world_arguments().get("base_port") is None


def test_a_port_that_is_taken_is_told(tmp_path):
    import socket

    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        request = UnityRequest("builtin:Basic", base_port=taken.getsockname()[1], run=tmp_path / "run")
        with pytest.raises(PortTakenError):
            train(request, NullCallback(), str)


def test_a_policy_plays_without_learning(run):
    said = []
    before = Checkpoints(run / "checkpoints").load_policy("last")[0]
    played = play_scene(UnityRequest(clone_from=f"{run}:last", stops=("steps=300",)), said.append)
    assert said == ["plays without learning until steps=300"]
    assert played["stopped_by"] == "steps=300"
    assert 300 <= played["env_steps"] < 400
    after = Checkpoints(run / "checkpoints").load_policy("last")[0]
    assert all(np.array_equal(before[name], after[name]) for name in before)
    result = CliRunner().invoke(
        APP, ["unity", "train", "--run", str(run), "--resume", "--inference", "--stop", "steps=200", "--json"]
    )
    told = json.loads(result.stdout)
    assert (told["checkpoint"], told["stopped_by"]) == (1, "steps=200")
    assert len(Checkpoints(run / "checkpoints").entries()) == 2, "nothing was written"


def test_who_never_comes_to_an_end_is_cut_where_its_training_cut_it(run):
    """Basic knows no end: a policy that turns about for ever is judged by as many steps as it was while it trained."""
    (path,) = (run / "evaluations").glob("*.json")
    told = json.loads(path.read_text())
    assert told["most_steps"] == 200, "and no training episode was near a third of it"
    found = evaluate_run(run)
    for name in ("episodes", "mean_return", "mean_steps", "cut"):
        assert found[name] == pytest.approx(told[name]), name
    assert found["cut"] > 0


def test_what_cannot_be_played_is_refused(run, tmp_path):
    with pytest.raises(SettingError, match="expected --from RUN, or --run RUN --resume"):
        play_scene(UnityRequest("builtin:Basic"))
    with pytest.raises(SettingError, match="iterations=3 can never hold while nothing is learned"):
        play_scene(UnityRequest(clone_from=str(run), stops=("iterations=3",)))
    detached = CliRunner().invoke(APP, ["unity", "train", "--from", str(run), "--inference", "--detach"])
    assert "--inference and --detach" in str(detached.exception)
    RunFolder.create(tmp_path / "car", {"kind": "deepracer"})
    with pytest.raises(RunFolderError, match="expected one of `racecraft unity train`"):
        play_scene(UnityRequest(clone_from=str(tmp_path / "car")))
    pytest.importorskip("yaml", reason="pyyaml is not installed")
    (tmp_path / "c.yaml").write_text("checkpoint_settings: {inference: true}\n")
    with pytest.raises(UserInputError, match="nothing would be learned"):
        plan_unity(UnityRequest("builtin:Basic", tmp_path / "c.yaml"))


def test_what_was_trained_is_what_is_exported_cloned_and_served_although_nobody_judged(tmp_path):
    """Broken off by Ctrl-C before any evaluation: the best is then the last, not the untrained."""
    pytest.importorskip("onnxruntime", reason="the extra racecraft[onnx] is not installed")

    class CtrlC(NullCallback):
        def iteration(self, report):
            assert report.result is None
            raise KeyboardInterrupt

    settings = ("evaluation.every=9", "rollout.num_worlds=4", "rollout.horizon=8")
    trained = train(UnityRequest("builtin:Basic", run=tmp_path / "run", overrides=settings), CtrlC(), str)
    assert (trained.outcome.reason, trained.outcome.last) == ("Ctrl-C", None)
    shelf = Checkpoints(trained.run.checkpoints)
    untrained, last = shelf.load_policy("0")[0], shelf.load_policy("last")[0]
    assert any(not np.array_equal(untrained[name], last[name]) for name in last)
    served = load_policy(tmp_path / "run")
    assert served.checkpoint.iteration == 1
    for name, weight in served.policy.network.state_dict().items():
        np.testing.assert_array_equal(weight.numpy(), last[name])
    (exported,) = export_to_unity(tmp_path / "run")
    assert exported.checkpoint == 1
    begun = train(
        UnityRequest("builtin:Basic", run=tmp_path / "next", clone_from=str(tmp_path / "run"), overrides=settings),
        CtrlC(), str,
    )  # fmt: skip
    cloned = Checkpoints(begun.run.checkpoints).load_policy("0")[0]
    assert all(np.array_equal(cloned[name], last[name]) for name in last)


def test_schedules_of_a_configuration_come_to_their_end_with_max_steps(tmp_path, monkeypatch):
    pytest.importorskip("yaml", reason="pyyaml is not installed")
    (tmp_path / "c.yaml").write_text(
        "behaviors: {Basic: {hyperparameters: {learning_rate: 0.01, epsilon_schedule: constant}, max_steps: 80}}"
    )
    rates, anneal = [], PpoLearner.anneal

    def watched(self, done):
        anneal(self, done)
        rates.append((self.learning_rate, self.now.clip))

    monkeypatch.setattr(PpoLearner, "anneal", watched)
    settings = ("evaluation.every=9", "evaluation.episodes=1", "rollout.horizon=10", "ppo.clip=0.3")
    request = UnityRequest(
        "builtin:Basic", tmp_path / "c.yaml", run=tmp_path / "run", overrides=settings, env_args=("--agents", "4")
    )
    assert train(request, NullCallback(), str).outcome.reason == "steps=80"
    assert [rate for rate, _ in rates] == pytest.approx([5e-3, 1e-10], rel=1e-6)
    assert {clip for _, clip in rates} == {0.3}
    said = []
    resume(tmp_path / "run", ("iterations=3",), NullCallback(), said.append)
    assert any("ppo.learning_rate_schedule, ppo.entropy_schedule: linear, but no stop steps=" in line for line in said)
