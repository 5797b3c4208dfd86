"""An installation's settings, with what the shell says laid over its files."""

import pytest

from racecraft.contract.errors import UserInputError
from racecraft.worlds.deepracer.files.drfc_folder import LOADED, open_drfc_folder
from racecraft.worlds.deepracer.files.run_env import RunEnvError


def test_quotes_of_a_page_that_were_pasted_into_the_shell_are_no_part_of_a_name(tmp_path):
    (tmp_path / "run.env").write_text("DR_LOCAL_S3_MODEL_PREFIX=first\nDR_CAR_NAME=FastCar\n")
    loaded = {LOADED: open_drfc_folder(tmp_path).digest}
    pasted = {"DR_LOCAL_S3_MODEL_PREFIX": "\u201dsecond\u201d", "DR_CAR_NAME": "\u201cFastCar\u201d"}
    drfc = open_drfc_folder(tmp_path, shell=loaded | pasted)
    assert drfc.model == tmp_path / "bucket" / "second"
    assert drfc.notes == ("set in the shell, which counts before the files: DR_LOCAL_S3_MODEL_PREFIX",)


def installation(path, run="", system=None, **others):
    """Return a folder with a run.env, and whatever else is named; `a/run.env` is written a__run."""
    files = {"run.env": run} | ({} if system is None else {"system.env": system})
    files |= {f"{name.replace('__', '/')}.env": text for name, text in others.items()}
    for name, text in files.items():
        (path / name).parent.mkdir(parents=True, exist_ok=True)
        (path / name).write_text(text)
    return path


def opened(path, run="", system=None, **others):
    return open_drfc_folder(installation(path, run, system, **others))


@pytest.mark.parametrize(("written", "number"), [("0", 0), ("999", 999)])
def test_a_run_id_is_a_whole_number_up_to_999(tmp_path, written, number):
    assert opened(tmp_path, f"DR_RUN_ID={written}\n").run_id == number


@pytest.mark.parametrize("written", ["1000", "1.5", "\u0663"])
def test_another_run_id_is_refused_with_its_line(tmp_path, written):
    with pytest.raises(RunEnvError, match=r"run\.env:2: DR_RUN_ID: .* whole number from 0 to 999") as caught:
        _ = opened(tmp_path, f"# mine\nDR_RUN_ID={written}\n").run_id
    assert f"'{written}'" in str(caught.value)


def test_a_bare_installation_has_the_places_that_racers_know(tmp_path):
    """The names are those of DeepRacer for Cloud's own templates."""
    drfc = opened(tmp_path)
    assert (drfc.run_id, drfc.config, drfc.custom_files) == (0, tmp_path / "run.env", tmp_path / "custom_files")
    assert drfc.bucket == tmp_path / "bucket"
    assert drfc.model == drfc.opponent == tmp_path / "bucket" / "rl-deepracer-sagemaker"
    assert drfc.custom_prefix == tmp_path / "bucket" / "custom_files"
    assert drfc.key("DR_LOCAL_S3_REWARD_KEY") == tmp_path / "bucket" / "custom_files" / "reward_function.py"
    assert (drfc.local_is_s3, drfc.upload_is_s3, drfc.endpoint_variable, drfc.notes) == (False, False, "", ())
    assert drfc.flag("DR_TRAIN_CHANGE_START_POSITION") is True, "the template's word where nobody gives one"
    assert drfc.flag("DR_EVAL_SAVE_MP4") is False


def test_words_of_the_files_count_before_the_templates(tmp_path):
    system = "DR_LOCAL_S3_BUCKET=mine/\nDR_UPLOAD_S3_BUCKET=up\n"
    run = "DR_LOCAL_S3_MODEL_PREFIX=a/b\nDR_TRAIN_CHANGE_START_POSITION=no\n"
    drfc = opened(tmp_path, run, system)
    assert drfc.model == tmp_path / "mine" / "a" / "b"
    assert drfc.upload == tmp_path / "up" / "a" / "b-1", "a default is made of other words"
    assert drfc.flag("DR_TRAIN_CHANGE_START_POSITION") is False


def test_an_upload_without_a_bucket_for_it_is_refused(tmp_path):
    drfc = opened(tmp_path)
    with pytest.raises(RunEnvError, match="DR_UPLOAD_S3_BUCKET: it has no value; expected the name of a folder") as it:
        _ = drfc.upload
    assert it.value.path == drfc.config


@pytest.mark.parametrize(
    ("variable", "value", "expected"),
    [
        *(("LOCAL_S3_BUCKET", name, "stays inside its folder") for name in ("..", "/away", "a/../..", "C:a")),
        ("CLOUD", "moon", "expected local or aws or azure or remote"),
    ],
)
def test_a_bucket_that_leaves_the_installation_or_has_no_known_kind_is_refused(tmp_path, variable, value, expected):
    with pytest.raises(RunEnvError, match=rf"run\.env:1: DR_{variable}: .*{expected}"):
        _ = opened(tmp_path, f"DR_{variable}={value}\n").bucket


ENDPOINTS = [  # lines, the variable that names the bucket's store
    ("DR_MINIO_URL=http://m", "DR_MINIO_URL"),
    ("DR_REMOTE_MINIO_URL=http://r", ""),
    ("DR_REMOTE_MINIO_URL=http://r\nDR_MINIO_URL=http://m\nDR_CLOUD=remote", "DR_REMOTE_MINIO_URL"),
]


@pytest.mark.parametrize(("lines", "variable"), ENDPOINTS)
def test_the_bucket_is_s3_where_a_store_is_named(tmp_path, lines, variable):
    drfc = opened(tmp_path, lines)
    assert (drfc.endpoint_variable, drfc.local_is_s3) == (variable, bool(variable))


@pytest.mark.parametrize(("line", "is_s3"), [("PROFILE=minio", False), ("PROFILE=mine", True), ("BUCKET=s3://b", True)])
def test_the_bucket_is_s3_with_a_profile_of_ones_own_or_such_an_address(tmp_path, line, is_s3):
    assert opened(tmp_path, f"DR_LOCAL_S3_{line}").local_is_s3 is is_s3


UPLOADS = [("", False), ("BUCKET=s3://up", True), ("BUCKET=up\nDR_UPLOAD_S3_PROFILE=mine", True)]


@pytest.mark.parametrize(("line", "is_s3"), UPLOADS)
def test_the_bucket_for_uploads_is_s3_where_it_is_named_so(tmp_path, line, is_s3):
    assert opened(tmp_path, line and f"DR_UPLOAD_S3_{line}").upload_is_s3 is is_s3


def test_a_cloud_without_an_address_is_a_folder_and_that_is_said(tmp_path):
    assert "DR_CLOUD=azure: the bucket is a folder" in opened(tmp_path, "DR_CLOUD=azure").notes[0]
    assert opened(tmp_path, "DR_CLOUD=azure\nDR_MINIO_URL=http://m").notes == ()


def test_a_prefix_that_was_typed_lies_in_one_of_our_buckets(tmp_path):
    drfc = opened(tmp_path, "DR_UPLOAD_S3_BUCKET=up\n")
    assert drfc.in_bucket("m-2") == drfc.in_bucket("s3://bucket/m-2") == tmp_path / "bucket" / "m-2"
    assert drfc.in_bucket("s3://up/m/n") == tmp_path / "up" / "m" / "n"
    with pytest.raises(UserInputError, match="s3://away: is no bucket of .* expected bucket or up"):
        drfc.in_bucket("s3://away/m")
    for outside in ("../m", "/m", "s3://bucket/../m", "m\0n"):
        with pytest.raises(UserInputError, match="leaves the bucket"):
            drfc.in_bucket(outside)


def test_the_shell_counts_before_the_files_where_they_are_as_it_read_them(tmp_path):
    installation(tmp_path, "DR_CAR_NAME=One\nDR_RUN_ID=1\nDR_WORLD_NAME=Monaco\n")
    shell = {"DR_CAR_NAME": "Two", "DR_RUN_ID": "", "DR_WORLD_NAME": "Monaco", "DR_DIR": "/x", "DR_CONFIG": "/y",
             "PATH": "/bin"}  # fmt: skip
    for loaded in ({}, {LOADED: open_drfc_folder(tmp_path).digest}):
        drfc = open_drfc_folder(tmp_path, shell=shell | loaded)
        assert (drfc.text("DR_CAR_NAME"), drfc.run_id, drfc.text("DR_DIR")) == ("Two", 1, "")
        assert drfc.notes == ("set in the shell, which counts before the files: DR_CAR_NAME",)
        assert str(drfc.error_at("DR_CAR_NAME", "another")) == "the shell: DR_CAR_NAME: 'Two'; expected another."
    edited = open_drfc_folder(tmp_path, shell=shell | {LOADED: "of another day"})
    assert edited.text("DR_CAR_NAME") == "One"
    assert edited.notes[0].startswith("the files were changed since dr-update-env")
    same = open_drfc_folder(tmp_path, shell={"DR_CAR_NAME": "One", LOADED: "of another day"})
    assert same.notes == ()


def test_what_dr_update_env_itself_put_into_the_shell_is_not_reported(tmp_path):
    installation(tmp_path, "DR_WORLD_NAME=Monaco\n")
    assert open_drfc_folder(tmp_path, shell={"DR_RUN_ID": "0"}).notes == ()
    (note,) = open_drfc_folder(tmp_path, shell={"DR_RUN_ID": "1"}).notes
    assert note == "set in the shell, which counts before the files: DR_RUN_ID"


def test_an_experiments_files_come_before_the_installations(tmp_path):
    own = {"experiments__e__run": "DR_CAR_NAME=Two\n", "experiments__s__system": "DR_WORLD_NAME=Spain_track\n"}
    installation(tmp_path, "DR_EXPERIMENT_NAME=e\nDR_CAR_NAME=One\n", "DR_WORLD_NAME=Monaco\n", **own)
    named, folder = open_drfc_folder(tmp_path), tmp_path / "experiments" / "e"
    assert (named.text("DR_CAR_NAME"), named.text("DR_WORLD_NAME")) == ("Two", "Monaco")
    assert (named.config, named.custom_files) == (folder / "run.env", folder / "custom_files")
    other = open_drfc_folder(tmp_path, experiment="s")
    assert (other.text("DR_CAR_NAME"), other.text("DR_WORLD_NAME")) == ("One", "Spain_track")
    assert other.custom_files == tmp_path / "custom_files", "its run.env is the installation's"
    given = open_drfc_folder(tmp_path, config=tmp_path / "run.env")
    assert given.text("DR_CAR_NAME") == "One", "a file that is named counts, whatever it says of experiments"


def test_an_experiment_named_in_the_system_file_counts_too(tmp_path):
    drfc = opened(tmp_path, "", "DR_EXPERIMENT_NAME=e\n", experiments__e__run="DR_CAR_NAME=Two\n")
    assert drfc.text("DR_CAR_NAME") == "Two"


def test_worker_files_lie_beside_the_run_file_that_counts(tmp_path):
    installation(tmp_path, "", "", **{"worker-2": "DR_WORLD_NAME=Monaco"}, experiments__e__run="",
                 **{"experiments/e/worker-3": "DR_WORLD_NAME=Spain_track"})  # fmt: skip
    assert list(open_drfc_folder(tmp_path).env.workers) == [2]
    assert list(open_drfc_folder(tmp_path, experiment="e").env.workers) == [3]


@pytest.mark.parametrize("name", ["none", "../aside"])
def test_an_experiment_that_is_not_there_is_refused_with_those_that_are(tmp_path, name):
    (tmp_path / "aside").mkdir()
    installation(tmp_path, experiments__b__run="", experiments__a__run="")
    with pytest.raises(UserInputError, match="there is no such experiment; .*experiments: a, b"):
        open_drfc_folder(tmp_path, experiment=name)


def test_a_folder_that_is_no_installation_is_refused(tmp_path):
    with pytest.raises(UserInputError, match=r"run\.env: there is no such file; .*racecraft init"):
        open_drfc_folder(tmp_path)
    with pytest.raises(UserInputError, match="there is no such folder"):
        open_drfc_folder(tmp_path / "none")
    (tmp_path / "file").touch()
    with pytest.raises(UserInputError, match="is a file"):
        open_drfc_folder(tmp_path / "file")
