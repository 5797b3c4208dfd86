"""Races in the browser: made, entered, judged, watched beside the leader; each page looked at by axe."""

import contextlib
import sys
import urllib.request
from pathlib import Path

import numpy as np
import pytest
from PIL import Image
from tests.browser import Browser, needs_chromium
from tests.console.conftest import write_run

from racecraft.actions.league.seasons import create_season
from racecraft.analysis.video import encode_film
from racecraft.console.application import make_console
from racecraft.console.pages import races
from racecraft.jobs.job_paths import JobPaths
from racecraft.league.race import Drive, Entry, Outcome, Race, Result
from racecraft.league.store import League
from racecraft.web.server import ServerThread

sys.path.append(str(Path(__file__).resolve().parents[1] / "league"))
from test_seasons import add  # noqa: E402

pytestmark = needs_chromium


@pytest.fixture
def console(tmp_path, monkeypatch):
    """A console whose races are judged by nobody: (address, workspace folder, races that were to be judged)."""
    asked = []

    class Judge:
        faults = {}

        def judge(self, race):
            asked.append(race)

        def expect(self, kind):
            asked.append(kind)

    monkeypatch.setattr(races, "judge_of", lambda path: Judge())
    monkeypatch.setattr("racecraft.console.application.keep_warm", lambda home: contextlib.nullcontext())
    application = make_console(tmp_path / "workspace", JobPaths(tmp_path / "jobs", f"sqlite:///{tmp_path}/jobs.sqlite"))
    server = ServerThread(application, "console")
    port = server.start("127.0.0.1", 0)
    yield f"http://127.0.0.1:{port}", tmp_path / "workspace", asked
    server.close()


@pytest.fixture
def browser():
    made = Browser(1280, 900)
    yield made
    made.close()


def test_an_organiser_makes_a_race_and_the_form_says_what_is_wrong(console, browser):
    address, workspace, _ = console
    browser.open(f"{address}/races")
    browser.page.click("text=New race >> nth=0")
    assert browser.shut_out() == []
    browser.page.fill("#title", "Club evening")
    browser.page.select_option("#track", "Oval_track")
    browser.page.fill("#laps", "many")
    browser.page.click("#create-race")
    assert "Laps is 'many'; expected a whole number" in browser.page.inner_text("#laps-wrong")
    browser.page.fill("#laps", "2")
    browser.page.fill("#closes", "+3h")
    browser.page.click("#create-race")
    browser.page.wait_for_url("**/races/club-evening")
    race = League(workspace / "league").race("club-evening")
    assert (race.tracks, race.rules["laps"], race.is_practice) == (("Oval_track",), 2, False)
    assert "Nobody has a result yet" in browser.page.inner_text("main")


def test_a_board_its_season_and_its_organisers_acts(console, browser):
    address, workspace, asked = console
    league = League.open_or_create(workspace / "league")
    season = create_season("Winter", points="3,1", league=league.path).season.id
    add(league, "One", {"Ann": [8.0], "<i>Bob</i>": [9.0]}, season=season)
    browser.open(f"{address}/seasons/winter")
    assert browser.page.inner_text(".sentence") == "Ann is the champion with 3 points."
    assert [row.inner_text().split("\t")[:3] for row in browser.page.query_selector_all("tbody tr")] == [
        ["1", "Ann", "3"], ["2", "<i>Bob</i>", "1"]
    ]  # fmt: skip
    assert browser.shut_out() == []
    browser.open(f"{address}/races/one")
    rows = [row.inner_text().split("\t")[:5] for row in browser.page.query_selector_all(".board tbody tr")]
    assert rows == [["1", "Ann", "m", "8.000", ""], ["2", "<i>Bob</i>", "m", "9.000", "+1.000"]]
    assert browser.shut_out() == []
    outcome = Outcome(laps=(7.5,), total_seconds=7.5, progress_percent=100.0)
    league.add_entry("one", lambda folder: Entry(number=0, racer="Cy", model="m", entered=0.0))
    drives = (Drive(track="Oval_track", seed=0, outcomes=(outcome,)),)
    league.save_result("one", Result(heat="00003", entries=(3,), drives=drives, judged=9.0), {})
    browser.page.wait_for_selector(".board tbody tr:first-child >> text=Cy")  # it moves while one looks
    browser.page.click("text=Judge what waits")
    assert asked == ["one"]
    browser.page.click("button:has-text('Open')")
    assert league.race("one").is_open(0.0)
    browser.open(f"{address}/races/one/enter")
    assert "None of your models is ready" in browser.page.inner_text("main")
    browser.open(f"{address}/races/{300 * 'a'}")  # longer than a file may be named
    assert "has no race 'aaa" in browser.page.inner_text("main")
    league.add_race(Race(id="", title="Home", kind="deepracer", tracks=("home",), rules={}))  # an organiser's own track
    for page in ("races", "races/home"):
        browser.open(f"{address}/{page}")
        assert "/pictures/deepracer/home.svg" not in browser.page.content()
    assert "Home" in browser.page.inner_text("main")


def test_one_click_enters_the_practice_race_of_a_track_from_the_models_and_the_tracks_page(
    console, browser, monkeypatch
):
    address, workspace, asked = console
    typed = []
    monkeypatch.setattr(races, "run_command", lambda words, folder: typed.append(words))
    write_run(workspace / "runs/mint", track="Oval_track")
    for page in ("models/mint", "tracks/Oval_track"):
        browser.open(f"{address}/{page}")
        browser.page.click("text=Practice race")
        browser.page.wait_for_url("**/races/practice-on-oval-track")
    (race,) = League(workspace / "league").races()
    assert (race.tracks, race.is_practice) == (("Oval_track",), True)
    assert [words[:3] for words in typed] == [["league", "enter", race.id]] * 2
    assert asked == [race.id, race.id]
    assert browser.shut_out() == []


def test_a_race_of_snakes_has_a_form_a_board_and_a_page_for_each_heat(console, browser):
    address, workspace, _ = console
    browser.open(f"{address}/races/new?kind=battlesnake")
    browser.page.fill("#title", "Snakes")
    browser.page.click("#create-race")
    browser.page.wait_for_url("**/races/snakes")
    league = League(workspace / "league")
    for name in ("Ann", "Bob"):
        league.add_entry("snakes", lambda folder, name=name: Entry(number=0, racer=name, model="m", entered=1.0))
    outcomes = (Outcome(place=2, places=(2, 1)), Outcome(place=1, places=(1, 2)))
    drive = Drive(track="standard", seed=1, outcomes=outcomes, folder="drives/meeting-00001-0")
    league.save_result("snakes", Result(heat="meeting-00001", entries=(1, 2), drives=(drive,), judged=1.0), {0: {}})
    for racer, places in (("Ann", "2, 1"), ("Bob", "1, 2")):
        browser.open(f"{address}/races/snakes")
        browser.page.click(f"tr[data-row={racer}] >> text=Watch")
        assert browser.page.inner_text("h1") == racer
        assert places in browser.page.inner_text(".strip")
    assert browser.page.locator("#film").count() == 1
    pictures = (np.full((48, 64, 3), level, np.uint8) for level in (200, 40))
    encode_film(league.folder("snakes") / drive.folder / "film-2.mp4", pictures, 5.0)
    browser.page.reload()
    with urllib.request.urlopen(browser.value("document.querySelector('video').poster")) as answer:
        (first,) = np.unique(np.asarray(Image.open(answer)).round(-1))
    assert first == 200, "the film's first picture stands before it"
    assert browser.shut_out() == []


@pytest.mark.long
@pytest.mark.parametrize("dark", [False, True])
def test_no_page_of_races_tracks_and_lessons_shuts_anybody_out(console, dark):
    """The pages of models are walked in test_flows.py."""
    address, workspace, _ = console
    write_run(workspace / "runs/a-1")
    league = League.open_or_create(workspace / "league")
    season = create_season("Spring", league=league.path).season.id
    race = add(league, "Cup", {"Ann": [8.0], "Bob": [9.0]}, season=season)
    pages = [
        f"/races/{race.id}", f"/races/{race.id}/drives/00001", f"/races/{race.id}/edit", f"/races/{race.id}/show",
        "/racers/Ann", "/races", "/races/new", "/races/new?kind=battlesnake", f"/seasons/{season}", "/seasons/new",
        "/drive", "/drive/Oval_track", "/tracks", "/tracks/new", "/tracks/Oval_track", "/models/a-1/laps", "/endpoints",
        "/tuning", "/lessons", "/lessons/words", "/shared", "/compare",
    ]  # fmt: skip
    found, browser = {}, Browser(1440, 900, dark=dark)
    browser.bypass_policy()
    for page in pages:
        browser.open(address + page)
        if faults := browser.shut_out():
            found[page] = faults
    browser.close()
    assert found == {}
