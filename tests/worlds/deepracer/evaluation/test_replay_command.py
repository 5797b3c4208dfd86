"""`racecraft replay` at the prompt: one JSON object, or a page for people."""

import json
import re
import tarfile
from pathlib import Path

import pytest
import typer
from tests.reference import DATA
from typer.testing import CliRunner

from racecraft.worlds.deepracer.cli.replay import replay

TRACE = DATA / "traces" / "drfc-1-worker" / "evaluation-20220709200242"
TRACK = DATA / "tracks" / "reinvent_base.npy"


@pytest.fixture
def ask():
    """Return a function that runs the command with some words and gives back its standard output."""
    app = typer.Typer()
    app.command()(replay)

    def run(*words):
        result = CliRunner().invoke(app, [str(word) for word in words], catch_exceptions=False)
        assert result.exit_code == 0
        return result.stdout

    return run


def test_json_is_one_object_on_one_line_with_the_promised_keys(ask, tmp_path):
    text = ask(TRACE, "--track", TRACK, "--json", "--picture", tmp_path / "replay.png")
    assert text.count("\n") == 1
    report = json.loads(text)
    assert report["rows"] == 650
    for key in ("progress", "closest_waypoint", "all_wheels", "off_track"):
        assert report[f"{key}_mismatches"] == 0
    for key in ("open_loop_position_m", "open_loop_yaw_deg"):
        assert set(report[key]) == {"0.5s", "1s"}
        assert all(0.0 < part["median"] < part["p90"] for part in report[key].values())
    assert len(report["files"][0]["worst_windows"]) == 5
    assert Path(report["picture"]).stat().st_size > 10_000


def test_a_person_reads_what_differs_and_how_far_the_car_strays(ask):
    text = ask(TRACE, "--track", TRACK)
    assert "650 rows, 3 episodes, 1 file(s), on reinvent_base." in text
    assert text.count("100.00 % agree") == 4
    assert "Driven again by v4" in text
    assert "0.085 m" in text


def test_one_command_leaves_one_page_that_answers_the_question(ask, tmp_path):
    text = ask(TRACE, "--track", TRACK, "--report", tmp_path / "same.html")
    assert "The track is the same. So is the car: it is v4 (the next car strays" in text
    page = (tmp_path / "same.html").read_text(encoding="utf-8")
    assert "The track is the same. So is the car: it is v4 (the next car strays" in page
    for figure in ("650 recorded rows", "100 %", "3.6 cm", "8.5 cm", "evaluation-simtrace/0-iteration.csv"):
        assert figure in page
    assert page.count("<img") == 1
    assert "data:image/png;base64," in page
    fetched = re.findall(r"""(?:src|href)=["'](?!data:|#)[^"']+|@import|url\(["']?(?!#|data:|["'])""", page)
    assert fetched == [], "nothing on the page is fetched from anywhere"


def test_a_car_that_drives_otherwise_is_told_from_ours(ask):
    report = json.loads(ask(TRACE, "--track", TRACK, "--car", "kinematic", "--json"))
    assert (report["same_track"], report["same_car"]) == (True, False)
    assert "The car is not: kinematic strays further" in ask(TRACE, "--track", TRACK, "--car", "kinematic")


def test_by_name_the_track_is_the_same_within_a_point(ask):
    assert json.loads(ask(TRACE, "--track", "reinvent_base", "--json"))["same_track"] is True


@pytest.fixture
def robomaker_log(tmp_path):
    """Return a simulation log with the rows of the trace, as the classic console wrote one."""
    rows = next(TRACE.rglob("0-iteration.csv")).read_text().splitlines()[1:]
    log = tmp_path / "logs" / "evaluation" / "evaluation-20220709200242-robomaker.log"
    log.parent.mkdir(parents=True)
    head = ["started roslaunch server http://127.0.0.1:1/", " * /rosdistro: melodic", "simapp_version 4.0, training"]
    log.write_text("\n".join([*head, *(f"SIM_TRACE_LOG:{row}" for row in rows), ""]))
    return log


def test_a_log_a_folder_and_an_archive_are_replayed_and_their_track_is_found(ask, robomaker_log, tmp_path):
    with tarfile.open(tmp_path / "model.tar.gz", "w:gz") as archive:
        archive.add(robomaker_log, "model/logs/evaluation/evaluation-robomaker.log")
    for what in (robomaker_log, robomaker_log.parent.parent, tmp_path / "model.tar.gz"):
        report = json.loads(ask(what, "--json"))
        assert (report["rows"], report["track"], report["car"]) == (650, "reinvent_base", "v4")
        assert report["recorded_car"]["build"] == "ROS 1"
        assert report["same_car"] is True
