"""An arena served to browsers: every door of the API, and the page in a real browser."""

import json
import re
import sys
import urllib.error
import urllib.request
from contextlib import closing
from itertools import islice
from pathlib import Path

import pytest

from racecraft.worlds.battlesnake.league.arena import Arena
from racecraft.worlds.battlesnake.league.entry import entrant_of
from racecraft.worlds.battlesnake.league.store import ArenaStore
from racecraft.worlds.battlesnake.league.terms import ArenaTerms
from racecraft.worlds.battlesnake.serving.arena_server import ArenaServer

sys.path.append(str(Path(__file__).resolve().parents[3]))
from tests.browser import Browser, needs_chromium  # noqa: E402


@pytest.fixture
def store(tmp_path):
    made = ArenaStore.begin(
        tmp_path / "my<arena>.sqlite", ArenaTerms(7, 7, snakes=(2, 3), timeout_ms=200, most_turns=40)
    )
    for number, name in enumerate(("flood_fill", "hungry", "random_safe")):
        made.add(entrant_of(name, anchor=number == 0))
    with closing(Arena(made).play()) as held:
        list(islice(held, 7))
    return made


@pytest.fixture
def address(store):
    server = ArenaServer(store)
    yield server.start()
    server.close()


def ask(address, way):
    with urllib.request.urlopen(address + way, timeout=60) as answer:
        return answer.headers["Content-Type"], answer.read().decode()


def refused(address, way):
    with pytest.raises(urllib.error.HTTPError) as caught:
        ask(address, way)
    with caught.value as answer:
        return answer.code, json.loads(answer.read())


def test_every_door_answers(address, store):
    assert "my&lt;arena&gt;.sqlite" in ask(address, "")[1]
    board = json.loads(ask(address, "api/board")[1])
    assert board["terms"]["snakes"] == [2, 3]
    assert board["last_game"] == 7
    assert not board["playing"]
    assert [table["snakes"] for table in board["tables"]] == [0, 2, 3]
    together, duels, threes = board["tables"]
    assert together["games"] == duels["games"] + threes["games"] == 7
    a, b = together["met"][0][1], together["met"][1][0]
    assert sum(a) > 0
    assert a == b[::-1], "who met whom reads the same from both sides"
    games = json.loads(ask(address, "api/games")[1])
    assert [game["game"] for game in games["games"]] == [7, 6, 5, 4, 3, 2, 1]
    assert not games["more"]
    mine = json.loads(ask(address, "api/games?player=hungry&before=6&snakes=2")[1])["games"]
    assert all("hungry" in game["players"] and game["game"] < 6 and len(game["players"]) == 2 for game in mine)
    kind, page = ask(address, "game?number=3")
    assert kind.startswith("text/html")
    assert '"Type":"game_end"' in page


def test_what_is_not_there_is_named(address):
    assert refused(address, "game?number=99")[0] == 404
    assert refused(address, "game?number=99")[1]["message"] == "There is no game 99 in this arena; expected 1 to 7."
    assert refused(address, "game")[1]["error"] == "bad_number"
    assert refused(address, "api/games?player=nobody")[1]["error"] == "not_there"
    assert refused(address, "elsewhere")[1]["error"] == "not_found"


@needs_chromium
def test_the_page_shows_the_board_and_keeps_up(address, store, tmp_path):
    page = Browser()
    try:
        page.open(address)
        page.until("document.querySelectorAll('#ratings tbody tr').length === 3", 60)
        page.until("document.querySelectorAll('#games li').length === 7", 60)
        assert page.value("document.querySelectorAll('#met tr').length") == 4
        points = page.value("[...document.querySelectorAll('#ratings tbody tr')].map(tr => tr.cells[2].textContent)")
        assert all(re.fullmatch(r"\d+ ± \d+", one) for one in points), points
        for dark in (False, True):
            page.show(1200, 900, dark)
            assert page.shut_out() == []
        page.click("size-2")
        page.until(
            "[...document.querySelectorAll('#games li')].every(li => li.textContent.split(/[›=]/).length === 2)", 60
        )
        page.click("size-0")
        with closing(Arena(store).play()) as held:
            next(held)
        page.until("document.querySelectorAll('#games li').length === 8", 60)
        assert page.value("document.querySelector('#games .number').textContent") == "8"
        page.value("document.querySelector('#ratings td.name').onclick()")
        page.until("document.getElementById('whose').textContent.startsWith('of ')", 60)
        assert page.complaints == []
    finally:
        page.close()
