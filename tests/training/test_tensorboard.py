"""Curves for TensorBoard: what is written, where, and under which names."""

import sys
import types

import pytest

from racecraft.contract.errors import MissingExtraError
from racecraft.training.callbacks import EvaluationResult, IterationReport, NullCallback
from racecraft.training.tensorboard import FOLDER, TensorBoard
from racecraft.training.worlds import train
from racecraft.worlds.gymnasium.training.trainer import GymRequest


class Writer:
    """Stands in for TensorBoard's, and remembers."""

    opened: list = []

    def __init__(self, folder, purge_step):
        self.folder, self.purge_step, self.points, self.is_closed = folder, purge_step, [], False
        self.opened.append(self)

    def add_scalar(self, name, value, step):
        self.points.append((name, value, step))

    def flush(self):
        pass

    def close(self):
        self.is_closed = True


@pytest.fixture
def written(monkeypatch):
    module = types.ModuleType("torch.utils.tensorboard")
    module.SummaryWriter = Writer
    monkeypatch.setitem(sys.modules, "torch.utils.tensorboard", module)
    monkeypatch.setattr(Writer, "opened", [])
    return Writer.opened


def report_of(iteration, steps, result=None, mean_reward=2.5):
    losses = {"policy_loss": -0.1, "value_loss": 0.7, "entropy": 1.0, "approx_kl": 0.01}
    return IterationReport(iteration, steps, 1.0, 50.0, 3, mean_reward, None, losses, result, False)


def test_names_are_ml_agents_own_and_the_axis_is_steps(tmp_path, written):
    board = TensorBoard(tmp_path)
    board.begin("x", "minutes=1", "return")
    board.iteration(report_of(1, 64))
    assert written[0].points == [
        ("Environment/Cumulative Reward", 2.5, 64), ("Losses/Policy Loss", -0.1, 64), ("Losses/Value Loss", 0.7, 64),
        ("Policy/Entropy", 1.0, 64), ("Learner/approx_kl", 0.01, 64), ("Time/Steps per Second", 50.0, 64),
    ]  # fmt: skip
    board.end("minutes=1")
    assert written[0].is_closed


def test_an_iteration_that_is_judged_afterwards_is_not_written_twice(tmp_path, written):
    board = TensorBoard(tmp_path)
    board.begin("x", "minutes=1", "progress %")
    board.iteration(report_of(1, 64, mean_reward=None))
    result = EvaluationResult(40.0, False, figures={"best_lap_seconds": None, "mean_speed_mps": 2.0})
    told = len(written[0].points)
    board.iteration(report_of(1, 64, result))
    assert written[0].points[told:] == [("Evaluation/progress %", 40.0, 64), ("Evaluation/mean_speed_mps", 2.0, 64)]
    assert "Environment/Cumulative Reward" not in [name for name, *_ in written[0].points]


def test_a_training_writes_where_it_is_asked_to_and_only_there(tmp_path, written):
    pytest.importorskip("gymnasium")
    asked = ("rollout.num_worlds=2", "rollout.horizon=16", "evaluation.episodes=1")

    def trained(name, *more):
        request = GymRequest("CartPole-v1", stops=("iterations=2",), run=tmp_path / name, overrides=(*asked, *more))
        return train(request, NullCallback(), str)

    trained("plain")
    assert not written
    trained("told", "runtime.tensorboard=true")
    (writer,) = written
    assert (writer.folder, writer.purge_step) == (str(tmp_path / "told" / FOLDER), 32)
    assert {step for *_, step in writer.points} == {32, 64}
    assert sum(name == "Evaluation/return" for name, *_ in writer.points) >= 1


def test_without_the_package_the_lack_is_said_before_anything_is_made(tmp_path, monkeypatch):
    pytest.importorskip("gymnasium")
    monkeypatch.setitem(sys.modules, "torch.utils.tensorboard", None)
    request = GymRequest("CartPole-v1", run=tmp_path / "run", overrides=("runtime.tensorboard=true",))
    with pytest.raises(MissingExtraError, match="pip install tensorboard"):
        train(request, NullCallback(), str)
    assert not (tmp_path / "run").exists()


def test_tensorboard_reads_what_is_written(tmp_path):
    reader = pytest.importorskip("tensorboard.backend.event_processing.event_accumulator")
    board = TensorBoard(tmp_path)
    board.begin("x", "minutes=1", "return")
    for iteration in (1, 2):
        board.iteration(report_of(iteration, 64 * iteration, EvaluationResult(0.25 * iteration, False)))
    board.end("")
    again = TensorBoard(tmp_path)  # as a run that goes on after the first iteration
    again.begin("x", "minutes=1", "return")
    again.iteration(report_of(2, 128, EvaluationResult(0.75, False)))
    again.end("")
    told = reader.EventAccumulator(str(tmp_path)).Reload()
    assert [(point.step, point.value) for point in told.Scalars("Evaluation/return")] == [(64, 0.25), (128, 0.75)]
    assert [point.value for point in told.Scalars("Policy/Entropy")] == [1.0, 1.0]
