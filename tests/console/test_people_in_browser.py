"""In a browser: a club is invited, signs in from another address, and an audience sees a race move."""

import contextlib

import numpy as np
import pytest
from tests.browser import Browser, needs_chromium

import racecraft as rc
from racecraft.accounts.people import Role
from racecraft.accounts.store import Accounts
from racecraft.console.application import make_console
from racecraft.console.pages import create, garage
from racecraft.formats.tensor_file import write_tensors
from racecraft.jobs.job_paths import JobPaths
from racecraft.league.race import Drive, Driving, Entry, Outcome, Race, Result
from racecraft.league.store import League
from racecraft.web.access import opened
from racecraft.web.server import ServerThread
from racecraft.worlds.deepracer.league.replay import KIND, REPLAY
from racecraft.worlds.deepracer.tracks.catalogue import load_track

pytestmark = needs_chromium
PASSWORD = "a horse in the rain"


@pytest.fixture
def open_console(tmp_path, monkeypatch):
    """A console that other machines reach: (port, workspace, accounts)."""
    from argon2 import PasswordHasher

    cheap = PasswordHasher(time_cost=1, memory_cost=8, parallelism=1)
    monkeypatch.setattr("racecraft.accounts.passwords._hasher", lambda: cheap)
    for page in (create, garage):
        monkeypatch.setattr(page, "begin_training", lambda home, model, words: None)
    monkeypatch.setattr("racecraft.console.application.keep_warm", lambda home: contextlib.nullcontext())
    home = JobPaths(tmp_path / "jobs", f"sqlite:///{tmp_path}/jobs.sqlite")
    application = make_console(tmp_path / "workspace", home, opened("terminal"))
    server, accounts = ServerThread(application, "console"), Accounts(home.store_url)
    yield server.start("0.0.0.0", 0), tmp_path / "workspace", accounts
    server.close()
    accounts.close()


@pytest.fixture
def browser():
    made = Browser(1280, 800)
    made.bypass_policy()
    yield made
    made.close()


def test_an_owner_invites_two_by_csv_and_each_signs_in_from_elsewhere_to_their_own_models(open_console, browser):
    port, _, accounts = open_console
    page, elsewhere = browser.page, f"http://127.0.0.2:{port}"
    browser.open(f"{elsewhere}/?token=terminal")
    page.click("nav >> text=People")
    page.fill("#csv", "name,role\nAda,racer\nBob,\nAda,racer\n")
    page.click("#preview")
    page.wait_for_selector("text=line 2 has that name")
    assert accounts.people() == []
    assert browser.shut_out() == []
    page.click("#invite-all")
    page.wait_for_selector("table.links")
    links = page.locator("table.links code").all_inner_texts()
    assert [(one.name, one.role) for one in accounts.people()] == [("Ada", Role.RACER), ("Bob", Role.RACER)]
    for name, link in zip(("Ada", "Bob"), links, strict=True):
        page.goto("about:blank")  # a page of somebody signed in asks on, and is turned away without its cookie
        page.context.clear_cookies()
        browser.open(link)
        page.fill("#password", PASSWORD)
        page.fill("#again", PASSWORD)
        assert browser.shut_out() == []
        page.click("button:has-text('Choose this password')")
        page.click("#train-first")
        page.wait_for_url("**/models/first-car")
        page.goto(f"{elsewhere}/account")
        entries = page.locator("nav.bar-side a").all_inner_texts()
        assert {"Garage", "Races", name} <= set(entries)
        assert "People" not in entries
        page.click("#sign-out")
        page.wait_for_url("**/sign-in")
        assert browser.shut_out() == []
        page.fill("#name", name)
        page.fill("#password", PASSWORD)
        page.click("main button")
        page.wait_for_url(f"{elsewhere}/")
        assert page.locator(".models .name a:first-child").all_inner_texts() == ["first-car"]
    assert browser.complaints == []


def drive(league, race, number, seconds):
    """Write a result of one lap and its replay: once round the middle of the road."""
    middle = load_track("Oval_track").centre[:: max(1, len(load_track("Oval_track").centre) // 12)]
    folder = league.folder(race.id) / f"drives/{number:05}-0"
    folder.mkdir(parents=True)
    count = len(middle)
    columns = {"front_x": middle[:, 0], "front_y": middle[:, 1], "lap_seconds": np.arange(count) / 15.0}
    write_tensors(folder / REPLAY, KIND, {**columns, "laps": np.zeros(count, int)}, {"ticks_per_second": 15})
    outcome = Outcome(laps=(seconds,), total_seconds=seconds, progress_percent=100.0)
    one = Drive(track="Oval_track", seed=1, outcomes=(outcome,), folder=f"drives/{number:05}-0")
    league.save_result(race.id, Result(heat=f"{number:05}", entries=(number,), drives=(one,), judged=float(number)), {})


def test_an_audience_sees_a_new_drive_and_then_the_board_goes_to_its_result(open_console, browser):
    port, workspace, _ = open_console
    league = League.open_or_create(workspace / "league")
    race = league.add_race(Race(id="", title="Club evening", kind="deepracer", tracks=("Oval_track",), rules={}))
    for name in ("Mia", "Jun"):
        league.add_entry(race.id, lambda folder, name=name: Entry(number=0, racer=name, model="m", entered=1.0))
    drive(league, race, 1, 9.5)
    page = browser.page
    browser.open(rc.show_on_screen(race.id, league=league.path, address=f"http://127.0.0.2:{port}").link)
    page.wait_for_selector("text=Leading: Mia")
    page.wait_for_selector("svg .car")
    assert page.locator("td.racer").all_inner_texts() == ["Mia", "Jun"]
    assert browser.shut_out() == []
    for x in (3.5, 4.5):
        league.save_driving(race.id, Driving(racers=("Jun",), share=0.5, text="lap 2 of 3", places=((x, 1.25),)))
        page.wait_for_selector(f"svg .car[cx='{x}'][cy='-1.25']")
    assert page.inner_text("#who") == "Now: Jun"
    assert page.inner_text("#clock") == "lap 2 of 3"
    assert page.locator("[data-driving]").is_hidden(), "the same is written larger"
    league.save_driving(race.id, Driving(racers=("Jun",), share=0.5, text="lap 2 of 3"))  # by a world without roads
    page.wait_for_selector("[data-driving] >> text=Jun lap 2 of 3")
    assert page.locator("[data-driving] progress").evaluate("one => one.value") == 0.5
    league.save_driving(race.id, None)
    page.wait_for_selector("[data-driving]", state="hidden")
    page.wait_for_selector("text=Leading: Mia")
    drive(league, race, 2, 9.25)
    page.wait_for_function("document.getElementById('who').textContent === 'Jun'")
    page.wait_for_selector("tr.fresh td:has-text('Jun')")
    assert page.locator("td.racer").all_inner_texts() == ["Jun", "Mia"]
    assert page.locator("td.score").all_inner_texts() == ["9.250", "9.500"]
    assert browser.sideways() == 0
    assert browser.complaints == []
    rc.show_on_screen(race.id, league=league.path, end=True)
    page.wait_for_selector("text=This link shows nothing now")
    browser.open(f"http://127.0.0.2:{port}/?token=terminal")
    browser.open(f"http://127.0.0.2:{port}/racers/Jun")
    assert "best here" in page.inner_text("main")
    assert browser.shut_out() == []
