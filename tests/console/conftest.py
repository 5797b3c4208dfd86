"""A run folder that costs nothing, and a console over a workspace of such runs."""

import json

import pytest

from racecraft.console.index import Index
from racecraft.console.workspace import Workspace


def write_run(path, rows=3, track="reinvent_base", lap=7.0, seconds=60.0):
    """Write the least that a car's run holds: what was asked, and metrics."""
    path.mkdir(parents=True)
    job = {
        "format": "racecraft run", "version": 1, "kind": "deepracer", "title": track, "algorithm": "ppo",
        "asked": {"stops": ["minutes=10"], "track": track},
        "track": {"name": track}, "settings": {"race": {"type": "TIME_TRIAL"}},
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
