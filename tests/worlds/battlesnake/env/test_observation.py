"""What a snake is promised to see: windows, walls and squares by hand; what is painted is held beside it."""

import numpy as np
import pytest

from racecraft.worlds.battlesnake.env.board import Board, BoardError, Snake
from racecraft.worlds.battlesnake.env.observation import (
    PLANES,
    default_view,
    observation_specs,
    observe_board,
    squares_of,
    wall_planes,
)
from racecraft.worlds.battlesnake.env.settings import GameSettings


@pytest.mark.parametrize(("width", "height", "view"), [(3, 3, 5), (7, 5, 13), (5, 7, 13), (11, 11, 21), (12, 3, 21)])
def test_a_window_holds_the_board_from_anywhere_but_at_most_21_squares(width, height, view):
    assert default_view(width, height) == view


@pytest.mark.parametrize("view", [-3, 1, 2, 4, 20])
def test_a_window_without_a_middle_or_with_nothing_about_it_is_refused(view):
    with pytest.raises(BoardError, match=f"view is {view}; expected an odd number of squares, at least 3"):
        observation_specs(view)


def test_a_snake_sees_eight_planes_and_six_numbers_and_where_asked_the_outlook():
    told = {name: (one.shape, one.dtype, one.low, one.high) for name, one in observation_specs(3, outlook=True).items()}
    assert told == {
        "planes": ((8, 3, 3), np.uint8, 0, 255),
        "numbers": ((6,), np.float32, -1, 1),
        "outlook": ((4, 10), np.float32, -1, 1),
    }
    assert list(observation_specs(3)) == ["planes", "numbers"]
    assert len(PLANES) == 8


def test_walls_lie_where_the_board_does_not_with_the_upper_row_first():
    """Three squares by two, from each: the head stands in the middle of a window of three."""
    walls = wall_planes(3, 2, 3)
    assert (walls.shape, walls.dtype) == ((6, 9), np.uint8)
    W, _ = 255, 0  # wall, open
    assert walls.reshape(6, 3, 3).tolist() == [
        [[W, _, _], [W, _, _], [W, W, W]],
        [[_, _, _], [_, _, _], [W, W, W]],
        [[_, _, W], [_, _, W], [W, W, W]],
        [[W, W, W], [W, _, _], [W, _, _]],
        [[W, W, W], [_, _, _], [_, _, _]],
        [[W, W, W], [_, _, W], [_, _, W]],
    ]
    far = wall_planes(3, 2, 5).reshape(6, 5, 5)
    assert (far[:, 1:4, 1:4].reshape(6, 9) == walls).all()
    assert (far[0] == 0).sum() == 6, "the whole board is in sight"


def test_squares_are_told_by_cells():
    squares = squares_of(GameSettings(3, 4, 1))
    assert squares.dtype == np.int16
    assert squares.tolist() == [[x, y] for y in range(4) for x in range(3)]


@pytest.mark.parametrize(
    ("body", "allowed"),
    [
        ([(0, 0), (0, 1), (1, 1), (1, 2)], [False, False, False, True]),
        ([(0, 0), (1, 0), (1, 1), (0, 1), (0, 2)], [True, True, True, True]),
        ([(0, 0), (1, 0), (1, 1), (0, 1)], [True, False, False, False]),
    ],
)
def test_one_way_out_is_the_only_one_and_without_any_all_are_alike(body, allowed):
    """In the corner: a gap to the right; a body all round; a tail that moves on."""
    _, mask = observe_board(Board(7, 7, 9, [Snake("me", body)], []), GameSettings(7, 7, 1), "me")
    assert mask.tolist() == allowed


def test_one_alone_sees_itself_in_the_middle_and_numbers_of_its_own():
    """Health 50 of 100, 4 squares of 49, nobody to be longer than, one food of 16, hazards of 14 health."""
    board = Board(7, 7, 3, [Snake("me", [(3, 3), (3, 2), (3, 1), (2, 1)], 50)], [(3, 4)])
    seen, mask = observe_board(board, GameSettings(7, 7, 1), "me")
    np.testing.assert_allclose(seen["numbers"], [0.5, 4 / 49, 1.0, 0.0, 1 / 16, 0.14], rtol=1e-6)
    assert seen["planes"].shape == (8, 13, 13)
    assert "outlook" not in seen
    assert mask.tolist() == [True, False, True, True]
    own, food = seen["planes"][0], seen["planes"][5]
    assert [own[6, 6], own[7, 6], own[8, 6], own[8, 5]] == [32, 24, 16, 8], "8 for each turn until it clears"
    assert (own > 0).sum() == 4
    assert np.argwhere(food).tolist() == [[5, 6]]
    assert food.max() == 255
    narrow, _ = observe_board(board, GameSettings(7, 7, 1), "me", view=3)
    np.testing.assert_array_equal(narrow["planes"], seen["planes"][:, 5:8, 5:8])


@pytest.mark.parametrize(
    ("board", "who", "letter"),
    [
        (Board(7, 9, snakes=[Snake("a", [(1, 1), (1, 2)])]), "a", "the board is 7x9; expected 7x7"),
        (Board(9, 7, snakes=[Snake("a", [(1, 1), (1, 2)])]), "a", "the board is 9x7; expected 7x7"),
        (Board(7, 7), "a", "no snake 'a' on the board; there are none"),
        (Board(7, 7, snakes=[Snake("b", [(1, 1)]), Snake("c", [(2, 1)])]), "a", "there are b, c"),
    ],
)
def test_who_is_not_there_sees_nothing(board, who, letter):
    with pytest.raises(BoardError, match=letter):
        observe_board(board, GameSettings(7, 7, 2), who)
