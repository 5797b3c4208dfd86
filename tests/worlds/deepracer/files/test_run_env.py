"""Files of settings of DeepRacer for Cloud, as users bring them."""

import pytest
from tests.reference import DATA

from racecraft.worlds.deepracer.files.run_env import (
    RunEnvError,
    edit_run_env,
    read_env_folder,
    read_run_env,
    run_env_text,
)
from racecraft.worlds.deepracer.files.run_env_variables import ENV_VARIABLES, OTHER_SPELLINGS

TEMPLATES = DATA / "models" / "drfc-defaults"


def written(tmp_path, text, name="run.env"):
    path = tmp_path / name
    path.write_text(text, encoding="utf-8", newline="")
    return path


def test_the_templates_of_deepracer_for_cloud_are_fully_known():
    env = read_run_env(TEMPLATES / "template-system.env", TEMPLATES / "template-run.env")
    assert not [note for note in env.notes if "unknown" in note or "not set" in note]
    assert env.text("DR_LOCAL_S3_REWARD_KEY") == "custom_files/reward_function.py"
    assert env.text("DR_UPLOAD_S3_PREFIX") == "rl-deepracer-sagemaker-1"
    assert env.text("DR_RACER_NAME") == "FastCar"
    assert env.text("DR_H2B_BOT_CAR_PENALTY") == "5.0"  # the last line, without an end
    assert "DR_CLOUD" not in env.values
    for variable in ENV_VARIABLES:
        if variable.file == "run" and variable.default and "$" not in variable.default:
            assert env.values[variable.name] == variable.default, variable.name


WAYS = [  # line, value of DR_WORLD_NAME
    ("DR_WORLD_NAME=Monaco", "Monaco"),
    ('DR_WORLD_NAME="Monaco"', "Monaco"),
    ("DR_WORLD_NAME=\u201dMonaco\u201d", "Monaco"),
    ("DR_WORLD_NAME = Monaco  ", "Monaco"),
    ("export DR_WORLD_NAME=Monaco", "Monaco"),
    ("DR_WORLD_NAME=Monaco # by the sea", "Monaco"),
    ('DR_WORLD_NAME="Monaco # 2" # by the sea', "Monaco # 2"),
    ("DR_CAR_NAME=Mona\nDR_WORLD_NAME=${DR_CAR_NAME}co", "Monaco"),
    ("DR_CAR_NAME=Mona\nDR_WORLD_NAME='$DR_CAR_NAME'", "$DR_CAR_NAME"),
    ("DR_WORLD_NAME=Spain_track\nDR_WORLD_NAME=Monaco", "Monaco"),
]


@pytest.mark.parametrize(("line", "value"), WAYS)
@pytest.mark.parametrize("end", ["\n", "\r\n"])
def test_a_value_is_read_however_it_is_written(tmp_path, line, value, end):
    path = written(tmp_path, "\ufeff# mine\n" + line.replace("\n", end) + end)
    assert read_run_env(path).values["DR_WORLD_NAME"] == value


@pytest.mark.parametrize(("spelling", "name"), OTHER_SPELLINGS.items())
def test_other_spellings_are_read_as_what_they_mean(tmp_path, spelling, name):
    env = read_run_env(written(tmp_path, f"{spelling}=0.5\n"))
    assert env.values == {name: "0.5"}
    assert f":1: {spelling} is read as {name}" in env.notes[0]


def test_an_unknown_name_is_kept_and_named_with_the_nearest(tmp_path):
    env = read_run_env(written(tmp_path, "DR_WORLD_NAM=Monaco\nPATH_TO=x\nDR_RACER_NAME=$DR_NOBODY\n"))
    assert env.values == {"DR_WORLD_NAM": "Monaco", "PATH_TO": "x"}
    assert "run.env:1: unknown variable DR_WORLD_NAM is kept" in env.notes[0]
    assert "Did you mean 'DR_WORLD_NAME'?" in env.notes[0]
    assert "$DR_NOBODY is not set above" in env.notes[2]


def test_a_folder_gives_one_set_and_one_for_each_worker(tmp_path):
    written(tmp_path, "DR_WORKERS=2\nDR_WORLD_NAME=Spain_track\n", "system.env")
    written(tmp_path, "DR_WORLD_NAME=Monaco\n")
    written(tmp_path, "DR_WORLD_NAME=$X\n", "worker-2.env")
    folder = read_env_folder(tmp_path)
    assert folder.run.values == {"DR_WORKERS": "2", "DR_WORLD_NAME": "Monaco"}
    assert folder.workers[2].values == {"DR_WORLD_NAME": "$X"}


def test_flags_numbers_and_choices_are_read(tmp_path):
    text = "DR_EVAL_SAVE_MP4=TRUE\nDR_GUI_ENABLE=0\nDR_WORKERS=3\nDR_RACE_TYPE=time_trial\n"
    env = read_run_env(written(tmp_path, text))
    assert env.flag("DR_EVAL_SAVE_MP4")
    assert not env.flag("DR_GUI_ENABLE", True)
    assert env.flag("DR_HOST_X", True)
    assert env.number("DR_WORKERS", 1, 1, 10) == 3
    assert env.choice("DR_RACE_TYPE", "", ("TIME_TRIAL", "HEAD_TO_BOT")) == "TIME_TRIAL"


WRONG = [  # line, how it is asked, what the message holds
    ("DR_WORLD_NAME Monaco", None, ":2: 'DR_WORLD_NAME Monaco'; expected lines of KEY=VALUE"),
    (
        "DR_EVAL_SAVE_MP4=maybe",
        lambda env: env.flag("DR_EVAL_SAVE_MP4"),
        ":2: DR_EVAL_SAVE_MP4: 'maybe'; expected True",
    ),
    (
        "DR_WORKERS=99",
        lambda env: env.number("DR_WORKERS", 1, 1, 9),
        ":2: DR_WORKERS: '99'; expected a number from 1 to 9",
    ),
    (
        "DR_RACE_TYPE=TIME_TRAIL",
        lambda env: env.choice("DR_RACE_TYPE", "", ("TIME_TRIAL", "HEAD_TO_BOT")),
        ":2: DR_RACE_TYPE: 'TIME_TRAIL'; expected TIME_TRIAL or HEAD_TO_BOT. Did you mean 'TIME_TRIAL'?",
    ),
]


@pytest.mark.parametrize(("line", "ask", "found"), WRONG)
def test_what_cannot_be_used_gets_a_letter(tmp_path, line, ask, found):
    path = written(tmp_path, f"# mine\n{line}\n")
    with pytest.raises(RunEnvError) as caught:  # noqa: PT012  the letter may come from either
        env = read_run_env(path)
        ask(env)
    assert str(caught.value).startswith(f"{path}{found}")


def test_a_missing_file_is_told(tmp_path):
    with pytest.raises(RunEnvError, match=r"run\.env: there is no such file"):
        read_env_folder(tmp_path)


def test_editing_changes_values_and_nothing_else(tmp_path):
    before = "# mine\nexport DR_WORLD_NAME=Monaco\n#DR_CAR_NAME=x\nDR_COLLISION_PENALTY=1\nDR_RUN_ID=0"
    path = written(tmp_path, before)
    edit_run_env(path, {"DR_WORLD_NAME": "Spain_track", "DR_EVAL_COLLISION_PENALTY": "2", "DR_CAR_NAME": "My car"})
    assert path.read_text() == (
        "# mine\nexport DR_WORLD_NAME=Spain_track\n#DR_CAR_NAME=x\nDR_COLLISION_PENALTY=2\nDR_RUN_ID=0\n"
        'DR_CAR_NAME="My car"\n'
    )
    assert (tmp_path / "run.env.bak").read_text() == before
    assert read_run_env(path).text("DR_CAR_NAME") == "My car"


@pytest.mark.parametrize("file", ["run", "system"])
def test_a_new_file_reads_back_with_every_default(tmp_path, file):
    env = read_run_env(written(tmp_path, run_env_text(file)))
    assert env.notes == ()
    assert set(env.values) == {row.name for row in ENV_VARIABLES if row.file == file and row.default}


def test_what_a_template_holds_or_its_init_left_counts_as_not_given(tmp_path):
    for value in ("<AWS_DR_BUCKET>", "not-defined", "found-3-buckets", "to-be-defined"):
        (tmp_path / "system.env").write_text(f"DR_UPLOAD_S3_BUCKET={value}\n")
        env = read_run_env(tmp_path / "system.env")
        assert "DR_UPLOAD_S3_BUCKET" not in env.values
        assert env.notes == (f"system.env:1: DR_UPLOAD_S3_BUCKET still holds {value}; it counts as not given",)
    (tmp_path / "system.env").write_text("DR_UPLOAD_S3_BUCKET=found-my-buckets\n")
    assert read_run_env(tmp_path / "system.env").values == {"DR_UPLOAD_S3_BUCKET": "found-my-buckets"}


def test_a_later_empty_value_takes_an_earlier_one_away(tmp_path):
    assert read_run_env(written(tmp_path, "DR_CAR_NAME=Mona\nDR_CAR_NAME=\n")).values == {}
    assert read_run_env(written(tmp_path, 'DR_CAR_NAME=Mona\nDR_CAR_NAME=""\n')).values == {}


def test_an_apostrophe_opens_no_quote_and_a_quote_wants_its_end(tmp_path):
    assert read_run_env(written(tmp_path, "DR_CAR_NAME=\u2019s-car\n")).values == {"DR_CAR_NAME": "\u2019s-car"}
    for line in ('"Mona', "\u201dMona"):
        with pytest.raises(RunEnvError, match=r"run\.env:1: DR_CAR_NAME: .* opens a quote; expected it closed"):
            read_run_env(written(tmp_path, f"DR_CAR_NAME={line}\n"))


def test_only_files_of_numbered_workers_are_read(tmp_path):
    written(tmp_path, "DR_CAR_NAME=Mona\n")
    for name in ("worker-3.env", "worker-x.env", "worker-.env"):
        written(tmp_path, "DR_CAR_NAME=Lisa\n", name)
    assert list(read_env_folder(tmp_path).workers) == [3]


def test_a_name_in_another_spelling_is_filled_in_and_edited_too(tmp_path):
    path = written(tmp_path, "DR_COLLISION_PENALTY=2\nDR_CAR_NAME=a${DR_COLLISION_PENALTY}$DR_EVAL_COLLISION_PENALTY\n")
    assert read_run_env(path).text("DR_CAR_NAME") == "a22"
