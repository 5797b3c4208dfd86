"""`dr-start-training` with a real supervisor: what its job refuses comes back, and no trace of it is kept."""

import json
import shutil
import subprocess
import sys

import pytest
from tests.cli.conftest import TINY
from tests.jobs.conftest import end_supervisor

from racecraft.jobs.job_paths import JobPaths
from racecraft.worlds.deepracer.files.drfc_jobs import RecordedJob, job_of, record_job

SETTINGS = f'RACECRAFT_SET="{" ".join(TINY[1::2])}"\nRACECRAFT_STOP=iterations=1\n'


@pytest.fixture
def installation(racecraft, tmp_path, monkeypatch):
    for name in ("DR_DIR", "DR_CONFIG", "RACECRAFT_DR_EXPERIMENT", "RACECRAFT_JOB_STORE"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setenv("RACECRAFT_JOBS", str(tmp_path / "jobs"))
    assert racecraft("init", "my cars").code == 0
    monkeypatch.chdir(tmp_path / "my cars")
    assert racecraft("dr", "upload-custom-files").code == 0
    yield tmp_path / "my cars"
    end_supervisor(JobPaths.of_user())


def bucket(installation):
    return sorted(str(path.relative_to(installation)) for path in (installation / "bucket").rglob("*"))


def test_what_the_job_refuses_is_refused_here_and_leaves_no_trace(racecraft, installation):
    """The one before stays the one whose log is shown, and what would be wiped stays where it is."""
    (installation / "run.env").write_text("DR_WORLD_NAME=reinvent_bse\n" + SETTINGS)
    record_job(installation, 0, "training", RecordedJob("older-1", "bucket/older"))
    model = installation / "bucket" / "rl-deepracer-sagemaker"
    model.mkdir()
    (model / "old.txt").touch()
    before = bucket(installation)
    said = racecraft("dr", "start-training", "-w")
    assert said.code == 2
    assert said.err.startswith(f"racecraft: {installation}/run.env:1: DR_WORLD_NAME"), said.err
    assert "Did you mean 'reinvent_base'" in said.err
    assert "trains run id" not in said.out
    assert JobPaths.of_user().store().jobs() == []
    assert job_of(installation, 0, "training") == RecordedJob("older-1", "bucket/older")
    assert bucket(installation) == before


def test_a_model_that_the_new_training_begins_with_is_not_wiped(racecraft, installation, trained):
    model = shutil.copytree(trained, installation / "bucket" / "rl-deepracer-sagemaker")
    begins_with = "DR_LOCAL_S3_PRETRAINED=True\nDR_LOCAL_S3_PRETRAINED_PREFIX=rl-deepracer-sagemaker\n"
    (installation / "run.env").write_text("DR_WORLD_NAME=reinvent_base\n" + SETTINGS + begins_with)
    said = racecraft("dr", "start-training", "-w")
    assert said.code == 2
    assert "DR_LOCAL_S3_PRETRAINED_PREFIX" in said.err
    assert "expected a model that is not the one to be wiped" in said.err
    assert (model / "job.json").exists()


def test_it_returns_when_the_run_stands_and_a_wiped_one_is_begun_anew(racecraft, installation):
    (installation / "run.env").write_text("DR_WORLD_NAME=reinvent_base\n" + SETTINGS)
    model = installation / "bucket" / "rl-deepracer-sagemaker"
    model.mkdir()
    (model / "old.txt").touch()
    said = racecraft("dr", "start-training", "-q", "-w")
    assert said.code == 0, said.err
    assert job_of(installation, 0, "training").job == "training-rl-deepracer-sagemaker-1"
    assert "training-rl-deepracer-sagemaker-1 trains run id 0 into " in said.out
    assert json.loads((model / "job.json").read_text())["kind"] == "deepracer"
    assert not (model / "old.txt").exists()
    assert racecraft("jobs", "wait", "training-rl-deepracer-sagemaker-1").code == 0


def test_one_that_is_stopped_before_it_begins_is_not_said_to_train(racecraft, installation, monkeypatch):
    from racecraft.jobs import submit

    monkeypatch.setattr(submit, "ensure_supervisor", lambda home: None)  # so that it waits until it is stopped
    monkeypatch.setattr(submit, "wait_for_run", submit.request_stop)
    said = racecraft("dr", "start-training")
    assert said.code == 0, said.err
    assert "training-rl-deepracer-sagemaker-1: Stopped before it began" in said.out
    assert "trains run id" not in said.out


def test_ctrl_c_while_it_begins_leaves_it_to_itself(racecraft, installation, monkeypatch):
    from racecraft.jobs import submit

    def interrupted(*_):
        raise KeyboardInterrupt

    monkeypatch.setattr(submit, "ensure_supervisor", lambda home: None)
    monkeypatch.setattr(submit, "wait_for_run", interrupted)
    said = racecraft("dr", "start-training")
    assert (said.code, "training-rl-deepracer-sagemaker-1 goes on by itself." in said.out) == (0, True)
    assert [job.waits for job in JobPaths.of_user().store().jobs()] == [True]
    assert job_of(installation, 0, "training").job == "training-rl-deepracer-sagemaker-1"


WITHOUT_IMPORTS = """
import sys
from racecraft.cli.entry import main
sys.argv = ["racecraft", "dr", "start-training"]
try:
    main()
except SystemExit as ended:
    print(ended.code, [name for name in ("numpy", "torch", "numba", "boto3") if name in sys.modules])
"""


def test_the_command_itself_imports_nothing_that_takes_time(installation):
    """Whoever types it waits for the job's imports and not for the same ones here first."""
    occupied = installation / "bucket" / "rl-deepracer-sagemaker"
    occupied.mkdir()
    (occupied / "old.txt").touch()
    said = subprocess.run([sys.executable, "-c", WITHOUT_IMPORTS], capture_output=True, text=True, check=True)
    assert "holds files already" in said.stderr
    assert said.stdout == "2 []\n"
