"""Search on top of whoever weighs moves: it believes, but not blindly."""

import numpy as np
import pytest

from racecraft.worlds.battlesnake.env.board import MOVES, Board, Snake
from racecraft.worlds.battlesnake.env.settings import GameSettings, SnakeConfig
from racecraft.worlds.battlesnake.players.mcts import WEIGHER_SHARE, Tree
from racecraft.worlds.battlesnake.players.protocol import MovePrior
from racecraft.worlds.battlesnake.players.search import Search
from racecraft.worlds.battlesnake.players.trained import TrainedSnake

SETTINGS = GameSettings(7, 7, 2)
UP, DOWN, LEFT, RIGHT = range(4)


class Sure:
    """Weighs one move alone, for everybody."""

    def __init__(self, way):
        self.way = way

    def move_priors(self, board, settings):
        chances = np.zeros((len(board.alive()), 4), np.float32)
        chances[:, self.way] = 1.0
        return chances

    def choose(self, board, settings, snake_id, seconds):
        raise AssertionError("a guide that weighs is not asked for its move")


def open_board():
    snakes = [Snake("a", [(3, 3), (3, 2), (3, 1)]), Snake("b", [(5, 5), (5, 6), (4, 6)])]
    return Board(7, 7, 4, snakes, [(0, 0)])


def test_chances_are_mixed_with_what_is_safe():
    tree = Tree(open_board(), SETTINGS, "a")
    tree.mix_priors(Sure(LEFT).move_priors(open_board(), SETTINGS))
    rest = (1 - WEIGHER_SHARE) / 3
    assert tree.priors()[0] == pytest.approx([rest, 0.0, WEIGHER_SHARE + rest, rest]), "down is its own neck"
    assert tree.priors().sum(axis=1) == pytest.approx([1.0, 1.0])


def test_a_guide_who_believes_in_the_fatal_is_not_heard():
    tree = Tree(open_board(), SETTINGS, "a")
    tree.mix_priors(Sure(DOWN).move_priors(open_board(), SETTINGS))
    assert tree.priors()[0] == pytest.approx([1 / 3, 0.0, 1 / 3, 1 / 3])


@pytest.mark.parametrize("way", [UP, LEFT, RIGHT])
def test_the_first_walks_follow_the_guide(way):
    guide = Sure(way)
    assert isinstance(guide, MovePrior)
    search = Search(most_walks=3, guide=guide, sure_among=0)
    assert search.choose(open_board(), SETTINGS, "a", 5.0) == MOVES[way]


def mirrored_board():
    """Either way is as good as the other: a must turn left or right, and b stands in the middle, too."""
    return Board(7, 7, 4, [Snake("a", [(3, 6), (3, 5), (3, 4)]), Snake("b", [(3, 0), (3, 1), (3, 2)])], [])


@pytest.mark.parametrize("effort", [1, 300])
@pytest.mark.parametrize("way", [LEFT, RIGHT])
def test_in_a_duel_the_guide_decides_between_equals(way, effort):
    assert Search(most_walks=effort, guide=Sure(way)).choose(mirrored_board(), SETTINGS, "a", 5.0) == MOVES[way]


class Says:
    """A player that weighs nothing."""

    def __init__(self, move):
        self.move = move

    def choose(self, board, settings, snake_id, seconds):
        assert seconds == 2.0, "a quarter of the time"
        if self.move is None:
            raise TimeoutError
        return self.move


@pytest.mark.parametrize(("said", "move"), [("left", {"left"}), ("right", {"right"}), ("nowhere", {"left", "right"})])
def test_in_a_duel_a_player_is_asked_for_its_move(said, move):
    """What is no safe move is not heard, nor who comes too late."""
    for guide in (Says(said), Says(None)):
        chosen = Search(most_walks=1, guide=guide).choose(mirrored_board(), SETTINGS, "a", 8.0)
        assert chosen in (move if guide.move else {"left", "right"})


def test_a_bad_guide_is_overruled_by_many_walks():
    # To the left lies a pocket of three squares that opens in eight turns; to the right half the board.
    body = [(1, 0), (1, 1), (1, 2), (1, 3), (0, 3), (0, 4), (1, 4), (2, 4), (3, 4), (4, 4), (5, 4), (6, 4)]
    board = Board(7, 7, 9, [Snake("a", body), Snake("b", [(3, 6), (4, 6), (5, 6)])], [])
    search = Search(most_walks=1000, guide=Sure(LEFT), sure_among=0)
    assert search.choose(board, SETTINGS, "a", 30.0) == "right"


class Duellist(Sure):
    """Has never met more than one other."""

    def move_priors(self, board, settings):
        return super().move_priors(board, settings) if len(board.alive()) <= 2 else None


@pytest.mark.parametrize("way", [LEFT, RIGHT])
def test_a_guide_is_heard_from_when_on_it_knows_such_boards(way):
    three = mirrored_board()
    three.snakes.append(Snake("c", [(6, 3), (6, 2), (6, 1)]))
    first_walks = {guide: Search(most_walks=3, guide=guide) for guide in (None, Sure(way), Duellist(way))}
    alone, believing, silent = (
        search.choose(three, GameSettings(7, 7, 3), "b", 5.0) for search in first_walks.values()
    )
    assert believing == MOVES[way]
    assert silent == alone
    assert Search(most_walks=1, guide=Duellist(way)).choose(mirrored_board(), SETTINGS, "b", 5.0) == MOVES[way]


def test_a_trained_snake_is_no_guide_among_more_than_it_was_trained_among():
    class Even:
        def probabilities(self, seen, mask):
            return np.full((len(mask), 4), 0.25, np.float32)

    weighed = {
        most: TrainedSnake(Even(), SnakeConfig(), most_snakes=most).move_priors(open_board(), SETTINGS)
        for most in (1, 2, None)
    }
    assert weighed[1] is None
    assert weighed[2].shape == weighed[None].shape == (2, 4)
