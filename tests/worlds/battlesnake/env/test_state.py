"""Games as arrays: a position goes in and comes out the same, and what cannot be told in them is refused."""

from collections import Counter

import numpy as np
import pytest

from racecraft.worlds.battlesnake.env.board import CAUSES, Board, BoardError, Snake
from racecraft.worlds.battlesnake.env.dice import LoadedDice
from racecraft.worlds.battlesnake.env.hazard_plans import Plan
from racecraft.worlds.battlesnake.env.kernels import columns as col
from racecraft.worlds.battlesnake.env.maps import MAPS, MapState
from racecraft.worlds.battlesnake.env.settings import GameSettings
from racecraft.worlds.battlesnake.env.state import allocate_games, get_board, put_board

NEVER = 2**31 - 1


def crowded():
    """A board of 5 x 4 with everything on it."""
    snakes = [
        Snake("s0", [(1, 2), (1, 1), (0, 1), (0, 1)], 63),
        Snake("s1", [(5, 3), (4, 3), (4, 2)], 0, "wall-collision", "", 8),
        Snake("s2", [(3, 1), (3, 0)], 100),
        Snake("s3", [(1, 2), (2, 2), (2, 3)], 12, "head-collision", "s0", 9),
    ]
    hazards = Counter({(4, 0): 3, (0, 0): 1, (2, 4): 5, (4, 7): 2})
    return Board(5, 4, 9, snakes, [(4, 1), (0, 2), (2, 3)], hazards)


def test_a_position_comes_out_as_it_went_in_and_leaves_its_neighbours_alone():
    settings, board = GameSettings(5, 4, 4), crowded()
    games = allocate_games(settings, 3)
    before = {name: array.copy() for name, array in games.arrays().items()}
    put_board(games, 1, board)
    assert get_board(games, 1, settings) == board, "the dead, notes above the board and stacked hazards, too"
    for name, array in games.arrays().items():
        np.testing.assert_array_equal(array[[0, 2]], before[name][[0, 2]])
    assert games.games[1].tolist() == [9, 3, 0, 2], "turn, food, the plan's next row, snakes alive"
    assert games.cells[1, col.OWNER].reshape(4, 5).tolist() == [
        [0, 0, 0, 3, 0],
        [1, 1, 0, 3, 0],
        [0, 1, 0, 0, 0],
        [0, 0, 0, 0, 0],
    ]
    assert games.cells[1, col.MEAL].max() == 1
    assert games.snakes[1, :, col.BY].tolist() == [-1, -1, -1, 0]
    assert games.snakes[1, :, col.CAUSE].tolist() == [0, CAUSES.index("wall-collision"), 0, 5]
    put_board(games, 1, Board(5, 4, snakes=[Snake("s0", [(0, 0), (0, 1)])]))
    assert get_board(games, 1, settings).snakes[0] == Snake("s0", [(0, 0), (0, 1)])
    assert not games.cells[1, 1:].any(), "nothing is left of the position before"


def test_a_seat_where_nobody_sits_is_dead_of_hunger_and_names_are_the_callers():
    settings = GameSettings(5, 4, 6)
    games = allocate_games(settings, 1)
    put_board(games, 0, crowded())
    named = get_board(games, 0, settings, ["a", "b", "c", "d", "e"])
    assert [snake.id for snake in named.snakes] == list("abcde")
    assert named.snakes[3].by == "a"
    assert (named.snakes[4].cause, named.snakes[4].by) == ("out-of-health", "")
    assert named.snakes[4].alive is False
    assert len(get_board(games, 0, settings).snakes) == 6


def test_changes_off_the_board_are_left_out_of_a_plan_and_sides_are_kept_in_order():
    settings = GameSettings(5, 4, 1, map="hz_spiral")
    games = allocate_games(settings, 1)
    games.sides[:] = 9
    games.events[:] = 3
    plan = Plan(changes=[(2, (4, 3), 1), (5, (5, 3), 1), (8, (0, 4), 1), (11, (1, 0), -2)])
    put_board(games, 0, Board(5, 4, snakes=[Snake("s0", [(0, 0)] * 3)]), MapState(plan, [3, 0, 1]))
    assert games.events[0, :3].tolist() == [[2, 19, 1], [11, 1, -2], [NEVER] * 3]
    assert games.sides[0].tolist() == [3, 0, 1, 0, 0, 0, 0, 0, 0]
    bare = MAPS["empty"].plan(settings, LoadedDice())
    put_board(games, 0, Board(5, 4, snakes=[Snake("s0", [(0, 0)] * 3)]), MapState(bare, []))
    assert (games.events == NEVER).all()
    assert not games.sides.any()


THREE = [Snake(str(number), [(number, 0), (number, 1)]) for number in range(3)]


@pytest.mark.parametrize(
    ("board", "letter"),
    [
        (Board(3, 3, snakes=THREE), "3 snakes on the board; expected at most 2"),
        (Board(3, 3, snakes=[Snake("a", [(0, 0)])]), "snake a has 1 segments; expected 2 to 16"),
        (Board(3, 3, snakes=[Snake("a", [(0, 0)] * 17)]), "snake a has 17 segments; expected 2 to 16"),
        (Board(3, 3, snakes=[Snake("a", [(0, 0), (-1, 0)])]), r"snake a at \(-1, 0\): off the board"),
        (Board(3, 3, snakes=[Snake("a", [(0, 0), (0, 1)]), Snake("b", [(1, 1), (0, 1)])]), r"snake b at \(0, 1\)"),
        (Board(3, 3, food=[(0, 3)]), r"food at \(0, 3\); expected squares of a 3x3 board"),
    ],
)  # fmt: skip
def test_what_cannot_be_told_is_refused(board, letter):
    with pytest.raises(BoardError, match=letter):
        put_board(allocate_games(GameSettings(3, 3, 2), 1), 0, board)


def test_a_body_may_fill_its_ring_and_the_dead_may_lie_anywhere():
    settings = GameSettings(3, 3, 2)
    games = allocate_games(settings, 1)
    full = Snake("s0", [(0, 0)] * 16, 5)
    put_board(games, 0, Board(3, 3, snakes=[full, Snake("s1", [(0, 0), (0, -1)], 0, "hazard", "", 4)]))
    assert get_board(games, 0, settings).snakes[0] == full
    assert games.bodies[0, 1, :2].tolist() == [0, -1]
