"""Many tracks as a user types them: a training, its table and its report; whatever cannot be ends with code 2."""

import json

import pytest
from tests.cli.conftest import TINY

from racecraft.formats.run_folder import RunFolder
from racecraft.worlds.deepracer.files.generalisation import read_generalisation

TRAIN = ("train", *TINY, "--no-pictures", "--run", "r", "--stop", "iterations=1")
GROUPS = ("--group", "cars=2", "--group", "race=OBJECT_AVOIDANCE boxes.number=1 cars=2")


def test_one_command_trains_groups_and_another_judges_them(racecraft, tmp_path):
    said = racecraft(*TRAIN, "--track", "Oval_track", *GROUPS, "--hold-out", "LGSWide", "--json")
    assert said.code == 0, said.err
    assert "2 on Oval_track, 2 on Oval_track (OBJECT_AVOIDANCE)" in said.err
    assert "0 of 2 lapped, worst " in said.err
    run = RunFolder.open(tmp_path / "r")
    _, results = read_generalisation(run.generalisation)
    assert [one.label for one in results] == ["Oval_track", "Oval_track boxes", "LGSWide"]

    said = racecraft("evaluate", "r", "--tracks", "trained,held-out,Vegas_track", "--laps", "2", "--json")
    told = json.loads(said.out)
    assert (told["starts"], told["checkpoint"]) == (2, 1)
    assert [(one["label"], one["role"], one["laps"]) for one in told["tracks"]] == [
        ("Oval_track", "trained", 2),
        ("Oval_track boxes", "trained", 2),
        ("LGSWide", "held_out", 2),
        ("Vegas_track", "other", 2),
    ]
    assert told["tracks"][0]["mean_progress_percent"] == results[0].mean_progress_percent, "as in its training"
    said = racecraft("evaluate", "r", "--track", "Vegas_track", "--track", "Oval_track")
    assert "other: 0 of 1 lapped from every start, 0 of 5 laps full" in said.out

    assert racecraft("report", "r").code == 0
    page = (tmp_path / "r" / "report.html").read_text()
    assert "Of 1 never seen in training, 0 lapped from every start" in page
    assert page.index("LGSWide") < page.index("Oval_track boxes"), "tracks never seen come first"
    assert racecraft("train", "--run", "r", "--resume", "--track", "Vegas_track").code == 2
    other = ("--group", "cars=2", "--group", "race=OBJECT_AVOIDANCE boxes.number=2 cars=2")
    refused = racecraft("train", "--run", "r", "--resume", *other)
    assert (refused.code, "--group cannot change" in refused.err) == (2, True), refused.err
    again = ("--run", "r", "--resume", "--stop", "iterations=2", "--hold-out", "LGSWide", *GROUPS, "--no-pictures")
    assert racecraft("train", *again).code == 0, "what is said again changes nothing"


def test_one_track_has_no_table(racecraft, tmp_path):
    assert racecraft(*TRAIN, "--track", "Oval_track", "--json").code == 0
    assert not (tmp_path / "r" / "generalisation.csv").exists()
    for arguments, words in (
        (("--tracks", "held-out"), "r holds no track out"),
        (("--track", "Oval_track", "--tracks", "LGSWide"), "--track and --tracks were given"),
        (("--tracks", "LGSWide,Oval_track", "--video", "a.mp4"), "--video shows one track"),
    ):
        said = racecraft("evaluate", "r", *arguments)
        assert (said.code, words in said.err) == (2, True), said.err


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("--track", "Oval_track", "--hold-out", "Oval_track"), "cars are trained on it too"),
        (("--track", "Oval_track", "--tracks", "all"), "--track and --tracks were given"),
        (("--group", "sensors=LIDAR"), "expected groups with the same sensors and actions"),
        (("--groups", "nowhere.json"), "nowhere.json: there is no such file"),
    ],
)
def test_what_cannot_be_trained_ends_with_code_2_before_anything_is_written(racecraft, tmp_path, arguments, words):
    said = racecraft(*TRAIN, *arguments)
    assert (said.code, words in said.err) == (2, True), said.err
    assert not (tmp_path / "r").exists()
