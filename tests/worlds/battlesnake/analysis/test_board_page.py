"""The page on which a game of snakes is watched, in a real browser."""

import json
import re
import sys
from pathlib import Path

import pytest

from racecraft.worlds.battlesnake.analysis.board_frames import frame, game_end, game_facts
from racecraft.worlds.battlesnake.analysis.board_page import board_page
from racecraft.worlds.battlesnake.env.board import Board, Snake
from racecraft.worlds.battlesnake.env.settings import GameSettings
from racecraft.worlds.battlesnake.players.messages import GameCard

sys.path.append(str(Path(__file__).resolve().parents[3]))
from tests.browser import Browser, needs_chromium  # noqa: E402

SETTINGS = GameSettings(7, 7, 2)
CARD = GameCard("g", names={"s0": "Flo", "s1": "</script><b>Sam"}, appearances={"s1": {"color": "#ff00ff"}})


def story(turns=12):
    """Two snakes go up; Sam, on the right, starves on turn 4."""
    boards = []
    for turn in range(turns + 1):
        flo = Snake("s0", [(1, min(6, 1 + turn - n)) for n in range(3)], 100 - turn)
        sam = Snake("s1", [(5, 1 + min(turn, 4)), (5, min(turn, 4))], 9 - min(turn, 4))
        if turn >= 4:
            sam.health, sam.cause, sam.on = 0, "out-of-health", 4
        boards.append(Board(7, 7, turn, [flo, sam], food=[(3, 3)]))
    return boards


def events():
    return [*(frame(board, CARD) for board in story()), game_end(SETTINGS, CARD)]


def test_frames_have_the_official_boards_keys():
    told = frame(story()[4], CARD)
    assert told["Type"] == "frame"
    assert set(told["Data"]) == {"Turn", "Snakes", "Food", "Hazards"}
    sam = told["Data"]["Snakes"][1]
    wanted = "ID Name Body Health Death Color HeadType TailType Latency Shout Squad Author StatusCode Error IsBot"
    assert set(sam) == {*wanted.split(), "IsEnvironment"}
    assert sam["Death"] == {"Cause": "out-of-health", "Turn": 4, "EliminatedBy": ""}
    assert (sam["Color"], sam["Body"][0]) == ("#ff00ff", {"X": 5, "Y": 5})
    assert told["Data"]["Snakes"][0]["Death"] is None
    wanted = "ID Status Width Height Ruleset SnakeTimeout Source RulesetName RulesStages Map"
    assert set(game_facts(SETTINGS, CARD)) == set(wanted.split())


def test_hazards_are_told_as_often_as_they_are_stacked_and_only_on_the_board():
    board = story()[0]
    board.hazards.update({(2, 2): 3, (2, 9): 4})
    assert frame(board, CARD)["Data"]["Hazards"] == [{"X": 2, "Y": 2}] * 3


def test_a_page_fetches_nothing_and_no_name_becomes_markup():
    page = board_page("<i>", game_facts(SETTINGS, CARD), events())
    assert "&lt;i&gt;" in page
    assert "</script><b>" not in page
    assert set(re.findall(r'(?:src|href)="([a-z]*)', page)) == {"data"}
    data = page.split('id="told"')[1].split('json">')[1].split("</script>")[0]
    assert json.loads(data)["events"] == events()


@pytest.fixture(scope="module")
def browser(tmp_path_factory):
    browser = Browser()
    yield browser
    browser.close()


@pytest.fixture
def shown(browser, tmp_path):
    """Open the story at a turn, paused."""

    def show(turn):
        path = tmp_path / "game.html"
        path.write_text(board_page("a story", game_facts(SETTINGS, CARD), events(), speed=32))
        browser.open("about:blank")
        browser.open(f"{path.as_uri()}#turn={turn}")
        browser.until("document.getElementById('board').dataset.turn !== undefined")
        return browser

    yield show
    assert browser.complaints == []


def turn_of(browser):
    return int(browser.value("document.getElementById('board').dataset.turn"))


def text_of(browser, name):
    return browser.value(f"document.getElementById('{name}').innerText")


@needs_chromium
def test_the_page_tells_names_health_length_and_deaths(shown):
    browser = shown(3)
    said = text_of(browser, "snakes")
    assert "</script><b>Sam" in said
    assert "length 3" in said
    assert "97" in said
    assert "starved" not in said
    browser.press("ArrowRight")
    assert "starved on turn 4" in text_of(browser, "snakes")
    browser.press("End")
    assert text_of(browser, "turn").split() == ["turn", "12", "of", "12"]
    assert browser.value("document.querySelector('#snakes .wins .fate').innerText") == "wins"
    assert browser.value("document.querySelectorAll('#marks i').length") == 1, "one death above the slider"


@needs_chromium
def test_keys_and_buttons_step_and_jump(shown):
    browser = shown(5)
    for key, turn in (("ArrowRight", 6), ("ArrowLeft", 5), ("Home", 0), ("ArrowLeft", 0), ("End", 12)):
        browser.press(key)
        assert turn_of(browser) == turn, key
    for name, turn in (("back", 11), ("next", 12), ("next", 12), ("first", 0), ("last", 12)):
        browser.click(name)
        assert turn_of(browser) == turn, name


@needs_chromium
def test_space_plays_to_the_end_and_pauses(shown):
    browser = shown(9)
    browser.press(" ")
    assert browser.value("document.getElementById('play').getAttribute('aria-pressed')") == "true"
    browser.until("document.getElementById('play').getAttribute('aria-pressed') === 'false'")
    assert turn_of(browser) == 12
    browser.press(" ")
    browser.until("Number(document.getElementById('board').dataset.turn) < 12")
    browser.press(" ")
    here = turn_of(browser)
    assert browser.value(
        "new Promise(done => setTimeout(() => done(document.getElementById('board').dataset.turn), 150))"
    )
    assert turn_of(browser) == here, "paused"


@needs_chromium
def test_the_slider_scrubs_and_the_speed_is_chosen(shown):
    browser = shown(0)
    browser.value("(s => { s.value = 7; s.dispatchEvent(new Event('input')); })(document.getElementById('scrub'))")
    assert turn_of(browser) == 7
    browser.press("-")
    assert browser.value("document.getElementById('speed').value") == "16"
    browser.press("+")
    assert browser.value("document.getElementById('speed').value") == "32"


@needs_chromium
def test_snakes_lie_where_the_board_says(shown):
    browser = shown(2)
    # Flo's body: (1, 3), (1, 2), (1, 1); the picture's y grows downward from the top of a board of 7.
    paths = browser.value("[...document.querySelectorAll('#board path')].map(p => p.getAttribute('d'))")
    assert "M1.5 3.5L1.5 4.5L1.5 5.5" in paths


@needs_chromium
def test_a_phone_sees_no_sideways_scrolling(tmp_path):
    browser = Browser(500, 900)
    try:
        path = tmp_path / "game.html"
        path.write_text(board_page("a story", game_facts(SETTINGS, CARD), events()))
        browser.open(path.as_uri())
        browser.show(360, 780)
        assert browser.value("document.documentElement.scrollWidth") == 360
        assert browser.value("document.getElementById('board').getBoundingClientRect().width") > 300
        assert browser.shut_out() == []
    finally:
        browser.close()
