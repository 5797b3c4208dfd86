"""What an organiser does by command stands in the log of people, with --json as without; alone there is no log."""

import pytest
from typer.testing import CliRunner

import racecraft as rc
from racecraft.actions.people import invite_people, show_act_log
from racecraft.cli.league import app
from racecraft.jobs.job_paths import FOLDER_VARIABLE


@pytest.fixture
def league(tmp_path, monkeypatch):
    monkeypatch.setenv(FOLDER_VARIABLE, str(tmp_path / "jobs"))
    monkeypatch.setenv("RACECRAFT_LEAGUE", str(tmp_path / "league"))
    return tmp_path / "league"


def run(*words):
    result = CliRunner().invoke(app, words)
    assert result.exit_code == 0, result.output


def test_acts_by_command_stand_in_the_log(league):
    invite_people("Ada")
    run("create-snakes", "Snake evening")
    rc.enter_race("snake-evening", "hungry", league=league)
    for words in (["edit", "--submissions", "2"], ["close", "--json"], ["open"], ["reset"]):
        run(words[0], "Snake evening", *words[1:])
    run("withdraw", "snake-evening", "1")
    run("copy", "snake-evening", "Another")
    acts = show_act_log().acts
    assert [(one.what, one.subject) for one in reversed(acts)][1:] == [
        ("make race", "snake-evening"),
        ("edit race", "snake-evening"),
        ("close race", "snake-evening"),
        ("open race", "snake-evening"),
        ("reset race", "snake-evening"),
        ("withdraw entry", "snake-evening"),
        ("copy race", "another"),
    ]
    assert acts[0].detail == {"league": str(league.resolve())}


def test_who_is_alone_keeps_no_log_and_makes_no_store(league, tmp_path):
    run("create-snakes", "Evening")
    run("close", "evening")
    assert not (tmp_path / "jobs").exists()
