"""Every training: what comes before what, what a resumed run may be given, and what is left."""

import contextlib
from dataclasses import dataclass
from pathlib import Path
from types import SimpleNamespace
from typing import ClassVar

import pytest
from typer.testing import CliRunner

import racecraft as rc
from racecraft.actions.train_run import TrainedRun, train_run
from racecraft.actions.training_options import TrainingOptions
from racecraft.cli.app import app
from racecraft.contract.errors import SettingError
from racecraft.settings.request import make_request, option
from racecraft.training.signals import SIGTERM
from racecraft.training.trained import Trained

SMALL = {"rollout.num_worlds": 2, "rollout.horizon": 8, "evaluation.episodes": 1}


@dataclass(frozen=True, kw_only=True)
class Walk(TrainingOptions):
    kind: ClassVar[str] = "gymnasium"
    length: int = option(9, "Cells.")

    def request(self, progress):
        return "a request"

    def open_page(self, progress):
        return self.page

    page: object = None


@pytest.fixture
def done(monkeypatch):
    """Nothing is trained; what is done, in order."""
    steps = []

    @contextlib.contextmanager
    def mirrored(shown, place, progress, run):
        yield shown
        steps.append("mirrored")

    def train(request, callback, progress, spread):
        steps.append(f"train {request}")
        return Trained("gymnasium", SimpleNamespace(path=Path("r")), None, 1, {"stopped_by": steps[0]})

    def resume(run, stops, callback, progress, kind, spread, again):
        steps.append(f"resume {run} {stops} {kind}")
        return Trained("gymnasium", SimpleNamespace(path=Path("r")), None, 1, {"stopped_by": "laps"})

    def leave(trained, pictures, progress):
        steps.append("left")
        return {"report": "report.html"}

    monkeypatch.setattr("racecraft.actions.mirroring.mirrored", mirrored)
    monkeypatch.setattr("racecraft.training.worlds.train", train)
    monkeypatch.setattr("racecraft.training.worlds.resume", resume)
    monkeypatch.setattr("racecraft.actions.train_run.leave_files", leave)
    return steps


def test_what_is_left_is_mirrored_and_the_page_stays_open_behind_it(done):
    page = SimpleNamespace(close=lambda: done.append("page closed"))
    trained = train_run(Walk(page=page))
    assert done == ["train a request", "left", "mirrored"]
    assert trained.page is page
    assert trained.as_dictionary() == {"stopped_by": "train a request", "report": "report.html"}


def test_a_training_that_fails_closes_its_page(done, monkeypatch):
    monkeypatch.setattr("racecraft.training.worlds.train", lambda *arguments: 1 / 0)
    with pytest.raises(ZeroDivisionError):
        train_run(Walk(page=SimpleNamespace(close=lambda: done.append("page closed"))))
    assert done == ["mirrored", "page closed"] or done == ["page closed"]


def test_sigterm_leaves_no_pictures_and_is_the_exit_code(done, monkeypatch):
    run = SimpleNamespace(path=Path("r"))
    stopped = Trained("gymnasium", run, None, 1, {"stopped_by": SIGTERM})
    monkeypatch.setattr("racecraft.training.worlds.train", lambda *arguments: stopped)
    assert (train_run(Walk()).exit_code, done) == (143, ["mirrored"])
    assert TrainedRun(**vars(stopped)).exit_code == 143


@pytest.mark.parametrize(
    ("given", "flag"), [({"length": 9}, "--length"), ({"seed": 1}, "--seed"), ({"keep": "all"}, "--keep")]
)
def test_an_option_that_would_change_a_resumed_run_is_refused_even_at_its_default(given, flag, done):
    with pytest.raises(SettingError, match=f"{flag} cannot change"):
        train_run(make_request(Walk, resume=True, run="r", **given))
    assert done == []


def test_python_trains_detaches_and_resumes_by_the_options_of_the_command(tmp_path, monkeypatch):
    run = tmp_path / "run"
    trained = rc.train(
        "gymnasium", environment="CartPole-v1", settings=SMALL, stops="iterations=1", run=run, quiet=True
    )
    assert (trained.summary()["iterations"], trained.files) == (1, {})
    again = rc.train("gymnasium", run=run, resume=True, stops="iterations=2", quiet=True)
    assert again.summary()["iterations"] == 2
    with pytest.raises(SettingError, match=r"--seed cannot change"):
        rc.train("gymnasium", run=run, resume=True, seed=5, quiet=True)
    asked = {}
    monkeypatch.setattr(
        "racecraft.actions.submit_job.submit_training", lambda *words, **more: asked.update(words=words)
    )
    rc.train("gymnasium", environment="CartPole-v1", settings=SMALL, detach=True, seed=3, quiet=True)
    verb, words, place = asked["words"]
    assert (verb, place) == (("gym", "train"), None)
    assert words == ("--seed=3", "--set=rollout.num_worlds=2", "--set=rollout.horizon=8",
                     "--set=evaluation.episodes=1", "--no-pictures", "CartPole-v1")  # fmt: skip


@pytest.mark.parametrize(("environment", "text"), [("CartPole-v1", "not solved, mean"), ("Pendulum-v1", "v1: mean")])
def test_a_training_is_called_solved_or_not_only_where_a_score_counts_as_solved(environment, text, tmp_path):
    settings = ["--set", "rollout.horizon=8", "--set", "evaluation.episodes=1", "--stop", "iterations=1"]
    typed = ["gym", "train", environment, "--run", str(tmp_path / "run"), *settings]
    assert text in CliRunner().invoke(app, typed, catch_exceptions=False).output
