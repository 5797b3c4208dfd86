"""A game served to browsers: our page live, the official board's protocol."""

import json
import socket
import sys
import threading
import time
import urllib.error
import urllib.request
from pathlib import Path

import pytest
from websockets.exceptions import ConnectionClosed, ConnectionClosedOK, InvalidStatus
from websockets.sync.client import connect

from racecraft.worlds.battlesnake.analysis.board_frames import frame, game_end, game_facts
from racecraft.worlds.battlesnake.env.board import Board, Snake
from racecraft.worlds.battlesnake.env.settings import GameSettings
from racecraft.worlds.battlesnake.players.messages import GameCard
from racecraft.worlds.battlesnake.serving.board_server import BoardServer

sys.path.append(str(Path(__file__).resolve().parents[3]))
from tests.browser import Browser, needs_chromium  # noqa: E402

SETTINGS, CARD = GameSettings(7, 7, 2), GameCard("g", names={"s0": "Flo", "s1": "Sam"})
END = game_end(SETTINGS, CARD)


def event(turn):
    snakes = [Snake("s0", [(1, 1 + turn), (1, turn)]), Snake("s1", [(5, 1 + turn), (5, turn)])]
    return frame(Board(7, 7, turn, snakes), CARD)


@pytest.fixture
def serve():
    """Serve a game on a free port; it ends with the test."""
    made = []

    def make(events=(), **how):
        made.append(BoardServer("a game", game_facts(SETTINGS, CARD), events, **how))
        return made[-1], made[-1].start()

    yield make
    for server in made:
        server.close()


def watch(address, **how):
    return connect(address.replace("http", "ws") + "/games/g/events", open_timeout=60, close_timeout=5, **how)


def heard(viewer):
    return json.loads(viewer.recv(timeout=60))


def test_the_official_boards_way(serve):
    """First the game, then every frame so far, each as it comes, and the end; the connection closes with a goodbye."""
    server, address = serve([event(0)])
    with urllib.request.urlopen(f"{address}/games/g", timeout=60) as answer:
        assert answer.headers["Access-Control-Allow-Origin"] == "*"
        assert json.load(answer) == {"Game": game_facts(SETTINGS, CARD)}
    with watch(address) as viewer:
        assert heard(viewer) == event(0)
        server.add(event(1))
        assert heard(viewer) == event(1)
        assert not server.wait_for_viewer(0)
        server.add(END)
        assert heard(viewer) == END
        assert server.wait_for_viewer(5)
        with pytest.raises(ConnectionClosedOK):
            viewer.recv(timeout=60)
    with urllib.request.urlopen(f"{address}/games/g", timeout=60) as answer:
        assert json.load(answer)["Game"]["Status"] == "complete"


def test_everyone_sees_the_whole_game_whenever_they_come(serve):
    server, address = serve()
    with watch(address) as early:
        for turn in range(300):
            server.add(event(turn % 5))
        with watch(address) as late:
            for viewer in (early, late):
                assert [heard(viewer)["Data"]["Turn"] for _ in range(300)] == [turn % 5 for turn in range(300)]


def test_what_a_viewer_says_does_no_harm(serve):
    server, address = serve([event(0)])
    with watch(address) as rude, watch(address) as polite:
        heard(rude)
        rude.send("hello")
        rude.send(b"\xff\xfe")
        server.add(event(1))
        assert heard(rude) == event(1)
        rude.send("x" * 2**20)
        with pytest.raises(ConnectionClosed) as closed:
            rude.recv(timeout=60)
        assert closed.value.rcvd.code == 1009
        assert [heard(polite)["Data"]["Turn"] for _ in range(2)] == [0, 1]


def test_a_viewer_that_leaves_or_is_cut_is_forgotten(serve):
    server, address = serve([event(0)])
    for how in ("close", "cut"):
        with watch(address) as viewer:
            heard(viewer)
            assert server.viewers == 1
            if how == "cut":
                viewer.socket.shutdown(socket.SHUT_RDWR)
        until = time.monotonic() + 60
        while server.viewers and time.monotonic() < until:
            time.sleep(0.01)
        assert server.viewers == 0, how


def test_another_name_for_this_machine_is_refused(serve):
    """A page from elsewhere may watch, but not by a name of its own that leads here."""
    server, address = serve([event(0)])
    way_in = socket.create_connection(host_of(address))
    with pytest.raises(InvalidStatus) as refused:
        watch(address.replace("127.0.0.1", "evil.example"), sock=way_in)
    assert refused.value.response.status_code == 403
    assert server.viewers == 0


def host_of(address):
    host, port = address.removeprefix("http://").split(":")
    return host, int(port)


@pytest.mark.parametrize(
    ("way", "method", "status"), [("/nothing", "GET", 404), ("/games/other", "GET", 404), ("/", "POST", 405)]
)
def test_other_ways_lead_nowhere(serve, way, method, status):
    _, address = serve()
    with pytest.raises(urllib.error.HTTPError) as refused:
        urllib.request.urlopen(urllib.request.Request(address + way, b"" if method == "POST" else None), timeout=60)
    assert refused.value.code == status
    refused.value.close()


@needs_chromium
def test_a_browser_follows_a_game_while_it_is_played(serve, tmp_path):
    server, address = serve([event(0)], speed=32)
    browser = Browser()
    try:
        browser.open(f"{address}/")
        browser.until("document.getElementById('turn').innerText.startsWith('turn 0')")
        assert not browser.value("document.getElementById('live').hidden")
        for turn in range(1, 5):
            server.add(event(turn))
            browser.until(f"document.getElementById('board').dataset.turn === '{turn}'")
        server.add(END)
        browser.until("document.getElementById('live').hidden")
        browser.press("Home")
        assert browser.value("document.getElementById('board').dataset.turn") == "0", "the page keeps the whole game"
        assert browser.complaints == []
    finally:
        browser.close()


def test_closing_with_viewers_leaves_no_thread(serve):
    before = set(threading.enumerate())  # those of other tests may end meanwhile
    server = BoardServer("a game", game_facts(SETTINGS, CARD), [event(0)])
    with watch(server.start()) as viewer:
        heard(viewer)
        server.close()
        with pytest.raises(ConnectionClosed):
            viewer.recv(timeout=60)
    assert set(threading.enumerate()) <= before
