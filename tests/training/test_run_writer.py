"""Keeping beside the training: copies now, the disk soon, trouble told, nothing lost at the end."""

import threading
import time

import numpy as np
import pytest
import torch

from racecraft.formats.atomic import OutputFileError
from racecraft.formats.checkpoint import Checkpoints
from racecraft.formats.run_folder import RunFolder
from racecraft.training import run_writer
from racecraft.training.callbacks import IterationReport
from racecraft.training.run_writer import RunWriter


class Learner:
    """One number that goes on changing, and its moment."""

    def __init__(self):
        self.weight = torch.zeros(3)

    def state_dict(self):
        return {"network": {"w": self.weight.clone()}, "optimiser": {"0.exp_avg": self.weight.clone() / 3}}


class Collector:
    def state(self):
        return {"ticks": np.array(7)}


def report(iteration):
    return IterationReport(
        iteration=iteration, steps=10 * iteration, seconds=0.0, steps_per_second=0.0, episodes=0, mean_reward=None,
        training_score=None, losses={}, result=None, is_best=False,
    )  # fmt: skip


class Training:
    def __init__(self, folder, **more):
        self.run, self.learner = RunFolder.create(folder, {"kind": "test"}), Learner()
        self.writer = RunWriter(self.run, self.learner, Collector(), {}, **more)
        self.checkpoints = Checkpoints(self.run.checkpoints)
        self.writer.write_start()

    def keep(self, iteration):
        self.learner.weight += 1
        self.writer.write(report(iteration), lambda: {"iteration": iteration})


@pytest.fixture
def training(tmp_path):
    return Training(tmp_path / "run")


@pytest.fixture
def gate(monkeypatch):
    """A disk that takes nothing until the gate opens."""
    opened, really = threading.Event(), run_writer.metrics_row
    monkeypatch.setattr(run_writer, "metrics_row", lambda report: (opened.wait(60), really(report))[1])
    yield opened
    opened.set()


def test_an_iteration_is_copied_and_the_training_goes_on_before_the_disk_has_it(training, gate):
    training.keep(1)
    training.learner.weight += 100
    assert training.checkpoints.find("last").iteration == 0
    gate.set()
    training.writer.close()
    assert training.checkpoints.find("last").iteration == 1
    assert training.checkpoints.load_policy("last")[0]["w"].tolist() == [1, 1, 1]
    state = training.checkpoints.load_state("last")
    assert state["learner"]["optimiser"]["0.exp_avg"].tolist() == (torch.ones(3) / 3).tolist()
    assert "network" not in state["learner"], "the weights stand in the policy's file"


def test_never_two_at_once_and_in_their_order(training, gate):
    training.keep(1)
    second = threading.Thread(target=training.keep, args=(2,))
    second.start()
    time.sleep(0.05)
    assert second.is_alive(), "the second waits for the first"
    gate.set()
    second.join()
    training.writer.close()
    assert [row["iteration"] for row in training.run.read_metrics()] == [1, 2]


@pytest.mark.parametrize("noticed_by", ["the next iteration", "the end"])
def test_a_full_disk_is_told_and_an_older_whole_state_stands(training, monkeypatch, noticed_by):
    training.keep(1)
    training.writer._background.call_done(wait=True)

    def full(*_args, **_named):
        raise OutputFileError("run: the disk is full")

    monkeypatch.setattr(Checkpoints, "save", full)
    training.keep(2)
    with pytest.raises(OutputFileError, match="disk is full"):
        training.keep(3) if noticed_by == "the next iteration" else training.writer.close()
    assert training.checkpoints.load_state("last")["loop"] == {"iteration": 1}


def test_closing_twice_is_closing_once(training):
    training.keep(1)
    training.writer.close()
    training.writer.close()
    assert training.checkpoints.find("last").iteration == 1


def test_while_workers_collect_the_disk_waits_and_while_the_learner_learns_it_does_not(tmp_path, monkeypatch):
    monkeypatch.setattr(run_writer, "HELD_SECONDS", 60.0)
    training = Training(tmp_path / "run", by_workers=True)
    for iteration in (1, 2):
        training.keep(iteration)
        time.sleep(0.1)
        assert training.checkpoints.find("last").iteration == iteration - 1, "workers have every core"
        training.writer.collected()
        assert soon(lambda at=iteration: training.checkpoints.find("last").iteration == at)
    training.keep(3)
    began = time.monotonic()
    training.writer.close()
    assert training.checkpoints.find("last").iteration == 3
    assert time.monotonic() - began < 30, "the end waits for nobody"


def test_where_collecting_takes_long_the_disk_does_not_wait_for_its_end(tmp_path, monkeypatch):
    monkeypatch.setattr(run_writer, "HELD_SECONDS", 0.05)
    training = Training(tmp_path / "run", by_workers=True)
    training.keep(1)
    assert soon(lambda: training.checkpoints.find("last").iteration == 1)
    training.writer.close()


def soon(holds, seconds=60.0):
    """Tell whether something holds before the seconds are over."""
    until = time.monotonic() + seconds
    while time.monotonic() < until:
        if holds():
            return True
        time.sleep(0.01)
    return False
