"""By hand: one maze, cut by cut; the notes of its level; and food that runs away."""

from collections import Counter

import pytest

from racecraft.worlds.battlesnake.env.board import Board, Snake
from racecraft.worlds.battlesnake.env.dice import LoadedDice
from racecraft.worlds.battlesnake.env.solo_maze import after_turn, build_level, level_of


def built(width, height, level, rolls=()):
    board = Board(width, height, snakes=[Snake("s0", [(0, 0)], 7)])
    build_level(board, level, LoadedDice(rolls))
    return board


def rows(board):
    """The board's hazards, the top row first."""
    return ["".join("#" if board.hazards[x, y] else "." for x in range(board.width)) for y in range(board.height)][::-1]


def test_a_maze_is_cut_in_two_with_a_gap_again_and_again():
    """Seven squares by seven in a frame of one: x and y from 1 to 7 on a board of 9 x 9.

    A square room asks the dice which way, others are cut across their longer side. Low dice cut as near to the lower or
    left edge as they may (one row is left), with the gap at the lower or left end. Here the first cut is told:
    downward at x = 5, the gap at y = 3. Left of it lie 4 x 7 squares, cut across at y = 2, the gap at x = 1; above that
    4 x 5: at y = 4, x = 1; above that 4 x 3: downward at x = 2, the gap at y = 5. Right of that 2 x 3: across at y = 6,
    x = 3. Right of x = 5 lie 2 x 7: across at y = 2, 4 and 6, each gap at x = 6.
    """
    assert rows(built(9, 9, 0, [1, 3, 2])) == [
        "#########",
        "#.#..#..#",
        "#.#.##.##",
        "#....#..#",
        "#.####.##",
        "#.......#",
        "#.####.##",
        "#....#..#",
        ".........",
    ]


def test_a_cut_leaves_at_least_one_row_or_column_on_its_far_side_too():
    """High dice: downward where they choose, as far to the right or above as may be, the gap at the upper or right end.

    x = 6, y = 6 left of it, then x = 4 below, y = 4 left of it and x = 2 below.
    """
    assert rows(built(9, 9, 0, [99] * 50)) == [
        "#########",
        "#.......#",
        "#####.#.#",
        "#.....#.#",
        "###.#.#.#",
        "#...#.#.#",
        "#.#.#.#.#",
        "#.#.#.#.#",
        ".........",
    ]


def test_a_later_wall_is_opened_where_it_would_shut_a_gap():
    """Two squares beside each gap are kept free.

    Downward at x = 5, gap y = 4: on its left y = 4 ends there and on its right, too; of the cut at y = 4 the gap is
    x = 2, above which the cut at x = 2 begins; that one's gap is y = 6, on whose right the last cut would be (3, 6).
    """
    left, right = [0, 0, 0, 1, 0, 1, 0, 1], [0, 1, 0, 1, 0, 1]
    assert rows(built(9, 9, 0, [1, 3, 3, *left, *right])) == [
        "#########",
        "#.#..#..#",
        "#....##.#",
        "#....#..#",
        "##.#....#",
        "#....#..#",
        "#.#####.#",
        "#....#..#",
        ".........",
    ]
    # Across at y = 6, gap x = 3; below it downward at x = 3, which would end there.
    assert rows(built(9, 9, 0, [0, 4, 2, 1])) == [
        "#########",
        "#.......#",
        "###.#####",
        "#....#..#",
        "#.##.#.##",
        "#..#....#",
        "#.##.####",
        "#.......#",
        ".........",
    ]


@pytest.mark.parametrize(
    ("width", "height", "level", "head", "side"),
    [
        (9, 9, 0, (1, 1), 7),
        (9, 12, 4, (0, 1), 9),
        (12, 9, 4, (2, 1), 7),
        (11, 11, 1, (1, 1), 8),
        (11, 11, 30, (1, 1), 9),
    ],
)
def test_a_level_is_as_wide_as_it_may_be_and_its_snake_longer_by_one_each(width, height, level, head, side):
    """Seven squares and one for each level, but two rows are left of the board's height."""
    board = built(width, height, level)
    snake = board.snakes[0]
    assert snake.body == [head, *[(head[0], head[1] - 1)] * (2 + level)]
    assert snake.health == 100
    free = {(x, y) for x, y in board.squares() if y and not board.hazards[x, y]}
    assert head in free
    assert max(x for x, _ in free) <= head[0] + side - 1
    assert max(y for _, y in free) <= head[1] + side - 1
    assert len(board.food) == 1
    assert board.food[0] in free - {head}


@pytest.mark.parametrize("level", [0, 1, 6, 0b1010_0000_0001, 0xFFFF])
def test_a_level_is_noted_in_the_bottom_row_from_the_right_in_binary_digits(level):
    board = built(19, 9, level)
    assert rows(board)[-1] == f"...{level:016b}".replace("0", ".").replace("1", "#")
    assert level_of(board) == level


def maze_with(level, food, **told):
    """An open board of 9 x 9 with a snake whose head is on (5, 3)."""
    notes = [(8 - bit, 0) for bit in range(4) if level >> bit & 1]
    snake = Snake("s0", [(5, 3), (5, 4), (5, 5)], **told)
    return Board(9, 9, 5, [snake], [food] if food else [], Counter([(0, 1), *notes]))


@pytest.mark.parametrize(
    ("level", "food", "runs"),
    [
        (5, (5, 7), True),
        (5, (7, 1), True),
        (5, (2, 2), True),
        (5, (8, 5), False),
        (5, (2, 3), True),
        (4, (5, 2), False),
        (6, (6, 3), True),
        (5, (1, 2), False),
    ],
)
def test_from_the_fifth_level_on_food_runs_from_a_head_within_four_squares(level, food, runs):
    """It comes to rest on the first free square above the bottom row that is no hazard: (0, 1) is one."""
    board = maze_with(level, food)
    after_turn(board, LoadedDice())
    assert board.food == [(1, 1) if runs else food]


def test_food_that_finds_no_place_stays():
    board = maze_with(5, (5, 2))
    board.hazards.update(point for point in board.squares() if point[1] > 0)
    after_turn(board, LoadedDice())
    assert board.food == [(5, 2)]


def test_an_eaten_food_brings_the_next_level_unless_its_snake_is_dead():
    board = maze_with(2, None)
    after_turn(board, LoadedDice())
    assert level_of(board) == 3
    assert len(board.snakes[0].body) == 6
    dead = maze_with(2, None, cause="hazard")
    after_turn(dead, LoadedDice())
    assert (level_of(dead), dead.food) == (2, [])
