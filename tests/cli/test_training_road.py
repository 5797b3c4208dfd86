"""The road of every command that trains: what comes before what."""

import contextlib
from types import SimpleNamespace

import pytest
from typer.testing import CliRunner

from racecraft.actions.training_options import TrainingOptions
from racecraft.cli.app import app
from racecraft.cli.training import Road


@pytest.fixture
def told(monkeypatch, tmp_path):
    """Nobody trains; keep what is done, in order."""
    done = []
    trained = SimpleNamespace(run=SimpleNamespace(path=tmp_path), summary=lambda: {"steps": 3, "stopped_by": "steps=3"})

    @contextlib.contextmanager
    def mirrored(shown, place, tell, run):
        yield shown
        done.append("mirrored")

    def train(request, callback, tell, spread):
        done.append(f"train {request}")
        return trained

    def resume(run, stops, callback, tell, kind, spread, again):
        done.append(f"resume {run.name} {stops} {kind}")
        return trained

    monkeypatch.setattr("racecraft.actions.mirroring.mirrored", mirrored)
    monkeypatch.setattr("racecraft.training.worlds.train", train)
    monkeypatch.setattr("racecraft.training.worlds.resume", resume)
    return done


@pytest.fixture
def travel(told, monkeypatch):
    """Travel the road with some options; return what was done, in order."""

    @contextlib.contextmanager
    def page(shown):
        yield shown
        told.append("page closed")

    def leave(trained, pictures, progress):
        told.append("left")
        return {"report": "report.html"}

    monkeypatch.setattr("racecraft.actions.training.leave_pictures", leave)

    def go(json=False, **options):
        road = Road("gymnasium", "runs/CartPole-v1-1", ("environment",), beside=page)
        context = SimpleNamespace(command=SimpleNamespace(params=[]), get_parameter_source=lambda name: None)
        asked = TrainingOptions(**options)
        road.train(context, asked, lambda: "CartPole", lambda trained, left: told.append(f"told {left}"), json)
        return told

    return go


def test_what_is_left_is_mirrored_and_what_is_told_is_told_while_the_page_stands(travel):
    left = {"report": "report.html"}
    assert travel() == ["train CartPole", "left", "mirrored", f"told {left}", "page closed"]


def test_json_is_told_instead(travel, capsys):
    assert travel(json=True) == ["train CartPole", "left", "mirrored", "page closed"]
    assert capsys.readouterr().out == '{"steps": 3, "stopped_by": "steps=3", "report": "report.html"}\n'


def test_a_run_goes_on_by_its_own_stops_or_those_that_are_typed(travel, tmp_path):
    assert travel(resume=True, run=tmp_path / "r", stop=["laps"])[0] == "resume r ('laps',) gymnasium"


@pytest.mark.parametrize(("environment", "told"), [("CartPole-v1", "not solved, mean"), ("Pendulum-v1", "v1: mean")])
def test_a_training_is_called_solved_or_not_only_where_a_score_counts_as_solved(environment, told, tmp_path):
    settings = ["--set", "rollout.horizon=8", "--set", "evaluation.episodes=1", "--stop", "iterations=1"]
    asked = ["gym", "train", environment, "--run", str(tmp_path / "run"), *settings]
    assert told in CliRunner().invoke(app, asked, catch_exceptions=False).output
