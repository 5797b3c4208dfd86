"""What a snake is promised to see: windows, walls and squares by hand; what is painted is held beside it."""

import numpy as np
import pytest

from racecraft.worlds.battlesnake.env.board import Board, BoardError, Snake
from racecraft.worlds.battlesnake.env.observation import observation_specs, observe_board, wall_planes
from racecraft.worlds.battlesnake.env.settings import GameSettings


@pytest.mark.parametrize("view", [-3, 1, 2, 4, 20])
def test_a_window_without_a_middle_or_with_nothing_about_it_is_refused(view):
    with pytest.raises(BoardError, match=f"view is {view}; expected an odd number of squares, at least 3"):
        observation_specs(view)


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
