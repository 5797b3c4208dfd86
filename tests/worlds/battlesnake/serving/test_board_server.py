"""A game served to browsers: our page live, the official board's protocol, WebSocket frames by hand."""

import asyncio
import base64
import json
import os
import socket
import struct
import sys
import threading
import time
import urllib.error
import urllib.request
from pathlib import Path

import pytest

from racecraft.serving.web_socket import MOST_MESSAGE_BYTES, accept_key
from racecraft.web.ports import PortError
from racecraft.worlds.battlesnake.analysis.board_frames import frame, game_end, game_facts
from racecraft.worlds.battlesnake.env.board import Board, Snake
from racecraft.worlds.battlesnake.env.settings import GameSettings
from racecraft.worlds.battlesnake.players.messages import GameCard
from racecraft.worlds.battlesnake.serving.board_server import BoardServer

sys.path.append(str(Path(__file__).resolve().parents[3]))
from browser import Browser, needs_chromium  # noqa: E402

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


class Client:
    """A WebSocket client that can also misbehave."""

    def __init__(self, address, way="/games/g/events", **headers):
        host, port = address.removeprefix("http://").split(":")
        self.socket = socket.create_connection((host, int(port)), timeout=60)
        key = base64.b64encode(os.urandom(16)).decode()
        asked = {"Upgrade": "websocket", "Connection": "keep-alive, Upgrade", "Sec-WebSocket-Version": "13",
                 "Sec-WebSocket-Key": key} | headers  # fmt: skip
        lines = "".join(f"{name}: {value}\r\n" for name, value in asked.items())
        self.socket.sendall(f"GET {way} HTTP/1.1\r\nHost: x\r\n{lines}\r\n".encode())
        self.file = self.socket.makefile("rb")
        self.status = int(self.file.readline().split()[1])
        self.headers = dict(line.decode().strip().split(": ", 1) for line in iter(self.file.readline, b"\r\n"))
        if self.status == 101:
            assert self.headers["Sec-WebSocket-Accept"] == accept_key(key)

    def send(self, kind, payload=b"", last=True, mask=b"abcd", reserved=0, length=None):
        size = len(payload) if length is None else length
        head = struct.pack("!B", (0x80 if last else 0) | reserved | kind)
        bit = 0x80 if mask else 0
        if size < 126:
            head += struct.pack("!B", bit | size)
        elif size < 1 << 16:
            head += struct.pack("!BH", bit | 126, size)
        else:
            head += struct.pack("!BQ", bit | 127, size)
        masked = bytes(byte ^ mask[n % 4] for n, byte in enumerate(payload)) if mask else payload
        self.socket.sendall(head + mask + masked)

    def receive(self):
        """Return (kind, payload); (None, b"") where the server closed the connection."""
        head = self.file.read(2)
        if len(head) < 2:
            return None, b""
        size = head[1]
        if size == 126:
            size = struct.unpack("!H", self.file.read(2))[0]
        elif size == 127:
            size = struct.unpack("!Q", self.file.read(8))[0]
        return head[0] & 0x0F, self.file.read(size)

    def close(self):
        self.file.close()
        self.socket.close()


TEXT, CLOSE, PING, PONG = 1, 8, 9, 10


def test_the_official_boards_way(serve):
    """First the game, then every frame so far, each as it comes, and the end; the connection closes with a goodbye."""
    server, address = serve([event(0)])
    with urllib.request.urlopen(f"{address}/games/g", timeout=60) as answer:
        assert answer.headers["Access-Control-Allow-Origin"] == "*"
        assert json.load(answer) == {"Game": game_facts(SETTINGS, CARD)}
    client = Client(address)
    assert client.status == 101
    assert json.loads(client.receive()[1]) == event(0)
    server.add(event(1))
    assert json.loads(client.receive()[1]) == event(1)
    assert not server.wait_for_viewer(0)
    server.add(END)
    assert json.loads(client.receive()[1]) == END
    assert server.wait_for_viewer(5)
    kind, code = client.receive()
    assert (kind, struct.unpack("!H", code)[0]) == (CLOSE, 1001)
    client.send(CLOSE, code)
    assert client.receive() == (None, b"")
    client.close()
    with urllib.request.urlopen(f"{address}/games/g", timeout=60) as answer:
        assert json.load(answer)["Game"]["Status"] == "complete"


def test_everyone_sees_the_whole_game_whenever_they_come(serve):
    server, address = serve()
    early = Client(address)
    for turn in range(300):
        server.add(event(turn % 5))
    late = Client(address)
    for client in (early, late):
        turns = [json.loads(client.receive()[1])["Data"]["Turn"] for _ in range(300)]
        assert turns == [turn % 5 for turn in range(300)]
    early.close()
    late.close()


def test_a_ping_is_answered_and_what_a_viewer_says_does_no_harm(serve):
    server, address = serve([event(0)])
    client = Client(address)
    client.receive()
    client.send(TEXT, b"hello")
    client.send(TEXT, b"in ", last=False)
    client.send(PING, b"still there?")
    client.send(0, b"two parts")
    client.send(PONG)
    assert client.receive() == (PONG, b"still there?")
    server.add(event(1))
    assert json.loads(client.receive()[1]) == event(1)
    client.close()


BROKEN = {
    "without a mask": (lambda c: c.send(TEXT, b"hello", mask=b""), 1002),
    "reserved bits": (lambda c: c.send(TEXT, b"hello", reserved=0x40), 1002),
    "unknown kind": (lambda c: c.send(3, b"hello"), 1002),
    "a long ping": (lambda c: c.send(PING, b"a" * 126), 1002),
    "a ping in parts": (lambda c: c.send(PING, b"a", last=False), 1002),
    "nothing to go on with": (lambda c: c.send(0, b"hello"), 1002),
    "two beginnings": (lambda c: (c.send(TEXT, b"a", last=False), c.send(TEXT, b"b")), 1002),
    "binary": (lambda c: c.send(2, b"hello"), 1003),
    "no utf-8": (lambda c: c.send(TEXT, b"\xff\xfe"), 1007),
    "huge": (lambda c: c.send(TEXT, b"", length=1 << 40), 1009),
    "huge in parts": (lambda c: [c.send(min(n, 0) or (not n), b"a" * 40_000, last=False) for n in range(2)], 1009),
}


@pytest.mark.parametrize("how", BROKEN)
def test_a_viewer_that_breaks_the_rules_is_told_which_and_the_game_goes_on(serve, how):
    server, address = serve([event(0)])
    act, code = BROKEN[how]
    rude, polite = Client(address), Client(address)
    rude.receive()
    act(rude)
    kind, payload = rude.receive()
    assert (kind, struct.unpack("!H", payload)[0]) == (CLOSE, code)
    server.add(event(1))
    assert [json.loads(polite.receive()[1])["Data"]["Turn"] for _ in range(2)] == [0, 1]
    rude.close()
    polite.close()
    assert MOST_MESSAGE_BYTES < 80_000


def test_a_viewer_that_leaves_or_is_cut_is_forgotten(serve):
    server, address = serve([event(0)])
    for how in ("close", "cut", "half a frame"):
        client = Client(address)
        client.receive()
        assert server.viewers == 1
        if how == "close":
            client.send(CLOSE, struct.pack("!H", 1000))
            assert client.receive() == (CLOSE, struct.pack("!H", 1000))
        if how == "half a frame":
            client.socket.sendall(b"\x81")
        client.close()
        until = time.monotonic() + 60
        while server.viewers and time.monotonic() < until:
            time.sleep(0.01)
        assert server.viewers == 0, how


@pytest.mark.parametrize(
    "headers",
    [{"Upgrade": "h2c"}, {"Sec-WebSocket-Version": "8"}, {"Sec-WebSocket-Key": "short"}, {"Connection": "close"}],
)
def test_a_handshake_that_is_none_is_refused(serve, headers):
    _, address = serve()
    client = Client(address, **headers)
    assert client.status == 426
    client.close()


@pytest.mark.parametrize(
    ("way", "method", "status"), [("/nothing", "GET", 404), ("/games/other", "GET", 404), ("/", "POST", 405)]
)
def test_other_ways_lead_nowhere(serve, way, method, status):
    _, address = serve()
    with pytest.raises(urllib.error.HTTPError) as refused:
        urllib.request.urlopen(urllib.request.Request(address + way, b"" if method == "POST" else None), timeout=60)
    assert refused.value.code == status
    refused.value.close()


def test_a_port_that_is_taken_is_named(serve):
    _, address = serve()
    port = int(address.rsplit(":", 1)[1])
    with pytest.raises(PortError, match=str(port)):
        BoardServer("a game", game_facts(SETTINGS, CARD)).start(port)


@needs_chromium
def test_a_browser_follows_a_game_while_it_is_played(serve, tmp_path):
    server, address = serve([event(0)], speed=32)
    browser = Browser(tmp_path / "chromium")
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


@needs_chromium
def test_a_board_page_from_elsewhere_may_ask(serve, tmp_path):
    """Another origin, as the official board is: it fetches the game, then listens to the events."""
    server, address = serve([event(0), END])
    elsewhere, other = serve([event(0), END])
    browser = Browser(tmp_path / "chromium")
    try:
        browser.open(f"{other}/")
        browser.say("Page.setBypassCSP", enabled=True)
        browser.open("about:blank")
        browser.open(f"{other}/")
        game = browser.value(f"fetch('{address}/games/g').then(answer => answer.json())")
        assert game["Game"]["ID"] == "g"
        browser.value(
            f"heard = []; s = new WebSocket('{address.replace('http', 'ws')}/games/g/events');"
            "s.onmessage = (message) => heard.push(JSON.parse(message.data).Type); 0"
        )
        browser.until("heard.join() === 'frame,game_end'")
        assert server.wait_for_viewer(5)
    finally:
        browser.close()


def test_closing_with_viewers_leaves_no_thread(serve):
    before = set(threading.enumerate())  # those of other tests may end meanwhile
    server = BoardServer("a game", game_facts(SETTINGS, CARD), [event(0)])
    client = Client(server.start())
    client.receive()
    client.close()
    server.close()
    assert set(threading.enumerate()) <= before
    assert asyncio.run(asyncio.sleep(0, "and loops still work")) == "and loops still work"
