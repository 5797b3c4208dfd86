"""One game between seats: who is asked what, when and with how much time; places and winners by hand."""

from dataclasses import replace

import pytest

from racecraft.worlds.battlesnake.env.board import Board, Snake
from racecraft.worlds.battlesnake.env.dice import StreamDice
from racecraft.worlds.battlesnake.env.settings import GameSettings
from racecraft.worlds.battlesnake.evaluation.match import Played, play
from racecraft.worlds.battlesnake.players.messages import LOOKS, GameCard
from racecraft.worlds.battlesnake.players.safe_moves import best_safe_move

SMALL = GameSettings(7, 7, 2)


class Chair:
    """Stands where a seat is expected, and writes down what is asked of it."""

    appearance = LOOKS

    def __init__(self, name, heard, latency_ms=0, move=""):
        self.name, self.heard, self.latency_ms, self.move = name, heard, latency_ms, move

    def reset_seat(self):
        self.heard.append((self.name, "sits"))

    def prefetch(self, message, seconds):
        self.heard.append((self.name, "asked", message["turn"], message["you"]["id"], seconds))

    def answer(self, board, settings, snake_id, seconds):
        self.heard.append((self.name, "answers", board.turn, snake_id, seconds))
        return self.move or best_safe_move(board, settings, snake_id)

    def notify(self, what, message, seconds):
        self.heard.append((self.name, what, message["turn"], message["you"]["id"], seconds))

    def leave(self):
        self.heard.append((self.name, "leaves"))


@pytest.mark.parametrize("sequential", [False, True])
def test_everybody_hears_the_start_then_every_turn_then_the_end_with_the_time_that_was_named(sequential):
    heard, watched = [], []
    chairs = [Chair("a", heard, 11), Chair("b", heard, 22)]
    watch = lambda board, card: watched.append((board.turn, dict(card.latencies_ms)))  # noqa: E731
    played = play(SMALL, chairs, StreamDice(1), "g7", 240, sequential, most_turns=2, watch=watch)
    both = [("a", "s0"), ("b", "s1")]
    expected = [(name, "sits") for name, _ in both]
    expected += [(name, "start", 0, one, 0.24) for name, one in both]
    for turn in (0, 1):
        asked = [(name, "asked", turn, one, 0.24) for name, one in both]
        answers = [(name, "answers", turn, one, 0.24) for name, one in both]
        pairs = zip(asked, answers, strict=True)
        expected += [one for pair in pairs for one in pair] if sequential else asked + answers
    expected += [(name, "end", 2, one, 0.24) for name, one in both]
    assert heard == expected
    assert watched == [(0, {}), (1, {"s0": 11, "s1": 22}), (2, {"s0": 11, "s1": 22})]
    assert [board.turn for board in played.boards] == [0, 1, 2]
    assert not played.over
    assert (played.card.id, played.card.timeout_ms, played.card.names) == ("g7", 240, {"s0": "a", "s1": "b"})
    assert played.card.appearances == {"s0": LOOKS, "s1": LOOKS}


def test_a_game_of_which_nothing_is_said_asks_all_at_once_and_goes_to_its_end():
    heard = []
    played = play(SMALL, [Chair("a", heard), Chair("b", heard, move="up")], StreamDice(1))
    assert played.over
    assert played.card.timeout_ms == 500
    asked = [one for one in heard if one[1] in ("asked", "answers")]
    assert [one[:2] for one in asked[:4]] == [("a", "asked"), ("b", "asked"), ("a", "answers"), ("b", "answers")]
    assert {one[-1] for one in heard[2:]} == {0.5}


def test_who_has_left_is_asked_no_more():
    heard = []
    settings = GameSettings(11, 11, 3)
    played = play(settings, [Chair("a", heard), Chair("up", heard, move="up"), Chair("c", heard)], StreamDice(1),
                  most_turns=20)  # fmt: skip
    left_on = played.boards[-1].snakes[1].on
    assert 0 < left_on < 11, "always up ends at the wall"
    assert [one[2] for one in heard if one[:2] == ("up", "answers")] == [*range(left_on)]
    assert ("up", "end", played.turns, "s1", 0.5) in heard, "but it hears the end"


def test_a_game_stops_at_the_first_position_that_was_waited_for():
    seen = []
    until = lambda board: seen.append(board.turn) or board.turn == 3  # noqa: E731
    played = play(SMALL, [Chair("a", []), Chair("b", [])], StreamDice(1), most_turns=9, until=until)
    assert (played.turns, seen, played.over) == (3, [1, 2, 3], False)


def ended(*left_on, **settings):
    snakes = [Snake(f"s{n}", [(n, 0)], cause="hazard" if on else "", on=on) for n, on in enumerate(left_on)]
    rules = GameSettings(7, 7, len(left_on), **settings)
    start = Board(7, 7, 0, [Snake(snake.id, snake.body) for snake in snakes])
    return Played(rules, GameCard("g"), [start, Board(7, 7, 11), Board(7, 7, 12, snakes)])


@pytest.mark.parametrize(
    ("left_on", "places", "winner"),
    [
        ((5, 0, 9, 5), [2, 0, 1, 2], "s1"),
        ((0, 0, 9), [0, 0, 2], ""),
        ((12, 12), [0, 0], ""),
        ((3, 12), [1, 0], ""),
        ((0, 12), [0, 1], "s0"),
    ],
)
def test_who_lasted_longer_stands_before_and_who_lives_before_all(left_on, places, winner):
    game = ended(*left_on)
    assert (game.places(), game.winner, game.turns, game.over) == (places, winner, 12, True)


def test_nobody_wins_a_game_that_goes_on_with_one_snake():
    game = ended(0, 4)
    assert game.winner == "s0"
    assert replace(game, settings=replace(game.settings, solo=True)).winner == ""
