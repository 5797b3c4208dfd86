"""`racecraft bucket` and trainings with a bucket elsewhere, typed as their users type them; wrong ones end with 2.

The store is rclone's, which serves a folder as a bucket.
"""

import sys
from pathlib import Path

import pytest
from tests.cli.conftest import TINY
from tests.storage import servers

from racecraft.storage.object_store import ObjectStore

pytestmark = [servers.needs_s3, servers.needs_rclone]

STOP = ("--stop", "iterations=2", "--no-pictures")


@pytest.fixture(scope="module")
def served(tmp_path_factory):
    folder = tmp_path_factory.mktemp("served") / "models"
    folder.mkdir()
    with servers.rclone(folder) as url:
        yield url, folder


@pytest.fixture(autouse=True)
def reached(served, monkeypatch, tmp_path):
    for name in ("DR_DIR", "DR_CONFIG", "AWS_PROFILE"):
        monkeypatch.delenv(name, raising=False)
    for name, value in {**servers.KEYS, "AWS_ENDPOINT_URL": served[0], "AWS_REGION": "us-east-1"}.items():
        monkeypatch.setenv(name, value)
    monkeypatch.setenv("AWS_CONFIG_FILE", str(tmp_path / "no-config"))
    monkeypatch.setenv("AWS_SHARED_CREDENTIALS_FILE", str(tmp_path / "no-credentials"))
    monkeypatch.setattr(ObjectStore.__init__, "__defaults__", (1,))  # attempts; between them boto3 waits for seconds


def files_of(folder):
    passing = ("run.lock", "mirror.json")
    found = {path.relative_to(folder).as_posix(): path.read_bytes() for path in folder.rglob("*") if path.is_file()}
    return {name: data for name, data in found.items() if name not in passing}


def test_a_training_is_mirrored_gone_on_with_and_begun_from(racecraft, served):
    _, bucket = served
    said = racecraft("train", *STOP, "--run", "a", "--mirror", "s3://models/a", *TINY)
    assert (said.code, "mirrored: s3://models/a holds all of a" in said.out) == (0, True)
    assert files_of(Path("a")) == files_of(bucket / "a")
    again = racecraft("train", "--run", "a", "--resume", "--stop", "iterations=3", "--no-pictures")
    assert again.code == 0, again.err
    assert files_of(Path("a")) == files_of(bucket / "a")
    taken = racecraft("train", *STOP, "--run", "b", "--mirror", "s3://models/a", *TINY)
    assert (taken.code, "expected a free prefix" in taken.err) == (2, True)
    cloned = racecraft("train", *STOP, "--run", "c", "--from", "s3://models/a:last", *TINY)
    assert cloned.code == 0, cloned.err
    assert not Path("runs/s3/models/a/episodes/1.parquet").exists()
    pulled = racecraft("bucket", "pull", "s3://models/a", "d")
    assert pulled.code == 0
    assert files_of(Path("d")) == files_of(Path("a"))


SMALL_BOARDS = (
    "--size", "7", "--snakes", "2", "--set", "rollout.num_worlds=8", "--set", "rollout.horizon=8",
    "--set", "network.image_units=8", "--set", "network.hidden_units=8", "--set", "ppo.batch_size=64",
    "--set", "evaluation.episodes=4", "--set", "snake.max_turns=40", "--set", "runtime.threads=1",
)  # fmt: skip
KINDS = {
    "gym": ("gym", "train", "CartPole-v1", "--set", "rollout.horizon=32"),
    "snakes": ("snakes", "train", *SMALL_BOARDS),
}


@pytest.mark.parametrize("kind", KINDS)
def test_trainings_of_every_kind_are_mirrored_gone_on_with_and_begun_from(racecraft, served, kind):
    _, bucket = served
    words, once = KINDS[kind], ("--stop", "iterations=1")
    said = racecraft(*words, *once, "--run", "a", "--mirror", f"s3://models/{kind}")
    assert (said.code, f"mirrored: s3://models/{kind} holds all of a" in said.out) == (0, True), said.err
    again = racecraft(*words[:2], "--run", "a", "--resume", "--stop", "iterations=2", "--no-pictures")
    assert again.code == 0, again.err
    assert files_of(Path("a")) == files_of(bucket / kind)
    cloned = racecraft(*words, *once, "--no-pictures", "--run", "b", "--from", f"s3://models/{kind}:last")
    assert (cloned.code, f"fetching s3://models/{kind} into" in cloned.out) == (0, True), cloned.err
    taken = racecraft(*words, *once, "--run", "c", "--mirror", f"s3://models/{kind}")
    assert (taken.code, "expected a free prefix" in taken.err) == (2, True)


def test_a_training_goes_on_where_no_store_answers(racecraft, monkeypatch):
    monkeypatch.setenv("AWS_ENDPOINT_URL", "http://127.0.0.1:9")
    said = racecraft("train", *STOP, "--run", "a", "--mirror", "s3://models/a", *TINY)
    assert said.code == 0
    assert "The training begins all the same" in said.out
    assert "not mirrored: s3://models/a lacks" in said.out
    assert "racecraft bucket push a s3://models/a --endpoint-url http://127.0.0.1:9" in said.out
    assert Path("a/checkpoints/2.policy.safetensors").is_file()


def test_a_drfc_folder_trains_with_its_bucket_elsewhere(racecraft, served, tmp_path):
    url, bucket = served
    assert racecraft("init", "inst").code == 0
    folder = tmp_path / "inst"
    settings = " ".join(word for word in TINY if not word.startswith("--"))
    with open(folder / "system.env", "a") as file:
        file.write(f"DR_LOCAL_S3_BUCKET=models\nDR_LOCAL_S3_ENDPOINT_URL={url}\n")
    with open(folder / "run.env", "a") as file:
        file.write(f'RACECRAFT_STOP=iterations=1\nRACECRAFT_SET="{settings}"\n')
    dr = ("dr", "--folder", "inst")
    assert racecraft(*dr, "upload-custom-files").code == 0
    assert (bucket / "custom_files" / "reward_function.py").is_file()
    (bucket / "custom_files" / "reward_function.py").write_text("def reward_function(params):\n    return 2.0\n")
    assert racecraft(*dr, "download-custom-files").code == 0
    assert "2.0" in (folder / "custom_files" / "reward_function.py").read_text()
    said = racecraft(*dr, "run-training")
    assert said.code == 0, said.err
    model = folder / "models" / "rl-deepracer-sagemaker"
    assert files_of(model) == files_of(bucket / "rl-deepracer-sagemaker")
    assert racecraft(*dr, "upload-model", "-fbL").code == 0
    assert (bucket / "rl-deepracer-sagemaker-1" / "job.json").is_file()
    assert racecraft(*dr, "download-model", "-s", "s3://models/rl-deepracer-sagemaker-1", "-t", "again", "-f").code == 0
    assert (bucket / "again" / "job.json").is_file()


PUSH = ("bucket", "push", "here", "s3://models/x")
WRONG = [
    ((*PUSH[:3], "s3://models/../x"), {}, "would leave its folder"),
    (("bucket", "push", "nowhere", "s3://models/x"), {}, "there is no such folder or file"),
    (("bucket", "pull", "s3://models/nothing", "to"), {}, "there is nothing"),
    (PUSH, {"AWS_SECRET_ACCESS_KEY": "guess"}, "SignatureDoesNotMatch"),
    (PUSH, {"AWS_ENDPOINT_URL": "http://127.0.0.1:9"}, "does not answer"),
    ((*PUSH, "--profile", "nobody"), {}, "nobody"),
    (("train", "--mirror", "s3://nothing/x"), {}, "there is no such bucket"),
    (("bucket", "serve", "nowhere"), {}, "there is no such folder"),
]


@pytest.mark.parametrize(("words", "environment", "letter"), WRONG)
def test_what_cannot_be_used_ends_with_a_letter(racecraft, monkeypatch, tmp_path, words, environment, letter):
    (tmp_path / "here").mkdir()
    (tmp_path / "here" / "file").write_text("x")
    for name, value in environment.items():
        monkeypatch.setenv(name, value)
    said = racecraft(*words)
    assert said.code == 2
    assert letter in said.err
    assert said.err.splitlines()[-1].startswith("racecraft: ")
    assert "; expected " in said.err


BADLY = [
    ("DR_LOCAL_S3_ENDPOINT_URL=nowhere", "DR_LOCAL_S3_ENDPOINT_URL"),
    ("DR_LOCAL_S3_BUCKET=s3://models\nDR_LOCAL_ACCESS_KEY_ID=one", "DR_LOCAL_SECRET_ACCESS_KEY"),
]


@pytest.mark.parametrize(("lines", "named"), BADLY)
def test_a_value_that_cannot_be_used_is_named_with_its_file(racecraft, tmp_path, lines, named):
    assert racecraft("init", "inst").code == 0
    with open(tmp_path / "inst" / "system.env", "a") as file:
        file.write(lines + "\n")
    said = racecraft("dr", "--folder", "inst", "upload-custom-files")
    assert said.code == 2
    assert f": {named}: " in said.err


def test_without_boto3_the_letter_says_what_installs_it(racecraft, monkeypatch):
    monkeypatch.setitem(sys.modules, "boto3", None)
    said = racecraft("bucket", "list")
    assert (said.code, "pip install 'racecraft[s3]'" in said.err) == (2, True)
