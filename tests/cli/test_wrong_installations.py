"""Folders of DeepRacer for Cloud that cannot be used: each ends with exit code 2 and a letter that says where."""

from pathlib import Path

import pytest

from racecraft.formats.job_spec import JobSpec
from racecraft.formats.run_folder import RunFolder
from racecraft.jobs.job import new_job
from racecraft.jobs.job_paths import JobPaths
from racecraft.worlds.deepracer.files.drfc_jobs import RecordedJob, record_job

GOOD = {
    "run.env": "DR_WORLD_NAME=reinvent_base\n",
    "bucket/custom_files/reward_function.py": "def reward_function(params):\n    return 1.0\n",
    "bucket/custom_files/model_metadata.json": None,
    "bucket/custom_files/hyperparameters.json": "{}\n",
}
START = ("dr", "start-training", "-q")
TRAIN = ("dr", "run-training")
"""What start-training has done in the background; its letters come back to where that was typed."""


def no_job(home, spec):
    raise AssertionError(f"a job was begun: {spec}")


@pytest.fixture
def installation(racecraft, tmp_path, monkeypatch):
    """A folder in which a training could begin, and a home of jobs with nothing at work; no supervisor is started."""
    for name in ("DR_DIR", "DR_CONFIG", "RACECRAFT_DR_EXPERIMENT"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setenv("RACECRAFT_JOBS", str(tmp_path / "jobs"))
    monkeypatch.setattr("racecraft.jobs.submit.submit", no_job)
    assert racecraft("new", "parts").code == 0
    for name, text in GOOD.items():
        path = tmp_path / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text((tmp_path / "parts" / path.name).read_text() if text is None else text)
    return tmp_path


def run_env(*lines):
    return {"run.env": "DR_WORLD_NAME=reinvent_base\n" + "\n".join(lines) + "\n"}


def at_work(folder, run_id=0):
    """Note a training as at work, as dr-start-training would."""
    store = JobPaths.of_user().store()
    store.add(new_job(JobSpec(("dr",), "busy-1", run=str(folder / "bucket" / "other")), 0.0))
    record_job(folder, run_id, "training", RecordedJob("busy-1", str(folder / "bucket" / "other")))


def is_judged(folder):
    """Note an evaluation of the model as at work."""
    JobPaths.of_user().store().add(new_job(JobSpec(("dr",), "busy-2"), 0.0))
    record_job(folder, 0, "evaluation", RecordedJob("busy-2", str(folder / "bucket" / "rl-deepracer-sagemaker")))


def model(folder, name="rl-deepracer-sagemaker"):
    RunFolder.create(folder / "bucket" / name, {"kind": "deepracer"})


def is_gone(name):
    return lambda folder: (folder / name).unlink()


WRONG = [  # what is written, what is done to the folder, what is typed, what the letter begins with, what it holds
    # no folder, or another
    ({}, None, ("dr", "--folder", "nowhere", "summary"), "nowhere", "there is no such folder"),
    ({}, is_gone("run.env"), START, "run.env", "`racecraft init .` makes a folder with them"),
    ({}, None, ("dr", "--experiment", "../parts", "summary"), "experiments/../parts", "there is no such experiment"),
    # lines and quotes
    (run_env("DR_CAR_NAME=\u201dfast"), None, START, "run.env:2: DR_CAR_NAME", "opens a quote"),
    ({"system.env": "DR_WORKERS 4\n"}, None, START, "system.env:1", "expected lines of KEY=VALUE"),
    ({"system.env": b"\xff\xfe\x00"}, None, START, "system.env", "text in UTF-16"),
    # values
    (run_env("DR_RUN_ID=one"), None, START, "run.env:2: DR_RUN_ID", "a whole number from 0 to 999"),
    (run_env("DR_WORLD_NAME=reinvent_bse"), None, TRAIN, "run.env:2: DR_WORLD_NAME", "Did you mean 'reinvent_base'"),
    (run_env("RACECRAFT_SET=ppo.clp=1"), None, TRAIN, "ppo has no setting 'clp'", "Did you mean 'clip'"),
    (run_env("DR_EVAL_NUMBER_OF_TRIALS=0"), model, ("dr", "start-evaluation"), "run.env:2", "a number from 1 to 1000"),
    # prefixes
    (run_env("DR_LOCAL_S3_MODEL_PREFIX=../out"), None, START, "run.env:2: DR_LOCAL_S3_MODEL_PREFIX", "stays inside"),
    (run_env("DR_LOCAL_S3_MODEL_PREFIX=/tmp/out"), None, START, "run.env:2", "stays inside its folder"),
    (run_env("DR_LOCAL_S3_REWARD_KEY=../reward.py"), None, TRAIN, "run.env:2", "stays inside its folder"),
    ({}, model, START, "run.env: DR_LOCAL_S3_MODEL_PREFIX", "holds files already"),
    (run_env("DR_LOCAL_S3_PRETRAINED=True", "DR_LOCAL_S3_PRETRAINED_PREFIX=old"), None, TRAIN, "run.env:3",
     "there is no folder 'old'"),
    # files
    ({}, is_gone("bucket/custom_files/reward_function.py"), TRAIN, "run.env: DR_LOCAL_S3_REWARD_KEY",
     "dr-upload-custom-files copies custom_files there"),
    # workers
    (run_env("DR_TRAIN_MULTI_CONFIG=True", "DR_WORKERS=2"), None, TRAIN, "run.env:2", "there is no worker-2.env"),
    ({**run_env("DR_TRAIN_MULTI_CONFIG=True", "DR_WORKERS=2"), "worker-2.env": "DR_WORLD_NAME=x_track"}, None, TRAIN,
     "worker-2.env:1: DR_WORLD_NAME", "no circuit of this name"),
    # what is at work, and what is not
    ({}, at_work, START, "run id 0: a training is under way (busy-1", "dr-stop-training ends it"),
    ({}, is_judged, ("dr", "start-evaluation"), "run id 0: an evaluation is under way (busy-2)", "expected none"),
    (run_env("DR_RUN_ID=3", "DR_LOCAL_S3_MODEL_PREFIX=other"), lambda folder: at_work(folder, 1), START,
     "bucket/other: job busy-1 trains there", "a prefix of its own"),
    ({}, None, ("dr", "stop-training"), ".: no training of run id 0 is known", "dr-start-training"),
    ({".racecraft/run-0.json": '{"training": 3}'}, None, ("dr", "stop-training"), ".racecraft/run-0.json", "training"),
    # models
    *(
        ({}, None, ("dr", *words), "run.env", "holds no model yet; expected a model that was trained")
        for words in (("start-evaluation",), ("upload-model", "-fL"), ("start-metrics",))
    ),
    ({}, model, ("dr", "start-loganalysis"), "bucket/rl-deepracer-sagemaker: no row of a simulation trace yet",
     "dr-logs-sagemaker shows how far"),
    ({}, model, ("dr", "increment-training"), "Train rl-deepracer-sagemaker-1 next", "expected -f"),
    ({}, model, ("dr", "increment-training", "-f", "-p", "../x"), "'../x'", "leaves the bucket"),
    ({}, model, ("dr", "upload-model", "-f"), "run.env: DR_UPLOAD_S3_BUCKET: it has no value", "-L"),
    ({}, model, ("dr", "download-model", "-f", "-s", "s3://mine/x", "-t", "y"), "s3://mine: is no bucket", "bucket"),
    ({}, None, ("dr", "local-aws", "s3", "sync", "a", "b"), "'s3 sync a b' is not understood", "cp, ls and rm"),
]  # fmt: skip


@pytest.mark.parametrize(("files", "happens", "typed", "place", "found"), WRONG)
def test_a_letter_says_where_and_what(racecraft, installation, files, happens, typed, place, found):
    for name, text in files.items():
        path = installation / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_bytes(text if isinstance(text, bytes) else text.encode())
    if happens is not None:
        happens(installation)
    said = racecraft(*typed)
    assert (said.code, said.err.startswith(f"racecraft: {place}")) == (2, True), said.err
    assert found in said.err
    assert "Traceback" not in said.err
    assert begun(installation) <= {"busy-1", "busy-2"}, "a refused command begins nothing"


def begun(installation):
    home = JobPaths.of_user()
    return {job.name for job in home.store().jobs()} if home.path.exists() else set()


def test_an_unknown_variable_is_named_with_its_nearest_in_the_table(racecraft, installation):
    (installation / "run.env").write_text("DR_WORLD_NAM=Oval_track\n")
    said = racecraft("settings", ".")
    assert said.code == 0
    assert "DR_WORLD_NAM  " in said.out
    assert "Did you mean 'DR_WORLD_NAME'?  [run.env:1]" in said.out


def test_a_secret_is_neither_printed_nor_written_down(racecraft, installation):
    (installation / "system.env").write_text("DR_LOCAL_SECRET_ACCESS_KEY=hush-hush\n")
    for typed in (("settings", "."), ("settings", ".", "--json"), ("dr", "summary"), ("dr", "update-env")):
        said = racecraft(*typed)
        assert said.code == 0, said.err
        assert "hush-hush" not in said.out + said.err
    written = [path for path in Path(installation).rglob("*") if path.is_file() and path.name != "system.env"]
    assert not [path for path in written if b"hush-hush" in path.read_bytes()]
