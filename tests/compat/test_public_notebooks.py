"""The public notebooks of log analysis run as they stand on folders of ours, where somebody has them unpacked.

RACECRAFT_ANALYSIS_NOTEBOOKS   a copy of aws-deepracer-community/deepracer-analysis (2026)
RACECRAFT_WORKSHOP_NOTEBOOKS   a copy of aws-samples/aws-deepracer-workshops as of 2019 (27 November, say), or its
                               log-analysis folder
RACECRAFT_LOGS_RUN             a run folder of ours on reinvent_base with 15 iterations of AWS's at least, full laps and
                               a judged race; absent: one is trained, which takes minutes

Nothing of them is copied here, and no cell is changed but for two names: MY_SIM_ID, which says "CHANGE This", and the
id of an evaluation in AWS's cloud. Four use deepracer-utils itself; that of 2019 uses `log_analysis` and `cw_utils` as
`racecraft notebooks` writes them. Of that one are left out: what needs TensorFlow 1 or shapely 1, what Coach and S3
left beside a model of that year, and its heat map in a picture of 5 by 8 m, out of which a car beside the road falls.
`Visual_Analysis` needs TensorFlow throughout and runs with another interpreter:

RACECRAFT_TENSORFLOW_PYTHON    one with tensorflow-cpu, deepracer-utils and opencv-python-headless

It asks for AWS's storage as it stands, in a cell whose login is commented out: there `s3` becomes `example`.
"""

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

import racecraft
from racecraft.worlds.deepracer.logs import local_streams

ANALYSIS, WORKSHOP = (os.environ.get(f"RACECRAFT_{name}_NOTEBOOKS") for name in ("ANALYSIS", "WORKSHOP"))
RUN = os.environ.get("RACECRAFT_LOGS_RUN")
TENSORFLOW = os.environ.get("RACECRAFT_TENSORFLOW_PYTHON")
HERE, HOME = Path(__file__).parent, Path(racecraft.__file__).parent.parent
PHASES = ("training", "evaluation")
SECONDS = 300
pytestmark = [
    pytest.mark.long,
    pytest.mark.timeout(3 * SECONDS),
    pytest.mark.skipif(not (ANALYSIS or WORKSHOP), reason="RACECRAFT_ANALYSIS_NOTEBOOKS names no copy of them"),
]
NEEDS_TENSORFLOW_1 = ("tensorflow", "load_session", "model_inference", "heatmaps", "GRAPH_PB_PATH")
NEEDS_SHAPELY_1 = ("road_poly",)
FIXED_PICTURE = ("track = plot_track(df",)
FROM_COACH_AND_S3 = ("worker_0.simple_rl_graph", "df_csv", "aws s3 sync", "S3 bucket")


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    """A run with laps and a judged race."""
    if RUN:
        return Path(RUN).expanduser().resolve()
    folder = tmp_path_factory.mktemp("trained") / "run"
    commands = (
        ["train", "--stop", "iterations=14", "--run", folder], ["evaluate", folder, "--number-of-trials", 3],
    )  # fmt: skip
    for command in commands:
        words = [sys.executable, "-m", "racecraft", *map(str, command)]
        subprocess.run(words, check=True, capture_output=True, timeout=2 * SECONDS, env=environment())
    return folder


def environment(*paths):
    known = {name: value for name, value in os.environ.items() if name != "AWS_PROFILE"}
    return {**known, "PYTHONPATH": os.pathsep.join(map(str, (*paths, HOME))), "AWS_DEFAULT_REGION": "us-east-1"}


def ran(notebook, bucket=None, without=(), python=sys.executable):
    """Run a notebook where it lies; return the numbers of the cells that ran and of those left out."""
    options = [*(["--bucket", bucket] if bucket else []), *(f"--without={text}" for text in without)]
    told = subprocess.run(
        [python, HERE / "notebook_runner.py", notebook.name, *options],
        cwd=notebook.parent, env=environment(), capture_output=True, text=True, timeout=SECONDS,
    )  # fmt: skip
    assert told.returncode == 0, told.stderr[-3000:]
    return json.loads(told.stdout.splitlines()[-1])


@pytest.mark.skipif(not ANALYSIS, reason="RACECRAFT_ANALYSIS_NOTEBOOKS names no copy of deepracer-analysis")
@pytest.mark.parametrize(
    ("name", "cells"),
    [("Training_analysis", 32), ("Evaluation_analysis", 14), ("Metrics", 14), ("ActionSpace_analysis", 30)],
)
def test_the_communitys_notebooks_run_on_a_run_of_ours(tmp_path, run, name, cells):
    pytest.importorskip("deepracer.logs", reason="deepracer-utils is not installed")
    copy = Path(ANALYSIS).expanduser().resolve()
    (tmp_path / f"{name}.ipynb").write_bytes((copy / f"{name}.ipynb").read_bytes())
    (tmp_path / "tracks").symlink_to(copy / "tracks")
    (tmp_path / "logs").mkdir()
    (tmp_path / "logs" / "sample-console-logs").symlink_to(run)
    told = ran(tmp_path / f"{name}.ipynb", bucket=run)
    assert told["left"] == []
    assert len(told["ran"]) >= cells


@pytest.mark.skipif(not (ANALYSIS and TENSORFLOW), reason="needs RACECRAFT_TENSORFLOW_PYTHON beside the notebooks")
def test_visual_analysis_sees_through_models_of_ours(tmp_path):
    """All of its cells, over three checkpoints of a training of ours as `racecraft export` writes them."""
    folder, models = tmp_path / "run", tmp_path / "logs" / "sample-model" / "model"
    short = ("--set", "rollout.episodes_per_iteration=1", "--set", "race.max_episode_seconds=2")
    commands = [["train", "--preset", "aws", *short, "--stop", "iterations=3", "--run", folder]]
    commands += [["export", f"{folder}:{k}", "--to", "drfc", "--output", tmp_path / f"bucket-{k}"] for k in (1, 2, 3)]
    for command in commands:
        words = [sys.executable, "-m", "racecraft", *map(str, command)]
        subprocess.run(words, check=True, capture_output=True, timeout=SECONDS, env=environment())
    models.mkdir(parents=True)
    for k in (1, 2, 3):
        (graph,) = (tmp_path / f"bucket-{k}" / "model").glob("model_*.pb")
        (models / f"model_{k}.pb").write_bytes(graph.read_bytes())
    (models / "model_metadata.json").write_bytes((tmp_path / "bucket-1" / "model" / "model_metadata.json").read_bytes())
    copy = Path(ANALYSIS).expanduser().resolve()
    (tmp_path / "logs" / "sample-model" / "pictures").symlink_to(copy / "logs" / "sample-model" / "pictures")
    text = (copy / "Visual_Analysis.ipynb").read_text(encoding="utf-8")
    assert "model_type = 's3'" in text
    notebook = tmp_path / "Visual_Analysis.ipynb"
    notebook.write_text(text.replace("model_type = 's3'", "model_type = 'example'"), encoding="utf-8")
    told = ran(notebook, python=TENSORFLOW)
    assert told["left"] == []
    assert len(told["ran"]) == 12


@pytest.mark.skipif(not WORKSHOP, reason="RACECRAFT_WORKSHOP_NOTEBOOKS names no copy of aws-deepracer-workshops")
def test_the_workshops_notebook_of_2019_runs_through_our_names(tmp_path, run, monkeypatch):
    from racecraft.worlds.deepracer.notebooks.write import FILES, MODULES

    copy = Path(WORKSHOP).expanduser().resolve()
    copy = copy if copy.name == "log-analysis" else copy / "log-analysis"
    text = (copy / "DeepRacer Log Analysis.ipynb").read_text(encoding="utf-8")
    if "cw_utils" not in text:
        pytest.skip("this copy asks AWS's service, which is no more; check out one of 2019")
    (tmp_path / "runs").mkdir()
    (tmp_path / "runs" / "mine").symlink_to(run)
    monkeypatch.setenv(local_streams.ROOT, str(tmp_path / "runs"))
    training, evaluation = (local_streams.simulation_id(tmp_path / "runs" / "mine", one) for one in PHASES)
    text = text.replace("'MY_SIM_ID'", repr(training)).replace("'sim-h712thgp6gz2'", repr(evaluation))
    for name in MODULES:
        (tmp_path / name).write_bytes((FILES / name).read_bytes())
    for folder in ("tracks", "simulation_episode"):
        (tmp_path / folder).symlink_to(copy / folder)
    (tmp_path / "logs").mkdir()
    for phase, name in zip((training, evaluation), ("sim-sample", "eval-sim-sample"), strict=True):
        local_streams.download_log(tmp_path / "logs" / f"deepracer-{name}.log", phase)
    notebook = tmp_path / "DeepRacer Log Analysis.ipynb"
    notebook.write_text(text, encoding="utf-8")
    told = ran(notebook, without=NEEDS_TENSORFLOW_1 + NEEDS_SHAPELY_1 + FIXED_PICTURE + FROM_COACH_AND_S3)
    assert len(told["ran"]) >= 31
    assert (tmp_path / "logs" / f"deepracer-{training}.log").read_bytes().startswith(b"SIM_TRACE_LOG:")
