"""A run folder that costs nothing, and a console over a workspace of such runs."""

import contextlib
import json

import pytest
from tests.jobs.conftest import end_supervisor

import racecraft as rc
from racecraft.console.application import make_console
from racecraft.console.index import Index
from racecraft.console.workspace import Workspace
from racecraft.jobs.job_paths import JobPaths
from racecraft.web.server import ServerThread

ACTIONS = [{"steering_angle": angle, "speed": 2.0} for angle in (-30.0, 0.0, 30.0)]


def write_run(path, rows=3, track="reinvent_base", lap=7.0, seconds=60.0):
    """Write the least that a car's run holds: what was asked, and metrics."""
    path.mkdir(parents=True)
    job = {
        "format": "racecraft run", "version": 1, "kind": "deepracer", "title": track, "algorithm": "ppo",
        "asked": {"stops": ["minutes=10"], "track": track},
        "track": {"name": track}, "settings": {"race": {"type": "TIME_TRIAL"}},
        "model_metadata": {"sensor": ["FRONT_FACING_CAMERA"], "action_space": ACTIONS, "version": "4"},
    }  # fmt: skip
    lines = [
        {
            "iteration": number, "steps": 2048 * number, "seconds": seconds * number / rows, "steps_per_second": 2000.0,
            "mean_reward": 1.0 * number, "training_score": 100.0 * number / rows, "evaluation_score": None,
            "flying_lap_seconds": lap if number == rows else None, "gap_percent": 12.0 if number == rows else None,
        }
        for number in range(1, rows + 1)
    ]  # fmt: skip
    (path / "metrics.jsonl").write_text("".join(json.dumps(line) + "\n" for line in lines))
    (path / "job.json").write_text(json.dumps(job))
    return path


@pytest.fixture
def workspace(tmp_path):
    return Workspace.open(tmp_path / "workspace")


@pytest.fixture
def index(workspace):
    made = Index(workspace)
    yield made
    made.close()


@pytest.fixture
def working_console(tmp_path, monkeypatch):
    """A console whose jobs run, over a workspace with one trained pole: (address, console, home of the jobs)."""
    monkeypatch.delenv("RACECRAFT_JOB_STORE", raising=False)
    monkeypatch.setenv("RACECRAFT_JOBS", str(tmp_path / "jobs"))
    monkeypatch.setattr("racecraft.console.application.keep_warm", lambda home: contextlib.nullcontext())
    rc.train(
        "gymnasium", environment="CartPole-v1", run=tmp_path / "workspace/runs/pole", quiet=True,
        stops="iterations=2", settings={"rollout.horizon": 16, "evaluation.episodes": 1},
    )  # fmt: skip
    home = JobPaths.of_user()
    application = make_console(tmp_path / "workspace", home)
    server = ServerThread(application, "console")
    yield f"http://127.0.0.1:{server.start('127.0.0.1', 0)}", application.state.console, home
    server.close()
    end_supervisor(home)
