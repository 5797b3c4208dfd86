"""Who sits at a board, by a clock of our own: time for an answer, late and failed moves, and what servers are told."""

from concurrent.futures import Future
from types import SimpleNamespace

import pytest

from racecraft.worlds.battlesnake.env.board import Board, Snake
from racecraft.worlds.battlesnake.env.settings import GameSettings
from racecraft.worlds.battlesnake.evaluation import seats
from racecraft.worlds.battlesnake.evaluation.remote import Remote
from racecraft.worlds.battlesnake.evaluation.seats import Failures, Seat
from racecraft.worlds.battlesnake.players.protocol import LatePlayerError, PlayerError

SETTINGS = GameSettings(7, 7, 2)
BOARD = Board(7, 7, 4, [Snake("s0", [(3, 3)])])


@pytest.fixture
def clock(monkeypatch):
    made = SimpleNamespace(now=100.0)
    monkeypatch.setattr(seats, "time", SimpleNamespace(monotonic=lambda: made.now))
    return made


class Thinks:
    """Takes its time by the clock, and is told how long it may."""

    def __init__(self, clock, took, word="left"):
        self.clock, self.took, self.word, self.told = clock, took, word, []

    def choose(self, board, settings, snake_id, seconds):
        self.told.append(seconds)
        self.clock.now += self.took
        if isinstance(self.word, Exception):
            raise self.word
        return self.word


def answered(seat, seconds=0.5):
    return seat.answer(BOARD, SETTINGS, "s0", seconds)


def test_an_answer_in_just_the_time_is_in_time_and_one_a_millisecond_later_is_not(clock):
    seat = Seat("quick", Thinks(clock, 0.5))
    assert (answered(seat), seat.latency_ms, seat.failures) == ("left", 500, Failures())
    seat.player.took, seat.player.word = 0.501, "down"
    assert (answered(seat), seat.latency_ms) == ("left", 500), "the last move again; late counts as all the time"
    assert seat.failures == Failures(1, 0, "turn 4: quick: no answer within 0.4 s.", [4], [])
    seat.player.took = 0.0123
    assert (answered(seat), seat.latency_ms) == ("down", 12)
    assert seat.player.told == pytest.approx([0.8 * 0.4] * 3), "four fifths of what is left without the way"


@pytest.mark.parametrize(
    ("word", "words"),
    [("north", "turn 4: wild: move 'north'; expected one of up"), (ValueError("oh dear"), "turn 4: oh dear")],
)
def test_who_gives_no_move_goes_on_as_before_and_upward_at_first(clock, word, words):
    seat = Seat("wild", Thinks(clock, 0.1, word))
    assert (answered(seat), seat.latency_ms) == ("up", 100)
    assert (seat.failures.crashes, seat.failures.timeouts, seat.failures.failed_turns) == (1, 0, [4])
    assert seat.failures.last_error.startswith(words)
    seat.player.word = "right"
    assert answered(seat) == "right"
    seat.player.word = word
    assert answered(seat) == "right"
    seat.reset_seat()
    assert (answered(seat), seat.failures.crashes) == ("up", 3)
    seat.reset_seat()
    assert seat.latency_ms == 0


class Reads:
    """A player that reads messages; answers from a list."""

    def __init__(self, clock, *answers):
        self.clock, self.answers, self.told, self.hung_up, self.closed = clock, list(answers), [], 0, 0

    def move(self, message, seconds):
        self.told.append((message, seconds))
        took, word = self.answers.pop(0)
        self.clock.now += took
        if isinstance(word, Exception):
            raise word
        return word

    def start(self, message, seconds):
        self.told.append(("start", message, seconds))

    def end(self, message, seconds):
        self.told.append(("end", message, seconds))
        raise PlayerError("gone already")

    def disconnect(self):
        self.hung_up += 1

    def close(self):
        self.closed += 1


class Server(Reads, Remote):
    """The same at the end of a wire."""


class AtOnce:
    """Does what it is given before it returns."""

    def __init__(self):
        self.closed = 0

    def submit(self, act):
        future = Future()
        try:
            future.set_result(act())
        except Exception as error:
            future.set_exception(error)
        return future

    def close(self):
        self.closed += 1


class Never(AtOnce):
    """Begins and comes to no end."""

    def __init__(self):
        super().__init__()
        self.asked = 0

    def submit(self, act):
        self.asked += 1
        return Future()


@pytest.mark.parametrize(("kind", "limit"), [(Reads, 0.15), (Server, 0.25)])
def test_a_reader_has_the_time_less_the_way_and_a_server_all_of_it(clock, kind, limit):
    """Of 250 ms 100 are the way."""
    player = kind(clock, (0.25, "left"), (0.251, "down"), (0.0, "north"), (0.1, LatePlayerError("tired")))
    seat = Seat("reads", player, _pool=AtOnce())
    moves = []
    for turn in range(4):
        seat.prefetch({"turn": turn}, 0.25)
        moves.append((answered(seat, 0.25), seat.latency_ms))
    assert moves == [("left", 250), ("left", 250), ("left", 0), ("left", 250)]
    assert player.told == [({"turn": turn}, pytest.approx(limit)) for turn in range(4)]
    failures = seat.failures
    assert (failures.timeouts, failures.crashes) == (2, 1)
    assert failures.last_error == f"turn 4: reads: no answer within {limit:g} s."


def test_who_is_still_busy_is_not_asked_again_and_is_late(clock, monkeypatch):
    server, pool = Server(clock), Never()
    seat = Seat("slow", server, _pool=pool)
    waited = []
    monkeypatch.setattr(Future, "result", lambda self, seconds: waited.append(seconds) or Future.exception(self, 0))
    for _ in range(2):
        seat.prefetch({}, 0.25)
        clock.now += 0.2
        assert answered(seat, 0.25) == "up"
    seat.notify("end", {}, 0.25)
    assert waited == [pytest.approx(0.05), 0.0], "what is left of the time since it was asked"
    assert (pool.asked, server.hung_up, seat.failures.timeouts) == (1, 2, 2)
    assert seat.latency_ms == 250


def test_who_comes_to_no_end_of_a_start_is_hung_up_on_and_a_failure_there_is_only_noted(clock):
    server, pool = Server(clock), Never()
    Seat("slow", server, _pool=pool).notify("start", {}, 0.0)
    assert (pool.asked, server.hung_up) == (1, 1)
    seat = Seat("reads", server, _pool=AtOnce())
    seat.notify("start", {"turn": 0}, 0.5)
    seat.notify("end", {"turn": 9}, 0.5)
    assert server.told == [("start", {"turn": 0}, 0.5), ("end", {"turn": 9}, 0.5)]
    assert (seat.failures.last_error, seat.failures.crashes, seat.failures.timeouts) == ("gone already", 0, 0)


def test_who_leaves_is_hung_up_on_and_closed(clock):
    for kind, hung_up in ((Reads, 0), (Server, 1)):
        player, pool = kind(clock), AtOnce()
        Seat("goes", player, _pool=pool).leave()
        assert (player.hung_up, player.closed, pool.closed) == (hung_up, 1, 1)
