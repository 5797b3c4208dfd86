"""Games as arrays: a position goes in and comes out the same, and what cannot be told in them is refused."""

from collections import Counter

import numpy as np
import pytest

from racecraft.worlds.battlesnake.env.board import CAUSES, Board, BoardError, Snake
from racecraft.worlds.battlesnake.env.dice import LoadedDice, StreamDice
from racecraft.worlds.battlesnake.env.hazard_plans import Plan
from racecraft.worlds.battlesnake.env.kernels import columns as col
from racecraft.worlds.battlesnake.env.maps import MAPS, MapState, set_up
from racecraft.worlds.battlesnake.env.rulesets import RULESETS
from racecraft.worlds.battlesnake.env.settings import GameSettings
from racecraft.worlds.battlesnake.env.state import allocate_games, food_squares_of, get_board, params_of, put_board

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


def test_a_body_is_read_round_the_end_of_its_ring():
    settings = GameSettings(3, 3, 1)
    games = allocate_games(settings, 1)
    put_board(games, 0, Board(3, 3, snakes=[Snake("s0", [(0, 0), (0, 1), (1, 1)])]))
    games.bodies[0, 0] = np.roll(games.bodies[0, 0], -1)
    games.snakes[0, 0, col.START] = 15
    assert get_board(games, 0, settings).snakes[0].body == [(0, 0), (0, 1), (1, 1)]


@pytest.mark.parametrize(("width", "height", "ring"), [(3, 3, 16), (3, 4, 16), (5, 5, 32), (11, 11, 128), (5, 25, 256)])
def test_rings_are_powers_of_two_with_room_for_a_body_that_fills_the_board(width, height, ring):
    games = allocate_games(GameSettings(width, height, 2), 3)
    shapes = {name: array.shape for name, array in games.arrays().items()}
    assert shapes == {
        "bodies": (3, 2, ring), "snakes": (3, 2, 10), "games": (3, 4), "cells": (3, 4, width * height),
        "sides": (3, width + height), "events": (3, 0, 3), "chance": (3, 2),
    }  # fmt: skip
    assert not games.chance.any()
    assert allocate_games(GameSettings(), 2, np.array([7, 9], np.uint64)).chance.tolist() == [[7, 0], [9, 0]]


def test_every_map_has_room_for_its_plan_and_rows_beyond_it_never_come():
    for name, row in MAPS.items():
        for width, height in row.sizes[:3] + row.sizes[-1:]:
            settings = GameSettings(width, height, 1, map=name)
            board, state = set_up(settings, StreamDice(5))
            games = allocate_games(settings, 1)
            put_board(games, 0, board, state)
            events, changes = games.events[0], state.plan.changes
            told = [
                (turn, (cell % width, cell // width), added) for turn, cell, added in events[: len(changes)].tolist()
            ]
            assert told == changes, name
            assert (events[len(changes) :] == NEVER).all()


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


def test_rules_are_told_to_kernels_by_their_stages():
    told = {name: params_of(GameSettings(ruleset=name))[[2, 3, 4, 5]].tolist() for name in RULESETS}
    assert told == {
        "standard": [0, 0, 0, 0],
        "solo": [0, 0, 0, 1],
        "royale": [0, 1, 0, 0],
        "constrictor": [0, 0, 1, 0],
        "wrapped": [1, 0, 0, 0],
        "wrapped_constrictor": [1, 0, 1, 0],
    }
    assert params_of(GameSettings(ruleset="solo", solo=False))[col.SOLO] == 0
    assert params_of(GameSettings(ruleset="royale", solo=True))[col.SOLO] == 1


@pytest.mark.parametrize(
    ("name", "food", "hazards", "most", "first_food"),
    [
        ("empty", 0, 0, 0, 0),
        ("standard", 1, 0, 0, 1),
        ("hz_islands_bridges", 2, 0, 0, 0),
        ("arcade_maze", 3, 0, 0, 0),
        ("hz_castle_wall", 4, 0, 2, 0),
        ("hz_castle_wall_xl", 4, 0, 4, 0),
        ("royale", 1, 1, 0, 1),
        ("snail_mode", 1, 2, 0, 1),
        ("solo_maze", 0, 3, 0, 0),
    ],
)
def test_maps_are_told_to_kernels_by_numbers(name, food, hazards, most, first_food):
    width, height = MAPS[name].sizes[0]
    words = {"food_spawn_chance": 33, "minimum_food": 5, "hazard_damage": -9, "shrink_every": 12}
    params = params_of(GameSettings(width, height, 1, map=name, **words))
    assert params.dtype == np.int32
    assert params.tolist() == [width, height, 0, 0, 0, 0, -9, 12, food, 33, 5, hazards, most, first_food, 0, 0]


def test_a_list_of_food_squares_is_told_by_cells():
    castle = food_squares_of(GameSettings(11, 11, 1, map="hz_castle_wall"))
    assert castle.dtype == np.int16
    assert castle.tolist() == [5 * 11 + 2, 2 * 11 + 5, 8 * 11 + 5, 5 * 11 + 8]
    assert food_squares_of(GameSettings(19, 21, 1, map="arcade_maze")).size == 12
    assert food_squares_of(GameSettings(map="hz_islands_bridges")).size == 0
    assert food_squares_of(GameSettings()).size == 0
