"""Seasons, records and files of a league whose results are written by hand."""

import csv
import errno
import json
import shutil
from dataclasses import replace
from unittest.mock import Mock

import pytest

from racecraft.actions.league.exporting import export_league
from racecraft.actions.league.seasons import create_season
from racecraft.contract.errors import UserInputError
from racecraft.league import store
from racecraft.league.entering import admit
from racecraft.league.race import Drive, Entry, Outcome, Race, Result
from racecraft.league.records import career_of, fastest_laps
from racecraft.league.seasons import standings
from racecraft.league.site import index_sections
from racecraft.league.store import League


@pytest.fixture
def league(tmp_path):
    return League.open_or_create(tmp_path / "league")


def add(league, title, laps, created=0.0, **values):
    """Add a closed race in which racers drove these laps."""
    race = Race(id="", title=title, kind="deepracer", tracks=("Oval_track",), rules={}, is_closed=True,
                created=created, **values)  # fmt: skip
    race = league.add_race(race)
    for number, (racer, driven) in enumerate(laps.items(), start=1):
        league.add_entry(
            race.id,
            lambda folder, racer=racer: folder.mkdir() or Entry(number=0, racer=racer, model="m", entered=0.0),
        )
        outcome = Outcome(laps=tuple(driven), total_seconds=sum(driven), progress_percent=100.0, resets=1)
        drive = Drive(track="Oval_track", seed=0, outcomes=(outcome,))
        result = Result(heat=f"{number:05}", entries=(number,), drives=(drive,), judged=created + number)
        league.save_result(race.id, result, {})
    return race


def test_a_league_that_was_broken_off_has_no_empty_secret(tmp_path, monkeypatch):
    """From an empty one everybody could make the seeds."""
    folder = tmp_path / "league"
    with monkeypatch.context() as full:
        full.setattr(store.secrets, "token_hex", Mock(side_effect=OSError(errno.ENOSPC, "No space left")))
        with pytest.raises(UserInputError, match="the disk is full"):
            League.open_or_create(folder)
    assert not (folder / "secret").exists()
    (folder / "secret").touch()  # as older versions left it
    League.open_or_create(folder)
    assert len(bytes.fromhex((folder / "secret").read_text())) == 32


def test_a_season_counts_the_best_races_and_no_qualifier(league):
    season = create_season("Winter", points="5,3,1", counted=2, league=league.path).season
    laps = {"Ann": [8.0], "Bob": [9.0], "Cy": [10.0]}
    add(league, "Qualifier", {"Cy": [1.0]}, 0.0, season=season.id, stage="qualifier")
    for number, order in enumerate((laps, laps, {"Bob": [7.0], "Ann": [7.5]}), start=1):
        add(league, f"Race {number}", order, float(number), season=season.id)
    found = standings(league, season, now=100.0)
    assert [(row.racer, row.points, row.race_points) for row in found.rows] == [
        ("Ann", 10, (0, 5, 5, 3)),
        ("Bob", 8, (0, 3, 3, 5)),
        ("Cy", 2, (0, 1, 1, 0)),
    ]
    assert found.is_over


def test_only_the_first_of_a_qualifier_enter_its_final(league):
    qualifier = add(league, "Qualifier", {"Ann": [8.0], "Bob": [9.0]})
    final = add(league, "Final", {}, qualifier=qualifier.id, qualified=1, stage="final")
    final = replace(final, is_closed=False)
    for racer, refusal in (
        ("Bob", "Bob has place 2 in qualifier; expected one of the first 1"),
        ("Cy", "Cy has place none in qualifier"),
        ("Ann", "there is no such folder; expected a run folder"),  # she may, with a model
    ):
        with pytest.raises(UserInputError, match=refusal):
            admit(league, final, "/nowhere", racer, 1.0)


def test_racers_between_whom_nothing_decides_are_champions_together(league):
    season = create_season("Winter", points="3,1", league=league.path).season
    add(league, "One", {"Ann": [8.0], "Bob": [9.0]}, season=season.id)
    add(league, "Two", {"Ann": [9.0], "Bob": [8.0], "Cy": [10.0]}, season=season.id)
    found = standings(league, season, now=100.0)
    assert found.leaders == ("Ann", "Bob")
    assert index_sections(league, [], 100.0)[1]["title"] == "Winter · champion: Ann, Bob"


def test_a_season_with_an_open_race_has_no_champion(league):
    season = create_season("Winter", league=league.path).season
    add(league, "One", {"Ann": [8.0]}, season=season.id)
    race = add(league, "Two", {"Ann": [8.0]}, season=season.id)
    shutil.rmtree(league.folder(race.id) / "results")
    assert not standings(league, season, now=100.0).is_over


def test_records_are_each_racers_fastest_lap_and_a_withdrawn_entry_has_none(league):
    race = add(league, "One", {"Ann": [8.0, 7.0], "Bob": [6.0]})
    add(league, "Two", {"Ann": [7.5]})
    assert [(one.racer, one.seconds, one.race, one.entry) for one in fastest_laps(league)] == [
        ("Bob", 6.0, "one", 2), ("Ann", 7.0, "one", 1)
    ]  # fmt: skip
    assert (career_of(league, "Ann").wins, career_of(league, "Ann").laps) == (1, 3)
    league.withdraw(race.id, 2)
    assert [one.racer for one in fastest_laps(league)] == ["Ann"]
    with pytest.raises(UserInputError, match="no race has a racer 'Bo'"):
        career_of(league, "Bo")


def test_a_board_leaves_as_csv_json_and_pages_and_no_name_becomes_code(league, tmp_path):
    add(league, "One", {"=cmd()": [8.0], "<b>Bob</b>": [9.0]})
    (file,) = export_league("one", to="csv", out=tmp_path / "one.csv", league=league.path).files
    rows = list(csv.DictReader(file.read_text(encoding="utf-8").splitlines()))
    assert [(row["place"], row["racer"], row["score"]) for row in rows] == [
        ("1", "'=cmd()", "8.0"), ("2", "<b>Bob</b>", "9.0")
    ]  # fmt: skip
    (file,) = export_league("one", to="json", out=tmp_path / "one.json", league=league.path).files
    assert [row["gap"] for row in json.loads(file.read_text())["rows"]] == [0.0, 1.0]
    files = export_league(to="site", out=tmp_path / "site", league=league.path).files
    assert [one.name for one in files] == ["index.html", "one.html", "one.csv", "one.json"]
    page = (tmp_path / "site/one.html").read_text(encoding="utf-8")
    assert "&lt;b&gt;Bob" in page
    assert "<b>Bob" not in page


def test_a_result_that_came_a_moment_after_the_last_look_is_seen(tmp_path):
    league = League.open_or_create(tmp_path / "league")
    race = add(league, "Club", {})
    for number in range(1, 6):
        result = Result(heat=f"{number:05}", entries=(number,), drives=(), judged=float(number))
        league.save_result(race.id, result, {})
        assert len(league.results(race.id)) == number
        assert len(league.results(race.id)) == number
    assert league.reset(race.id, "00003") == 1
    assert "00003" not in league.results(race.id)
