"""A game before an audience: the pace by a clock of our own, what is said of a turn, and that everybody is let go."""

from types import SimpleNamespace

import pytest
from tests.worlds.battlesnake.evaluation.test_match import SMALL, Chair

from racecraft.contract.random_streams import stream_keys
from racecraft.worlds.battlesnake.env.board import Board, Snake
from racecraft.worlds.battlesnake.env.dice import StreamDice
from racecraft.worlds.battlesnake.evaluation import live
from racecraft.worlds.battlesnake.evaluation.live import Pace, TurnLog, play_live
from racecraft.worlds.battlesnake.evaluation.match import play
from racecraft.worlds.battlesnake.players.messages import GameCard


class Clock:
    """A clock that goes on by what is slept, and by what a test adds."""

    def __init__(self):
        self.now, self.slept = 10.0, []

    def monotonic(self):
        return self.now

    def sleep(self, seconds):
        self.slept.append(round(seconds, 6))
        self.now += seconds


@pytest.fixture
def clock(monkeypatch):
    made = Clock()
    monkeypatch.setattr(live, "time", made)
    return made


@pytest.mark.parametrize(
    ("delay", "least", "slept"),
    [(0.2, 1.0, [0.7, 0.2]), (0.0, 1.0, [0.7]), (0.2, 0.0, [0.2, 0.2]), (0.0, 0.0, []), (0.8, 1.0, [0.8, 0.8])],
)
def test_a_turn_lasts_as_long_as_it_should_and_a_delay_comes_after_each(clock, delay, least, slept):
    """Turns take 0.3 and 1.5 s; of a second 0.7 are left of the first and none of the other."""
    pace = Pace(delay, least)
    for turn, took in enumerate((0.0, 0.3, 1.5)):
        clock.now += took
        pace.show(Board(7, 7, turn), GameCard("g"))
    assert clock.slept == slept


def test_a_turn_is_told_in_a_line_with_who_left_in_it():
    said = []
    log = TurnLog(said.append)
    card = GameCard("g", names={"s0": "Flo"}, latencies_ms={"s0": 12, "s1": 5})
    ends = {"cause": "wall-collision", "on": 1}
    log.show(Board(7, 7, 0, [Snake("s0", [(3, 3)]), Snake("s1", [(0, 6)])]), card)
    assert said == [], "nobody has moved yet"
    log.show(Board(7, 7, 1, [Snake("s0", [(3, 4)]), Snake("s1", [(0, 7)], **ends)]), card)
    log.show(Board(7, 7, 2, [Snake("s0", [(3, 5)]), Snake("s1", [(0, 7)], **ends)]), card)
    log.show(Board(7, 7, 3, [Snake("s0", [(3, 6)], cause="hazard", on=2), Snake("s1", [(0, 7)], **ends)]), card)
    assert said == [
        "turn 1: Flo to 3,4 in 12 ms; s1 to 0,7 in 5 ms (wall-collision)",
        "turn 2: Flo to 3,5 in 12 ms",
    ]


class Watches:
    def __init__(self):
        self.turns, self.left = [], []

    def show(self, board, card):
        self.turns.append(board.turn)

    def leave(self, finished):
        self.left.append(finished)


def test_a_held_game_is_the_game_of_its_seed_and_lets_everybody_go(clock):
    heard, watches = [], [Watches(), Watches()]
    held = play_live(SMALL, [Chair("a", heard), Chair("b", heard)], 5, 240, most_turns=3, observers=watches)
    dice = StreamDice(int(stream_keys(5, "snake game", 1)[0]))
    assert held.boards == play(SMALL, [Chair("a", []), Chair("b", [])], dice, most_turns=3).boards
    assert (held.card.id, held.card.timeout_ms, held.turns) == ("racecraft-5", 240, 3)
    assert [(one.turns, one.left) for one in watches] == [([0, 1, 2, 3], [True])] * 2
    assert heard[-2:] == [("a", "leaves"), ("b", "leaves")]
    assert [one[:2] for one in heard[4:8]] == [("a", "asked"), ("b", "asked"), ("a", "answers"), ("b", "answers")]
    assert clock.slept == [], "nobody asked for a pace"


def test_a_held_game_keeps_its_pace_and_asks_one_by_one_where_it_should(clock):
    heard = []
    chairs = [Chair("a", heard), Chair("b", heard)]
    play_live(SMALL, chairs, 5, 240, True, 2, delay_seconds=0.25, least_seconds=0.5)
    assert clock.slept == [0.5, 0.5]
    assert [one[:2] for one in heard[4:8]] == [("a", "asked"), ("a", "answers"), ("b", "asked"), ("b", "answers")]


def test_a_game_that_breaks_off_is_told_to_whoever_watches(clock):
    heard, watch = [], Watches()
    breaks = Chair("breaks", heard)
    breaks.answer = lambda *asked: 1 / 0
    with pytest.raises(ZeroDivisionError):
        play_live(SMALL, [Chair("a", heard), breaks], 5, 240, observers=[watch])
    assert (watch.turns, watch.left) == ([0], [False])
    assert heard[-2:] == [("a", "leaves"), ("breaks", "leaves")]
    assert SimpleNamespace(leave=Pace(0, 0).leave).leave(True) is None
