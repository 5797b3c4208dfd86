"""`racecraft train --against` and `racecraft race`, as a user types them."""

import json
import shutil

import pytest
from tests.cli.conftest import TINY
from tests.worlds.deepracer.files.tensorflow.policies import layers_for, write_listed

from racecraft.worlds.deepracer.files.policy_graph import graph_of
from racecraft.worlds.deepracer.files.tensorflow.graph import write_graph
from racecraft.worlds.deepracer.files.training_metrics import read_metrics_file

STOP = ("--stop", "iterations=1", "--no-pictures")

RANGES = """{"action_space": {"speed": {"low": 0.5, "high": 2}, "steering_angle": {"low": -30, "high": 30}},
 "action_space_type": "continuous", "sensor": ["FRONT_FACING_CAMERA"], "version": "4",
 "neural_network": "DEEP_CONVOLUTIONAL_NETWORK_SHALLOW"}"""


def test_a_car_races_itself_and_another_and_says_who_is_better(racecraft, run, tmp_path):
    said = racecraft("train", "--run", "s", "--against", "self", "--against", "r:0", *STOP, *TINY, "--json")
    assert said.code == 0, said.err
    told = json.loads(said.out)["races"]
    assert [one["name"] for one in told["selves"]] == ["iteration 0", "iteration 1", "r:0"]
    assert told["last_over_first"]["low"] < told["last_over_first"]["points"] < told["last_over_first"]["high"]
    assert json.loads((tmp_path / "s" / "selves.json").read_text())["last_over_first"] == told["last_over_first"]
    film = ("--video", "race.mp4", "--size", "480p", "--fps", 15)
    said = racecraft("race", "s", "r", "r:0", "--laps", 1, "--max-resets", 0, *film, "--json")
    assert said.code == 0, said.err
    told = json.loads(said.out)
    assert [one["driver"] for one in told["drivers"]] == ["s", "r", "r:0"]
    assert len(told["races"]) == 3
    assert all(one["ended"] in ("retired", "time_up") for race in told["races"] for one in race)
    assert (tmp_path / "race.mp4").is_file()
    assert (tmp_path / "race-strip.png").is_file()
    said = racecraft("race", "r", "r", "--laps", 1, "--max-resets", 0)
    assert "2 races over 1 laps" in said.out
    assert "r (1)" in said.out


WRONG = {
    "1 cars were named for one race; expected 2 to 8": ["race", "r"],
    "nowhere: there is no such folder": ["race", "r", "nowhere"],
    "--done-condition is 'some'. Known: any, all.": ["race", "r", "r", "--done-condition", "some"],
    "--size 480p films nothing; expected --video": ["race", "r", "r", "--size", "480p"],
    "gone: there is no such folder": ["train", "--against", "gone", *STOP],
    "--against asks for a race of HEAD_TO_MODEL": ["train", "--against", "self", "--set", "race.type=HEAD_TO_BOT"],
}


def test_an_opponent_without_a_cars_actions_is_named_and_one_with_other_actions_races(racecraft, run, tmp_path):
    short = ("--stop", "iterations=1", "--set", "rollout.horizon=16", "--no-pictures")
    said = racecraft("gym", "train", "CartPole-v1", "--run", "pole", *short)
    assert said.code == 0, said.err
    (tmp_path / "ranges").mkdir()
    (tmp_path / "ranges" / "model_metadata.json").write_text(RANGES)
    said = racecraft("train", "ranges", "--run", "c", *STOP, *TINY)
    assert said.code == 0, said.err
    for words in (["race", "r", "pole"], ["race", "pole", "r"], ["train", "--against", "pole", *STOP, *TINY]):
        told = racecraft(*words)
        assert told.code == 2, words
        assert "pole: the run is one of `racecraft gym train`; expected one of `racecraft train`" in told.err
    told = racecraft("race", "r", "c", "--laps", 1, "--max-resets", 0, "--json")
    assert told.code == 0, told.err
    assert [one["driver"] for one in json.loads(told.out)["drivers"]] == ["r", "c"]


def test_what_no_race_can_be_is_named(racecraft, run):
    for said, words in WRONG.items():
        told = racecraft(*words)
        assert told.code == 2, words
        assert said in told.err, told.err


def test_cars_that_do_not_fit_on_the_lap_are_named(racecraft, run):
    told = racecraft("race", *["r"] * 8, "--track", "Straight_track")
    assert told.code == 2
    assert "8 cars start 0.75 m behind one another" in told.err


@pytest.fixture
def installation(racecraft, run, tmp_path):
    """A folder of DeepRacer for Cloud whose bucket holds two models; returns what writes its run.env."""
    for name in ("mine", "theirs"):
        shutil.copytree(tmp_path / "r", tmp_path / "bucket" / name)

    def write(*lines):
        said = ("DR_RACE_TYPE=HEAD_TO_MODEL", "DR_LOCAL_S3_MODEL_PREFIX=mine", "DR_EVAL_OPP_S3_MODEL_PREFIX=theirs")
        (tmp_path / "run.env").write_text("\n".join((*said, "DR_EVAL_MAX_RESETS=0", *lines)) + "\n")

    return write


def test_a_dr_evaluation_races_the_opponent_and_leaves_aws_files_with_both(racecraft, installation, tmp_path):
    installation("DR_EVAL_NUMBER_OF_TRIALS=1", "DR_DISPLAY_NAME=Ann", "DR_EVAL_OPP_CAR_NAME=Zoom")
    said = racecraft("dr", "run-evaluation", tmp_path / "bucket" / "mine")
    assert said.code == 0, said.err
    assert "Ann" in said.out
    assert "Zoom" in said.out
    for name in ("mine", "theirs"):
        [metrics] = (tmp_path / "bucket" / name / "metrics" / "evaluation").glob("evaluation-*.json")
        [row] = read_metrics_file(metrics).rows
        assert row.trial == 1
        assert row.reset_count == 1 or row.episode_status == "Time Up"
        [trace] = (tmp_path / "bucket" / name).glob("evaluation-*/evaluation-simtrace/*.csv")
        assert len(trace.read_text().splitlines()) > 2
    assert not list(tmp_path.glob("bucket/*/mp4"))


def test_a_dr_opponent_may_be_a_model_of_awss_trainer(racecraft, installation, tmp_path):
    """Its folder gets AWS's files of the race, as one of ours does."""
    installation("DR_EVAL_NUMBER_OF_TRIALS=1", "DR_EVAL_OPP_S3_MODEL_PREFIX=awss")
    (tmp_path / "bucket" / "awss").mkdir()
    (tmp_path / "bucket" / "awss" / "model.pb").write_bytes(write_graph(graph_of(layers_for("discrete", "tiny")[0])))
    write_listed(tmp_path / "bucket" / "awss" / "model_metadata.json")
    said = racecraft("dr", "run-evaluation", tmp_path / "bucket" / "mine")
    assert said.code == 0, said.err
    for name in ("mine", "awss"):
        assert len(list((tmp_path / "bucket" / name / "metrics" / "evaluation").glob("evaluation-*.json"))) == 1


def test_a_dr_race_is_filmed_with_the_original_s_cameras(racecraft, installation, tmp_path):
    installation("DR_EVAL_NUMBER_OF_TRIALS=1", "DR_EVAL_SAVE_MP4=True", "DR_EVAL_OPP_CAR_BODY_SHELL_TYPE=x")
    said = racecraft("dr", "run-evaluation", tmp_path / "bucket" / "mine")
    assert said.code == 2
    assert "'x'" in said.err, "the opponent's shell is what its run.env says"
    installation("DR_EVAL_NUMBER_OF_TRIALS=1", "DR_EVAL_SAVE_MP4=True")
    said = racecraft("dr", "run-evaluation", tmp_path / "bucket" / "mine")
    assert said.code == 0, said.err
    assert len(list((tmp_path / "bucket" / "mine" / "mp4").glob("camera-*/*-video.mp4"))) == 3


@pytest.mark.parametrize(
    ("line", "said"),
    [
        ("DR_EVAL_IS_CONTINUOUS=False", "DR_EVAL_IS_CONTINUOUS"),
        ("DR_EVAL_OPP_S3_MODEL_PREFIX=../out", "stays inside its folder"),
    ],
)
def test_a_dr_race_that_cannot_be_is_named(racecraft, installation, tmp_path, line, said):
    installation(line)
    told = racecraft("dr", "run-evaluation", tmp_path / "bucket" / "mine")
    assert told.code == 2
    assert said in told.err
