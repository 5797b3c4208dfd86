"""`racecraft evaluate` with a race's options, as a user types them."""

import json

import pytest
from tests.cli.conftest import TINY


@pytest.fixture
def run(racecraft):
    said = racecraft("train", "--no-pictures", "--run", "r", "--stop", "iterations=1", *TINY)
    assert said.code == 0, said.err


def test_a_race_is_judged_filmed_and_written_for_aws(racecraft, run, tmp_path):
    options = ("--number-of-trials", 2, "--max-resets", 1, "--off-track-penalty", 1)
    film = ("--video", "race.mp4", "--view", "pip", "--size", "480p", "--fps", 15, "--save-mp4")
    said = racecraft("evaluate", "r", "--checkpoint", "last", *options, *film, "--json")
    assert said.code == 0, said.err
    told = json.loads(said.out)
    assert told["trials"][-1]["status"] in ("off_track", "time_up", "immobilized", "reversed")
    assert told["resets"] <= 2
    assert (tmp_path / "race.mp4").is_file()
    assert (tmp_path / "race-strip.png").is_file()
    for folder in ("camera-pip", "camera-45degree", "camera-topview"):
        assert (tmp_path / "r" / "mp4" / folder / "1-video.mp4").is_file()
    metrics = json.loads((tmp_path / "r" / "metrics" / "evaluation" / f"{told['aws_files']}.json").read_text())
    assert [row["reset_count"] for row in metrics["metrics"]] == [one["reset_count"] for one in told["trials"]]


WRONG = {
    "number_of_trials is 0; expected 1 to 1000": ["--number-of-trials", "0"],
    "max_resets is -1": ["--max-resets", "-1"],
    "off_track_penalty is -2": ["--off-track-penalty", "-2"],
    "--laps and a race's own options": ["--laps", "2", "--max-resets", "1"],
    "no view 'side'": ["--video", "a.mp4", "--view", "side"],
    "90 pictures a second": ["--video", "a.mp4", "--view", "top", "--fps", "90"],
    "no film size '8k'": ["--video", "a.mp4", "--view", "top", "--size", "8k"],
}


def test_what_cannot_be_judged_is_named(racecraft, run):
    for words, options in WRONG.items():
        said = racecraft("evaluate", "r", *options)
        assert (said.code, words in said.err) == (2, True), said
