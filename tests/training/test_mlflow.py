"""MLflow: what it is told, that it holds nothing up, and what is said when it does not listen."""

import socket
import sys
import time
import types
from pathlib import Path

import pytest

from racecraft.contract.errors import MissingExtraError, SettingError
from racecraft.sagemaker.estimator_config import experiment_variables
from racecraft.training.callbacks import EvaluationResult, IterationReport, NullCallback
from racecraft.training.mlflow_tracking import EXPERIMENT, MlflowRun, RunDescription, tracking_uri
from racecraft.training.worlds import resume, train
from racecraft.worlds.gymnasium.training.trainer import GymRequest

TINY = ("rollout.num_worlds=2", "rollout.horizon=16", "evaluation.episodes=1")
JOB = {
    "settings": {"ppo": {"learning_rate": 1e-3}}, "algorithm": "ppo", "seed": 7, "kind": "gym", "title": "a cart",
    "started": "2026-01-01T00:00:00Z",
}  # fmt: skip

its_own_warnings = pytest.mark.filterwarnings("ignore")
"""MLflow warns of what it uses of SQLAlchemy itself; that is not ours to fail on."""


@pytest.fixture(autouse=True)
def _as_before(monkeypatch):
    for name in ("MLFLOW_TRACKING_URI", "MLFLOW_EXPERIMENT_NAME", *experiment_variables({}).values()):
        monkeypatch.delenv(name, raising=False)


@pytest.fixture
def mlflow():
    """MLflow itself, over a database."""
    pytest.importorskip("alembic", reason="alembic is not installed: pip install 'racecraft[mlflow]'")
    return pytest.importorskip("mlflow", reason="mlflow-skinny is not installed: pip install 'racecraft[mlflow]'")


def runs_of(mlflow, uri, experiment=EXPERIMENT):
    client = mlflow.MlflowClient(tracking_uri=uri)
    return client, client.search_runs([client.get_experiment_by_name(experiment).experiment_id])


def report_of(iteration, steps, score=None):
    result = None if score is None else EvaluationResult(score, False)
    return IterationReport(iteration, steps, 1.0, 50.0, 3, 2.5, None, {"entropy": 1.0}, result, False)


@its_own_warnings
def test_a_training_and_its_continuation_are_one_run_of_mlflow(tmp_path, monkeypatch, mlflow):
    monkeypatch.chdir(tmp_path)
    for name, value in experiment_variables({"ExperimentName": "carts", "TrialName": "first"}).items():
        monkeypatch.setenv(name, value)
    uri = f"sqlite:///{tmp_path / 'm.db'}"
    said = []
    request = GymRequest(
        "CartPole-v1", stops=("iterations=2",), run=tmp_path / "cart", seed=3,
        overrides=(*TINY, f"runtime.mlflow={uri}"),
    )  # fmt: skip
    train(request, NullCallback(), said.append)
    client, (run,) = runs_of(mlflow, uri, "carts")
    assert (run.info.status, run.info.run_name) == ("FINISHED", "cart")
    assert (run.data.params["seed"], run.data.params["rollout.horizon"]) == ("3", "16")
    assert run.data.tags["racecraft.run_folder"] == (tmp_path / "cart").as_uri()
    assert run.data.tags["sagemaker.TrialName"] == "first"
    resume(tmp_path / "cart", ("iterations=3",), NullCallback(), said.append)
    client, (run,) = runs_of(mlflow, uri, "carts")
    assert [point.step for point in client.get_metric_history(run.info.run_id, "Policy/Entropy")] == [32, 64, 96]
    assert client.get_metric_history(run.info.run_id, "Evaluation/return")
    assert run.info.status == "FINISHED"
    assert not [line for line in said if "MLflow" in line]
    assert sorted(path.name for path in tmp_path.iterdir()) == ["cart", "m.db"]  # no artifact is copied


@its_own_warnings
def test_true_is_a_database_beside_the_run_folders(tmp_path, mlflow):
    said = []
    watch = MlflowRun("true", RunDescription(tmp_path / "runs-1", JOB), said.append)
    watch.begin("x", "", "progress %")
    for iteration in range(1, 4):
        watch.iteration(report_of(iteration, 64 * iteration))
    watch.iteration(report_of(3, 192, 40.0))  # judged afterwards: told again
    watch.end("")
    client, (run,) = runs_of(mlflow, f"sqlite:///{tmp_path / 'mlflow.db'}")
    assert run.data.params == {"ppo.learning_rate": "0.001", "seed": "7", "algorithm": "ppo"}
    assert [point.step for point in client.get_metric_history(run.info.run_id, "Policy/Entropy")] == [64, 128, 192]
    assert run.data.metrics["Evaluation/progress"] == 40.0
    assert said == []


@its_own_warnings
def test_a_server_that_is_not_there_holds_nothing_up_and_is_said_at_the_end(tmp_path, mlflow):
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    said = []
    watch = MlflowRun(f"http://me:secret@127.0.0.1:{port}", RunDescription(tmp_path / "run", JOB), said.append)
    watch.begin("x", "", "return")
    begun = time.perf_counter()
    for iteration in range(1, 4):
        watch.iteration(report_of(iteration, iteration))
    assert time.perf_counter() - begun < 10, "the server's own limit would be minutes"
    watch.end("")
    (line,) = said
    assert "did not take the figures of 3 iterations" in line
    assert "metrics.jsonl" in line
    assert "secret" not in line


class Deaf:
    """Stands in for MLflow's client: takes nothing until it is told to."""

    taken: list = []
    hears = False

    def __init__(self, tracking_uri):
        pass

    def __getattr__(self, name):
        def call(*args, **kwargs):
            if not type(self).hears:
                raise ConnectionError("nobody there")
            self.taken.append((name, args, kwargs))
            return [] if name == "search_runs" else type("Any", (), {"experiment_id": "1", "info": self})()

        return call

    run_id = "r"


@pytest.fixture
def deaf(monkeypatch):
    entities = types.ModuleType("mlflow.entities")
    entities.Metric = lambda *point: point
    entities.Param = lambda *pair: pair
    tracking = types.ModuleType("mlflow.tracking")
    tracking.MlflowClient = Deaf
    for name, module in {
        "mlflow": types.ModuleType("mlflow"),
        "mlflow.entities": entities,
        "mlflow.tracking": tracking,
    }.items():
        monkeypatch.setitem(sys.modules, name, module)
    monkeypatch.setattr(Deaf, "taken", [])
    monkeypatch.setattr(Deaf, "hears", False)
    return Deaf


def test_what_a_lost_server_missed_is_sent_when_it_is_back(tmp_path, deaf):
    said = []
    watch = MlflowRun("http://127.0.0.1:1", RunDescription(tmp_path / "run", JOB), said.append)
    watch.begin("x", "", "return")
    watch.iteration(report_of(1, 64))
    time.sleep(0.05)
    deaf.hears = True
    watch.iteration(report_of(2, 128))
    watch.end("")
    points = [point for name, _, more in deaf.taken if name == "log_batch" for point in more.get("metrics", ())]
    assert [step for name, _, _, step in points if name == "Policy/Entropy"] == [64, 128]
    assert deaf.taken[-1][:2] == ("set_terminated", ("r", "FINISHED"))
    assert said == []


def test_without_the_package_or_with_no_address_nothing_is_made(tmp_path, monkeypatch):
    for address, error, letter in (
        ("mlruns", SettingError, "no address of MLflow"),
        ("true", MissingExtraError, r"pip install 'racecraft\[mlflow\]'"),
    ):
        monkeypatch.setitem(sys.modules, "mlflow.tracking", None)
        request = GymRequest("CartPole-v1", run=tmp_path / "run", overrides=(f"runtime.mlflow={address}",))
        with pytest.raises(error, match=letter):
            train(request, NullCallback(), str)
    assert not (tmp_path / "run").exists()


def test_true_asks_mlflows_own_variable_first(monkeypatch):
    monkeypatch.setenv("MLFLOW_TRACKING_URI", "http://there:5000")
    assert tracking_uri("true", Path("runs/x")) == "http://there:5000"
