"""A position as a person would describe it: squares, where food may fall, and how it is drawn."""

from collections import Counter

from racecraft.worlds.battlesnake.env.board import Board, Snake, draw


def test_food_falls_on_no_food_no_body_not_beside_a_head_and_on_hazards_unless_they_are_spared():
    dead = Snake("b", [(0, 3), (1, 3)], cause="wall-collision")
    snake = Snake("a", [(1, 0), (0, 0), (0, 1)])
    board = Board(3, 4, 0, [snake, dead], [(2, 2)], Counter({(0, 2): 1, (1, 2): 2, (2, 3): 0}))
    free = [(2, 1), (0, 2), (1, 2), (0, 3), (1, 3), (2, 3)]
    assert board.free_squares() == board.free_squares(spare_hazards=False) == free
    assert board.free_squares(spare_hazards=True) == [(2, 1), (0, 3), (1, 3), (2, 3)], "no hazard is left on (2, 3)"


def test_a_copy_of_a_board_shares_nothing_with_it():
    board = Board(5, 6, 7, [Snake("a", [(1, 1)], 55, "hazard", "b", 7)], [(2, 2)], Counter({(3, 3): 4}))
    other = board.copy()
    assert other == board
    other.snakes[0].body.append((0, 1))
    other.food.append((4, 4))
    other.hazards[(3, 3)] += 1
    assert (board.snakes[0].body, board.food, board.hazards) == ([(1, 1)], [(2, 2)], Counter({(3, 3): 4}))


def test_living_snakes_lie_on_food_and_food_on_hazards_where_a_board_is_drawn():
    """Hazards beyond nine are drawn as nine, notes off the board and the dead not at all, a twenty-seventh as a."""
    snakes = [
        Snake("one", [(1, 2), (1, 1), (1, 1), (0, 1)]),
        Snake("two", [(4, 1), (4, 0), (5, 0)]),
        Snake("dead", [(2, 2), (3, 2)], cause="hazard"),
        *(Snake(str(number), [], cause="hazard") for number in range(22)),
        Snake("z", [(3, 0)]),
        Snake("27th", [(2, 0)]),
    ]
    hazards = Counter({(0, 0): 1, (0, 2): 9, (2, 1): 12, (3, 1): 0, (1, 1): 3, (3, 2): 2, (0, 5): 7, (-1, 0): 5})
    board = Board(5, 3, snakes=snakes, food=[(3, 2), (4, 0)], hazards=hazards)
    assert draw(board).splitlines() == ["9A.*.", "aa9.B", "1.AZb"]
