"""What a racer's run.env means for a training."""

import pytest

from racecraft.settings.overrides import apply_overrides
from racecraft.worlds.deepracer.files.run_env import RunEnv, RunEnvError, run_env_text
from racecraft.worlds.deepracer.files.run_env_variables import BY_NAME
from racecraft.worlds.deepracer.training.presets import default_settings
from racecraft.worlds.deepracer.training.race_environment import OBEYED, RaceEnvironment, race_environment
from racecraft.worlds.deepracer.training.race_objects import PREFIXES
from racecraft.worlds.deepracer.training.race_rules import judging_in_drfc

TEMPLATE = {
    "laps": 3, "checkpoint": "last", "is_continuous": True, "max_resets": 100, "off_track_penalty": 5.0,
    "collision_penalty": 5.0, "reset_behind_dist": 1.0, "reverse_direction": False,
}  # fmt: skip
"""Evaluations in the template of DeepRacer for Cloud (facts: deepracer.md 5.6, deepracer-systems.md A2)."""


def folder_with(tmp_path, *lines):
    folder = tmp_path / "my-car"
    folder.mkdir(exist_ok=True)
    (folder / "run.env").write_text("\n".join(lines) + "\n", encoding="utf-8")
    return folder


def test_without_a_file_nothing_is_said(tmp_path):
    assert race_environment(None) == race_environment(tmp_path) == RaceEnvironment()


def test_each_used_variable_changes_something_and_no_other_does(tmp_path):
    """By law, over the whole table: its column `used` tells the truth."""
    (tmp_path / "old").mkdir()
    (tmp_path / "my-car" / "mine").mkdir(parents=True)
    values = {
        "DR_WORLD_NAME": "Oval_track",
        "DR_OA_RANDOMIZE_OBSTACLE_LOCATIONS": "False",
        "DR_OA_IS_OBSTACLE_BOT_CAR": "True",
        "DR_OA_OBSTACLE_TYPE": "amazon_box_obstacle",
        "DR_OA_OBJECT_POSITIONS": "0.2,-1",
        "DR_H2B_IS_LANE_CHANGE": "True",
        "DR_H2B_BOT_CAR_SPEED": "1.5",
        "DR_H2B_RANDOMIZE_BOT_CAR_LOCATIONS": "True",
        "DR_TRAIN_CHANGE_START_POSITION": "False",
        "DR_TRAIN_REVERSE_DIRECTION": "True",
        "DR_TRAIN_START_POSITION_OFFSET": "0.25",
        "DR_TRAIN_ROUND_ROBIN_ADVANCE_DIST": "0.1",
        "DR_TRAIN_MIN_EVAL_TRIALS": "3",
        "DR_TRAIN_BEST_MODEL_METRIC": "reward",
        "RACECRAFT_STOP": "laps, minutes=5",
        "DR_EVAL_CHECKPOINT": "best",
        "DR_EVAL_IS_CONTINUOUS": "False",
        "DR_EVAL_REVERSE_DIRECTION": "True",
        "DR_LOCAL_S3_CUSTOM_FILES_PREFIX": "mine",
        "DR_LOCAL_S3_PRETRAINED_PREFIX": "old",
        "DR_LOCAL_S3_PRETRAINED_CHECKPOINT": "best",
        "RACECRAFT_SET": "ppo.clip=0.1",
        "DR_TRAIN_ALTERNATE_DRIVING_DIRECTION": "True",
        "DR_TRAIN_MULTI_CONFIG": "True",
        "DR_ENABLE_DOMAIN_RANDOMIZATION": "True",
        "DR_LOCAL_S3_REWARD_KEY": "mine/a.py",
        "DR_LOCAL_S3_MODEL_METADATA_KEY": "mine/a.json",
        "DR_LOCAL_S3_HYPERPARAMETERS_KEY": "mine/b.json",
        "DR_WORKERS": "2",
        "DR_CAR_BODY_SHELL_TYPE": "f1_2021",
        "DR_CAR_COLOR": "Blue",
    }
    for name in ("a.py", "a.json", "b.json"):
        (tmp_path / "my-car" / "mine" / name).touch()
    (tmp_path / "my-car" / "worker-2.env").write_text("DR_WORLD_NAME=Oval_track\n")
    only_together = ("DR_LOCAL_S3_PRETRAINED_PREFIX", "DR_LOCAL_S3_PRETRAINED_CHECKPOINT")
    for name, variable in BY_NAME.items():
        if name in ("DR_RACE_TYPE", "DR_LOCAL_S3_PRETRAINED"):  # refused; tested below
            continue
        lines = ["DR_LOCAL_S3_PRETRAINED=True", "DR_LOCAL_S3_PRETRAINED_PREFIX=old"] if name in only_together else []
        lines += {"DR_WORKERS": ["DR_TRAIN_MULTI_CONFIG=True"], "DR_TRAIN_MULTI_CONFIG": ["DR_WORKERS=2"]}.get(name, [])
        lines += [f"DR_RACE_TYPE={race}" for prefix, race in PREFIXES.items() if name.startswith(prefix)]
        before = race_environment(folder_with(tmp_path, *lines, "DR_WORLD_NAME=x"))
        after = race_environment(folder_with(tmp_path, *lines, "DR_WORLD_NAME=x", f"{name}={values.get(name, '7')}"))
        if name == "DR_LOCAL_S3_PRETRAINED_PREFIX":
            assert after.clone_from == f"{tmp_path / 'old'}:last"
            continue
        assert (meaning(before) != meaning(after)) == (variable.status == "used"), name
        said = "".join(after.notes).replace(",", "").replace(";", "")
        assert (f"not applicable here: {name}" in said) == (variable.status == "without"), name
    assert len(OBEYED) > 15


def meaning(asked):
    settings = (asked.track, asked.overrides, asked.start_offset, asked.stops, asked.judging)
    courses = [(course.worker, course.track, course.alternates) for course in asked.courses]
    return (*settings, asked.clone_from, asked.files, asked.keys, courses)


def test_a_file_as_racers_write_it_becomes_settings(tmp_path):
    """Typographic quotes, CRLF, a byte order mark, export, $OTHER and both misnamed spellings at once."""
    text = (
        "\ufeffexport DR_CAR_NAME=Oval\r\nDR_WORLD_NAME=\u201d${DR_CAR_NAME}_track\u201d\r\n"
        "DR_TRAIN_ROUND_ROBIN_ADVANCE_DISTANCE = 0.1 # a tenth\r\nDR_CHANGE_START_POSITION=TRUE\r\n"
        "DR_COLLISION_PENALTY=3\r\nDR_TRAIN_REVERSE_DIRECTION=1\r\nDR_TRAIN_MIN_EVAL_TRIALS='3'\r\nDR_WORLD_NAM=x"
    )
    folder = folder_with(tmp_path)
    (folder / "run.env").write_bytes(text.encode())
    asked = race_environment(folder)
    settings = apply_overrides(default_settings(), asked.overrides)
    assert asked.track == "Oval_track"
    assert (settings.race.reverse, settings.race.change_start, settings.race.start_advance) == (True, True, 0.1)
    assert settings.evaluation.episodes == 3
    notes = "\n".join(asked.notes)
    assert "DR_COLLISION_PENALTY is read as DR_EVAL_COLLISION_PENALTY" in notes
    assert "unknown variable DR_WORLD_NAM is kept and does nothing. Did you mean 'DR_WORLD_NAME'?" in notes
    assert asked.judging == {"collision_penalty": 3.0}


def test_a_new_file_asks_for_what_is_the_default_anyway(tmp_path):
    asked = race_environment(folder_with(tmp_path, run_env_text()))
    default, given = default_settings(), apply_overrides(default_settings(), asked.overrides)
    assert given.variation.amounts == default.variation.amounts
    assert given.with_group("variation", default.variation) == default
    assert (asked.track, asked.clone_from, asked.stops, asked.start_offset) == ("reinvent_base", None, (), 0.0)
    assert asked.judging == judging_in_drfc(RunEnv()) == TEMPLATE


@pytest.mark.parametrize(
    ("line", "named"),
    [
        ("DR_GUI_ENABLE=True", True),
        ("DR_EVAL_OFF_TRACK_PENALTY=3.0", False),
        ("DR_OA_MIN_DISTANCE_BETWEEN_OBSTACLES=2", False),
        ("DR_OA_MIN_DISTANCE_BETWEEN_OBSTACLES=3.0", True),
        ("DR_EVAL_DEBUG_REWARD=false", False),
        ("DR_EVAL_OPP_CAR_NAME=Zoom\nDR_EVAL_OPP_RACER_NAME=Zoom", False),
    ],
)
def test_only_what_differs_from_its_default_is_said_not_to_be_used(tmp_path, line, named):
    name = line.split("\n")[-1].partition("=")[0]
    assert (name in "".join(race_environment(folder_with(tmp_path, line)).notes)) == named


def test_system_env_is_read_first_and_worker_files_are_named(tmp_path):
    folder = folder_with(tmp_path, "DR_TRAIN_MIN_EVAL_TRIALS=2")
    (folder / "system.env").write_text("DR_WORLD_NAME=Oval_track\nDR_TRAIN_MIN_EVAL_TRIALS=9\n")
    (folder / "worker-2.env").write_text("DR_WORLD_NAME=Bowtie_track\n")
    asked = race_environment(folder)
    assert (asked.track, asked.overrides) == ("Oval_track", ("evaluation.episodes=2",))
    assert "worker-N.env: not used, as DR_TRAIN_MULTI_CONFIG is not True" in asked.notes[-1]


@pytest.mark.parametrize(
    ("written", "place"), [("old", "old"), ("s3://bucket/old", "old"), ("models/older", "models/older")]
)
def test_an_older_model_is_found_by_prefix_uri_or_path(tmp_path, monkeypatch, written, place):
    (tmp_path / place).mkdir(parents=True)
    lines = ["DR_LOCAL_S3_PRETRAINED=True", f"DR_LOCAL_S3_PRETRAINED_PREFIX={written}"]
    monkeypatch.chdir(tmp_path)
    folder = folder_with(tmp_path, *lines, "DR_LOCAL_S3_PRETRAINED_CHECKPOINT=BEST")
    assert race_environment(folder).clone_from == f"{place}:best"
    (tmp_path / "runs").mkdir()
    (tmp_path / place).rename(tmp_path / "runs" / "below")
    again = folder_with(tmp_path, "DR_LOCAL_S3_PRETRAINED=True", "DR_LOCAL_S3_PRETRAINED_PREFIX=below")
    assert race_environment(again).clone_from == "runs/below:last"


WRONG = [  # line, what the message holds
    ("DR_RACE_TYPE=OBJECT_AVOIDANCE\nDR_OA_NUMBER_OF_OBSTACLES=-2", ":3: DR_OA_NUMBER_OF_OBSTACLES: '-2'; expected"),
    ("DR_RACE_TYPE=OBJECT_AVOIDANCE\nDR_OA_OBJECT_POSITIONS=1.4,1", "'1.4,1' lies off the track"),
    ("DR_RACE_TYPE=TIME_TRAIL", "DR_RACE_TYPE: 'TIME_TRAIL'; expected TIME_TRIAL or"),
    ("DR_CHANGE_START_POSITION=perhaps", "DR_TRAIN_CHANGE_START_POSITION: 'perhaps'; expected True or False"),
    ("DR_TRAIN_START_POSITION_OFFSET=-0.1", "DR_TRAIN_START_POSITION_OFFSET: '-0.1'; expected a number from 0 to 1"),
    ("DR_TRAIN_MIN_EVAL_TRIALS=2.5", "'2.5'; expected a whole number from 1 to 1000"),
    ("DR_EVAL_CHECKPOINT=newest", "DR_EVAL_CHECKPOINT: 'newest'; expected last or best"),
    ("DR_EVAL_RESET_BEHIND_DIST=nan", "DR_EVAL_RESET_BEHIND_DIST: 'nan'; expected a number from 0 to 10"),
    ("DR_CAR_BODY_SHELL_TYPE=truck", "'truck'; expected one that the original had. Known: deepracer, f1"),
    ("DR_TRAIN_BEST_MODEL_METRIC=lap time", "'lap time'; expected progress or reward or laptime. Did you mean"),
    ("RACECRAFT_STOP=laps minuts=3", "RACECRAFT_STOP: 'laps minuts=3'; expected stops such as laps minutes=30. --stop"),
    ("DR_LOCAL_S3_PRETRAINED=True", "DR_LOCAL_S3_PRETRAINED: there is no folder 'rl-sagemaker-pretrained'"),
    (
        "DR_LOCAL_S3_PRETRAINED=True\nDR_LOCAL_S3_PRETRAINED_PREFIX=s3://bucket",
        ":3: DR_LOCAL_S3_PRETRAINED_PREFIX: there is no folder 's3://bucket'",
    ),
    (
        "DR_LOCAL_S3_PRETRAINED=True\nDR_LOCAL_S3_PRETRAINED_PREFIX=.\nDR_LOCAL_S3_PRETRAINED_CHECKPOINT=first",
        "DR_LOCAL_S3_PRETRAINED_CHECKPOINT: 'first'; expected last or best",
    ),
    ("DR_WORLD_NAME: Oval_track", "'DR_WORLD_NAME: Oval_track'; expected lines of KEY=VALUE"),
]  # fmt: skip


@pytest.mark.parametrize(("line", "found"), WRONG)
def test_what_cannot_be_obeyed_gets_a_letter_with_file_and_line(tmp_path, line, found):
    folder = folder_with(tmp_path, "# mine", line)
    with pytest.raises(RunEnvError) as caught:
        race_environment(folder)
    assert str(caught.value).startswith(f"{folder / 'run.env'}:")
    assert found in str(caught.value)
