"""A server asked over HTTP, at the other end of a wire that is a list: what is sent and read, and when it is closed."""

import http.client
import json
import socket

import pytest

from racecraft.worlds.battlesnake.evaluation import remote
from racecraft.worlds.battlesnake.evaluation.remote import Remote
from racecraft.worlds.battlesnake.players.protocol import LatePlayerError, PlayerError


class Sock:
    def __init__(self):
        self.waits, self.ended = [], []

    def settimeout(self, seconds):
        self.waits.append(seconds)

    def shutdown(self, how):
        self.ended.append(how)
        raise OSError("nobody is there any more")


class Wire:
    """Stands for a connection: gives its answers in turn; what is an exception is raised."""

    made = []

    def __init__(self, host, port=None):
        self.address, self.sock, self.timeout = (host, port), None, None
        self.sent, self.closed, self.answers, self.asked_for = [], 0, [], []
        Wire.made.append(self)

    def request(self, method, path, body, headers):
        self.sent.append((method, path, body, headers))
        if self.sock is None:
            self.sock = Sock()
        answer = self.answers.pop(0)
        if isinstance(answer, Exception):
            raise answer
        self.status, self.answer = answer

    def getresponse(self):
        return self

    def read(self, most):
        self.asked_for.append(most)
        return self.answer[:most]

    def close(self):
        self.closed, self.sock = self.closed + 1, None


class SecureWire(Wire):
    pass


@pytest.fixture
def wire(monkeypatch):
    """Return a function that gives a server's remote and the wire to it, with answers that wait."""
    monkeypatch.setattr(http.client, "HTTPConnection", Wire)
    monkeypatch.setattr(http.client, "HTTPSConnection", SecureWire)
    monkeypatch.setattr(Wire, "made", [])

    def made(*answers, url="http://here:8000/snake/"):
        asked = Remote(url)
        Wire.made[-1].answers = list(answers)
        return asked, Wire.made[-1]

    return made


def ok(value):
    return 200, value if isinstance(value, bytes) else json.dumps(value).encode()


def test_a_question_is_dense_json_below_the_servers_own_path_and_a_greeting_has_no_body(wire):
    asked, line = wire(ok({"apiversion": "1", "color": "#00ff00", "head": 3}), ok({"move": "left"}), ok(b"no matter"))
    assert line.address == ("here", 8000)
    assert asked.appearance(1.5) == {"apiversion": "1", "color": "#00ff00"}, "texts only"
    assert line.timeout == 1.5
    assert asked.move({"turn": 3, "you": {}}, 0.25) == "left"
    asked.end({"turn": 4}, 0.5)
    posted = {"Content-Type": "application/json"}
    assert line.sent == [
        ("GET", "/snake/", None, {}),
        ("POST", "/snake/move", b'{"turn":3,"you":{}}', posted),
        ("POST", "/snake/end", b'{"turn":4}', posted),
    ]
    assert line.sock.waits == [0.25, 0.5], "an open connection waits as long as this question may take"
    assert line.closed == 0, "it is kept open between turns"


@pytest.mark.parametrize(
    ("answer", "words"),
    [
        (ok({"move": "north"}), r"here:8000/snake/: move 'north'; expected one of up"),
        (ok(b"hello"), r"/snake//move: the answer is no JSON \(JSONDecodeError\)"),
        ((204, b""), "HTTP 204; expected 200"),
        (ConnectionRefusedError("nobody"), "ConnectionRefusedError: nobody"),
    ],
)
def test_whatever_is_no_move_is_said_to_be_what_it_is(wire, answer, words):
    asked, line = wire(answer)
    with pytest.raises(PlayerError, match=words):
        asked.move({}, 0.5)
    assert line.closed == (isinstance(answer, ConnectionError) + isinstance(answer, Exception))
    assert len(line.sent) == 1


def test_who_is_late_is_hung_up_on_so_that_its_answer_is_not_the_next_ones(wire):
    asked, line = wire(TimeoutError(), ok({"move": "up"}))
    with pytest.raises(LatePlayerError, match=r"here:8000/snake//move: no answer within 0\.25 s"):
        asked.move({}, 0.25)
    assert line.closed == 1
    assert asked.move({}, 0.25) == "up"


def test_a_connection_that_was_closed_meanwhile_is_opened_once_more_and_a_new_one_is_not(wire):
    gone = ConnectionResetError("gone")
    asked, line = wire(ok({"move": "up"}), gone, ok({"move": "down"}), gone, gone)
    assert [asked.move({}, 0.5), asked.move({}, 0.5)] == ["up", "down"]
    assert (len(line.sent), line.closed) == (3, 1)
    with pytest.raises(PlayerError, match="ConnectionResetError: gone"):
        asked.move({}, 0.5)
    assert len(line.sent) == 5, "twice is enough"


def test_an_answer_may_have_64_kib_and_not_a_byte_more(wire):
    assert remote.MAX_ANSWER_BYTES == 65_536
    text = b'{"move": "up"}'
    asked, line = wire(ok(text + b" " * (65_536 - len(text))), ok(text + b" " * (65_537 - len(text))))
    assert asked.move({}, 0.5) == "up"
    with pytest.raises(PlayerError, match="more than 65536 bytes"):
        asked.move({}, 0.5)
    assert line.closed == 2, "what is left of it must not be read as the next answer"


def test_to_hang_up_ends_what_is_under_way_and_nothing_where_nothing_is(wire):
    asked, line = wire(ok({"move": "up"}))
    asked.disconnect()
    asked.move({}, 0.5)
    sock = line.sock
    asked.disconnect()
    assert sock.ended == [socket.SHUT_RDWR]
    asked.close()
    assert line.closed == 1


def test_a_secure_address_is_asked_securely(wire):
    _, line = wire(url="https://far.away")
    assert type(line) is SecureWire
    assert line.address == ("far.away", None)
    _, plain = wire(url="http://far.away")
    assert type(plain) is Wire
