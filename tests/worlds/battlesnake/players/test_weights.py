"""What counts how much where search stops looking: in duels, among several, and by a file of one's own."""

import pytest
from tests.worlds.battlesnake.players.test_search_guided import mirrored_board

from racecraft.worlds.battlesnake.env.board import Snake
from racecraft.worlds.battlesnake.env.settings import GameSettings
from racecraft.worlds.battlesnake.players import search
from racecraft.worlds.battlesnake.players.kernels.position import LENGTH_WEIGHT, MEAL_WEIGHT, SQUARES_WEIGHT
from racecraft.worlds.battlesnake.players.mcts import Tree
from racecraft.worlds.battlesnake.players.search import Search
from racecraft.worlds.battlesnake.players.weights import AMONG_SEVERAL, DEFAULT_WEIGHTS, Weights, default_weights

OWN = Weights(squares=0.1, length=0.2, meal=0.7)


def board_of(snakes):
    board = mirrored_board()
    board.snakes.extend([Snake("c", [(6, 3), (6, 2), (6, 1)]), Snake("d", [(0, 3), (0, 2), (0, 1)])][: snakes - 2])
    return board


def counted(tree):
    """Return what squares, lengths and the next meal count in a tree's leaves, in parts of 10,000."""
    return tuple(int(tree.position.rules[place]) for place in (SQUARES_WEIGHT, LENGTH_WEIGHT, MEAL_WEIGHT))


@pytest.mark.parametrize(
    ("snakes", "shares"), [(2, (6000, 2000, 2000)), (3, (4000, 4000, 2000)), (4, (4000, 4000, 2000))]
)
def test_among_several_lengths_count_as_much_as_squares(snakes, shares):
    tree = Tree(board_of(snakes), GameSettings(7, 7, snakes), "a")
    assert counted(tree) == shares
    assert default_weights(snakes) is (DEFAULT_WEIGHTS if snakes == 2 else AMONG_SEVERAL)
    assert counted(Tree(board_of(snakes), GameSettings(7, 7, snakes), "a", OWN)) == (1000, 2000, 7000)


def test_who_is_out_does_not_count_among_the_snakes():
    board = board_of(3)
    board.snakes[2].cause = "wall-collision"
    assert counted(Tree(board, GameSettings(7, 7, 3), "a")) == (6000, 2000, 2000)


@pytest.mark.parametrize(("weights", "shares"), [(None, (4000, 4000, 2000)), (OWN, (1000, 2000, 7000))])
def test_search_appraises_by_the_weights_it_was_given_or_by_what_serves_best(monkeypatch, weights, shares):
    grown = []

    class Kept(Tree):
        def __init__(self, *asked, **more):
            super().__init__(*asked, **more)
            grown.append(self)

    monkeypatch.setattr(search, "Tree", Kept)
    Search(most_walks=20, weights=weights).choose(board_of(4), GameSettings(7, 7, 4), "a", 5.0)
    assert [counted(tree) for tree in grown] == [shares]
