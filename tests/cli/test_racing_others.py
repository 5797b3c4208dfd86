"""`racecraft train --against` and `racecraft race`, as a user types them."""

import json

import pytest
from tests.cli.conftest import TINY

STOP = ("--stop", "iterations=1", "--no-pictures")


@pytest.fixture
def run(racecraft):
    said = racecraft("train", "--run", "r", *STOP, *TINY)
    assert said.code == 0, said.err


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
    "9 cars were named": ["race", *["r"] * 9],
    "nowhere: there is no such folder": ["race", "r", "nowhere"],
    "there is no checkpoint '77'": ["race", "r", "r:77"],
    "done_condition is 'some'; expected any or all": ["race", "r", "r", "--done-condition", "some"],
    "laps is 0": ["race", "r", "r", "--laps", "0"],
    "no view 'side'": ["race", "r", "r", "--view", "side"],
    "--size 480p films nothing; expected --video": ["race", "r", "r", "--size", "480p"],
    "Did you mean 'Oval_track'": ["race", "r", "r", "--track", "Oval_trak"],
    "gone: there is no such folder": ["train", "--against", "gone", *STOP],
    "--against asks for a race of HEAD_TO_MODEL": ["train", "--against", "self", "--set", "race.type=HEAD_TO_BOT"],
    "against.cars is 9; expected 2 to 8": ["train", "--against", "self", "--set", "against.cars=9"],
}


def test_what_no_race_can_be_is_named(racecraft, run):
    for said, words in WRONG.items():
        told = racecraft(*words)
        assert told.code == 2, words
        assert said in told.err, told.err


def test_cars_that_do_not_fit_on_the_lap_are_named(racecraft, run):
    told = racecraft("race", *["r"] * 8, "--track", "Straight_track")
    assert told.code == 2
    assert "8 cars start 0.75 m behind one another" in told.err
