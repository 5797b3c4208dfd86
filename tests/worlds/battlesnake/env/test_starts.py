"""By hand: where snakes begin and where the first food lies, with dice that fall as they are told."""

from collections import Counter

import pytest

from racecraft.worlds.battlesnake.env.board import Board, BoardError
from racecraft.worlds.battlesnake.env.dice import LoadedDice, StreamDice
from racecraft.worlds.battlesnake.env.layouts import Layout, layout
from racecraft.worlds.battlesnake.env.starts import (
    food_beside_heads,
    layout_heads,
    place_snakes,
    standard_food,
    standard_heads,
)

STAY = [3, 2, 1]
"""Rolls that leave four things in their order."""


def begun(width, height, heads):
    board = Board(width, height)
    place_snakes(board, heads)
    return board


@pytest.mark.parametrize(("side", "middle", "high"), [(7, 3, 5), (8, 3, 6), (11, 5, 9), (25, 12, 23)])
def test_up_to_eight_begin_in_the_corners_and_in_the_middle_of_the_sides(side, middle, high):
    corners = [(1, 1), (1, high), (high, 1), (high, high)]
    sides = [(1, middle), (middle, 1), (middle, high), (high, middle)]
    board = Board(side, side)
    assert standard_heads(board, 8, LoadedDice([*STAY, *STAY, 0])) == [*corners, *sides]
    assert standard_heads(board, 5, LoadedDice([*STAY, *STAY, 1])) == [*sides, corners[0]]
    turned = [*corners[1:], corners[0], *sides[1:], sides[0]]
    assert standard_heads(board, 8, LoadedDice()) == turned, "low dice turn four things round by one"


def test_more_than_eight_begin_in_turn_in_the_four_quarters():
    """On 11 squares 1 and 4 from each edge, on 19 squares 3 and 6, on 25 squares 4 and 8; a random quarter is first."""
    heads = standard_heads(Board(11, 11), 9, LoadedDice())
    assert heads == [(1, 1), (9, 1), (1, 9), (9, 9), (1, 4), (9, 4), (1, 6), (9, 6), (4, 1)]
    assert standard_heads(Board(11, 11), 9, LoadedDice([3]))[:4] == [(9, 9), (1, 1), (9, 1), (1, 9)]
    for side, (near, far) in {11: (1, 4), 19: (3, 6), 25: (4, 8)}.items():
        lines = {near, far, side - 1 - near, side - 1 - far}
        every = standard_heads(Board(side, side), 16, StreamDice(side))
        assert set(every) == {(x, y) for x in lines for y in lines}


@pytest.mark.parametrize(("width", "height", "players"), [(10, 10, 9), (11, 19, 3)])
def test_elsewhere_they_begin_on_squares_of_one_colour_in_the_order_drawn(width, height, players):
    board = Board(width, height)
    colour = [p for p in board.squares() if sum(p) % 2 == 0 and p != board.centre()]
    assert standard_heads(board, players, LoadedDice()) == colour[:players]


@pytest.mark.parametrize(
    ("width", "height", "players", "letter"),
    [
        (6, 6, 9, "9 snakes on 6x6; expected at most 8"),
        (3, 3, 5, "5 snakes on 3x3; there are 4 start squares"),
    ],
)
def test_who_finds_no_place_is_refused(width, height, players, letter):
    with pytest.raises(BoardError, match=letter):
        standard_heads(Board(width, height), players, LoadedDice())


def test_a_drawn_map_deals_out_the_first_row_of_squares_that_holds_all_and_then_those_beyond():
    """The arcade's maze: four corners, then two in the middle in their order. The castle: four, or eight of its own."""
    maze = layout("arcade_maze")
    four = [(4, 7), (4, 17), (14, 7), (14, 17)]
    assert layout_heads(maze, 4, LoadedDice(STAY)) == four
    assert layout_heads(maze, 6, LoadedDice(STAY)) == [*four, (9, 9), (9, 13)]
    assert layout_heads(maze, 5, LoadedDice()) == [*four[1:], four[0], (9, 9)]
    castle = layout("hz_castle_wall")
    assert layout_heads(castle, 4, LoadedDice(STAY)) == [(1, 1), (1, 9), (9, 1), (9, 9)]
    assert (1, 5) in layout_heads(castle, 5, LoadedDice([7, 6, 5, 4, *STAY]))


def test_a_drawn_map_with_quarters_deals_them_out_in_turn():
    drawn = Layout(9, 9, (), quadrants=(((0, 0), (1, 1)), ((8, 0), (7, 1)), ((0, 8), (1, 7))))
    assert layout_heads(drawn, 5, LoadedDice([1])) == [(8, 0), (0, 8), (0, 0), (7, 1), (1, 7)]
    assert layout_heads(drawn, 3, LoadedDice([2, 1, 1])) == [(1, 7), (1, 1), (8, 0)]


@pytest.mark.parametrize(
    ("side", "snakes", "beside"), [(7, 4, True), (7, 5, False), (10, 4, True), (10, 5, False), (11, 5, True)]
)
def test_the_first_food_lies_beside_every_snake_where_there_is_room_and_in_the_middle(side, snakes, beside):
    board = begun(side, side, standard_heads(Board(side, side), snakes, LoadedDice([*STAY, *STAY])))
    standard_food(board, LoadedDice())
    middle = ((side - 1) // 2, (side - 1) // 2)
    assert board.food[-1] == middle
    assert len(board.food) == 1 + snakes * beside
    if beside:
        assert board.food[0] == (0, 2), "the corner is spared, and farther out than (1, 1) it must be"


def test_no_food_lies_in_the_middle_where_a_snake_does():
    board = begun(11, 11, [(5, 5), (1, 1)])
    standard_food(board, LoadedDice())
    assert (5, 5) not in board.food
    assert len(board.food) == 2


@pytest.mark.parametrize(("width", "height"), [(7, 9), (3, 3)])
def test_on_other_boards_the_first_food_lies_anywhere_free_one_for_each_snake(width, height):
    board = begun(width, height, [(0, 0)] if width == 3 else [(0, 0), (2, 0)])
    free = board.free_squares()
    standard_food(board, LoadedDice())
    assert board.food == free[: len(board.snakes)]


def test_food_beside_a_head_is_diagonal_to_it_and_farther_out_on_one_axis_at_least():
    def places(*heads, hazards=(), spare=False, rolls=(0, 1, 2, 3)):
        found = []
        for roll in rolls:
            board = begun(11, 11, heads)
            board.hazards = Counter(hazards)
            food_beside_heads(board, LoadedDice([roll] * len(heads)), spare)
            found.append(tuple(board.food))
        return found

    assert places((1, 1)) == [((0, 2),), ((2, 0),), ((2, 0),), ((2, 0),)], "not the corner, not (2, 2) nearer in"
    assert places((9, 9), rolls=(0, 1)) == [((8, 10),), ((10, 8),)]
    assert places((1, 9), rolls=(0, 1)) == [((0, 8),), ((2, 10),)]
    assert places((9, 1), rolls=(0, 1)) == [((8, 0),), ((10, 2),)]
    assert places((5, 1), rolls=(0, 1, 2, 3)) == [((4, 0),), ((4, 2),), ((6, 0),), ((6, 2),)], "all are farther aside"
    assert places((5, 0), rolls=(0, 1)) == [((4, 1),), ((6, 1),)], "and the others off the board"
    assert places((1, 1), hazards=[(0, 2)]) == places((1, 1))
    assert places((1, 1), hazards=[(0, 2)], spare=True, rolls=(0,)) == [((2, 0),)]
    assert places((1, 1), (1, 1), (1, 1), rolls=(0,)) == [((0, 2), (2, 0))], "for the third there is no place left"
