"""The table of a tournament by hand: who stands where, who beat whom, and what of it is written as JSON."""

import json

import pytest

from racecraft.evaluation.rating import Result, rate, wilson
from racecraft.worlds.battlesnake.evaluation.standings import GameResult, table_of

GAMES = [
    GameResult(1, (0, 1, 2), (2, 0, 1), 30, (1, 0, 0), (0, 0, 2)),
    GameResult(2, (2, 0), (0, 0), 10, (4, 8), (0, 16)),
    GameResult(3, (1, 0), (0, 1), 5, (0, 2), (32, 0)),
]
NAMES = ["a", "b", "c", "new"]


def test_the_table_is_counted_by_hand_strongest_first():
    table = table_of(NAMES, GAMES, planned=7)
    assert [line.name for line in table.standings] == ["b", "new", "c", "a"]
    lines = {line.name: line for line in table.standings}
    counted = {name: (one.games, one.wins, one.timeouts, one.crashes) for name, one in lines.items()}
    assert counted == {"a": (3, 0, 11, 16), "b": (2, 2, 0, 32), "c": (2, 0, 4, 2), "new": (0, 0, 0, 0)}
    results = [Result(game.players, game.places) for game in GAMES]
    assert [lines[name].rating for name in NAMES] == rate(4, results)
    assert (lines["b"].win_rate_low, lines["b"].win_rate_high) == wilson(2, 2)
    assert (table.games, table.turns, table.games_planned) == (3, 45, 7)
    told = json.loads(json.dumps(table.to_dict()))
    assert told["head_to_head"]["a"] == {
        "b": {"won": 0, "drawn": 0, "lost": 2}, "c": {"won": 0, "drawn": 1, "lost": 1}
    }  # fmt: skip
    assert told["head_to_head"]["new"] == {}
    assert str(table.head_to_head["b"]["a"]) == "2-0-0"


@pytest.mark.parametrize(
    ("places", "winner"), [((0, 1, 2), 4), ((1, 0, 1), 6), ((0, 0, 2), None), ((0, 0, 0), None), ((2, 1, 0), 5)]
)
def test_a_winner_is_who_stands_alone_in_front(places, winner):
    game = GameResult(1, (4, 6, 5), places, 9, (0,) * 3, (0,) * 3)
    assert game.winner == winner
    assert game.result == Result((4, 6, 5), places)
