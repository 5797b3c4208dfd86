"""A network in the leaves of search: it sees what training saw, is believed, and every walk is accounted for."""

import numpy as np
import pytest

from racecraft.worlds.battlesnake.env.board import MOVES, Board, Snake
from racecraft.worlds.battlesnake.env.observation import observe_board
from racecraft.worlds.battlesnake.env.settings import GameSettings, SnakeConfig
from racecraft.worlds.battlesnake.players import network_tree
from racecraft.worlds.battlesnake.players.batched_mcts import BatchedMcts
from racecraft.worlds.battlesnake.players.find import find_player
from racecraft.worlds.battlesnake.players.kernels.leaves import select_leaves
from racecraft.worlds.battlesnake.players.kernels.position import advance
from racecraft.worlds.battlesnake.players.network_tree import Leaves, Network, NetworkTree
from racecraft.worlds.battlesnake.players.protocol import PlayerError
from racecraft.worlds.battlesnake.players.search import Search
from racecraft.worlds.battlesnake.players.search_position import board_at

UP, DOWN, LEFT, RIGHT = range(4)
DUEL = GameSettings(7, 7, 2)


class Sure:
    """A policy that thinks one move likely for everybody, and everybody as well off; it keeps what it was shown."""

    def __init__(self, way=None, value=0.0):
        self.way, self.value, self.shown, self.asked = way, value, [], 0

    def evaluate(self, observations, action_mask=None):
        self.shown.append({name: array.copy() for name, array in observations.items()} | {"mask": action_mask.copy()})
        rows = len(action_mask)
        self.asked += rows
        chances = np.full((rows, 4), 0.25 if self.way is None else 0.0, np.float32)
        if self.way is not None:
            chances[:, self.way] = 1.0
        return chances, np.full(rows, self.value, np.float32)


def open_board():
    snakes = [Snake("a", [(3, 3), (3, 2), (3, 1)]), Snake("b", [(5, 5), (5, 6), (4, 6)])]
    return Board(7, 7, 4, snakes, [(0, 0), (3, 4)])


def crowd():
    snakes = [
        Snake("a", [(1, 1), (1, 2), (1, 3)]), Snake("b", [(5, 5), (5, 6), (4, 6), (4, 6)], 60),
        Snake("c", [(1, 5), (0, 5), (0, 4)]), Snake("d", [(5, 1), (6, 1), (6, 2)], 30),
    ]  # fmt: skip
    return Board(7, 7, 9, snakes, [(3, 3)], {(2, 1): 1, (2, 2): 1})


@pytest.mark.parametrize(("make", "ruleset"), [(open_board, "standard"), (crowd, "royale"), (crowd, "wrapped")])
@pytest.mark.parametrize("outlook", [True, False])
def test_the_network_sees_a_leaf_as_training_would_show_it(make, ruleset, outlook):
    """The tree walks to positions; each is rebuilt as a board and looked at through the one function of training."""
    board = make()
    settings = GameSettings(7, 7, len(board.snakes), ruleset)
    policy = Sure()
    tree = NetworkTree(board, settings, "a", Network(policy, SnakeConfig(view=9, outlook=outlook)))
    tree.simulate(40)
    first_asked = sum(len(shown["mask"]) for shown in policy.shown)
    assert first_asked > 20
    leaves = Leaves(Network(policy, SnakeConfig(view=9, outlook=outlook)), settings, len(board.snakes), 8)
    fresh = NetworkTree(board, settings, "a", Network(policy, SnakeConfig(view=9, outlook=outlook)))
    policy.shown.clear()
    count, _ = select_leaves(
        8, 0, 0.7, 0, 8, *fresh.position, *fresh._room, fresh._ways, *fresh._nodes, fresh._size,
        *leaves.found, *leaves.games,
    )  # fmt: skip
    assert count > 1
    leaves.evaluate(np.arange(8) < count)
    (shown,) = policy.shown
    row = 0
    _, _, tracks, _ = leaves.found
    for leaf in range(count):
        plies = leaves.found[0][leaf, 1]
        for d in range(plies):
            fresh._ways[d] = np.maximum(tracks[leaf, d], 0)
            advance(d, fresh._ways, *fresh.position[:4], fresh.position.rules)
        there = board_at(fresh.position, int(plies), board)
        for snake in there.snakes:
            seen, mask = observe_board(there, settings, snake.id, 9, outlook)
            assert all(np.array_equal(shown[name][row], seen[name]) for name in seen), f"leaf {leaf}, {snake.id}"
            assert np.array_equal(shown["mask"][row], mask)
            row += 1
    assert row == len(shown["mask"]), "one row for every living snake, and none for the dead"


def test_every_walk_is_counted_once_and_no_answer_is_outstanding():
    tree = NetworkTree(open_board(), DUEL, "a", Network(Sure(value=0.3), SnakeConfig(view=5)))
    for asked in (1, 7, 64, 200):
        before = int(tree.visits().sum())
        tree.simulate(asked)
        assert int(tree.visits().sum()) - before == asked, "what was taken back is walked again"
    links, _, visits, sums, _, worths = tree._nodes
    assert (links[: tree.size, 2] != 2).all(), "nobody waits for an answer"
    assert (sums[: tree.size] >= 0).all()
    assert (sums[: tree.size] <= visits[: tree.size] + 1e-9).all()
    mean = sums[0].sum() / visits[0].sum()
    opinions = worths[: tree.size].mean()
    assert abs(mean - opinions) < 0.2, "virtual losses were made good: else the mean would lie far below the opinions"


def test_the_policy_says_where_to_look_and_what_is_fatal_stays_out():
    tree = NetworkTree(open_board(), DUEL, "a", Network(Sure(LEFT), SnakeConfig(view=5)))
    believed, rest = network_tree.PRIOR_SHARE, (1 - network_tree.PRIOR_SHARE) / 3
    assert tree.priors()[0] == pytest.approx([rest, 0.0, believed + rest, rest])
    tree.simulate(12)
    assert int(np.argmax(tree.visits())) == LEFT
    fatal = NetworkTree(open_board(), DUEL, "a", Network(Sure(DOWN), SnakeConfig(view=5)))
    assert fatal.priors()[0] == pytest.approx([1 / 3, 0.0, 1 / 3, 1 / 3]), "a policy that knows only death is not heard"


def test_the_critic_counts_as_its_share_says(monkeypatch):
    monkeypatch.setattr(network_tree, "NETWORK_SHARE", 1.0)
    for value, worth in ((0.5, 0.75), (-0.5, 0.25), (3.0, 0.98), (-3.0, 0.02)):
        tree = NetworkTree(open_board(), DUEL, "a", Network(Sure(value=value), SnakeConfig(view=5)))
        assert tree._nodes[5][0] == pytest.approx([worth, worth])


def test_a_full_tree_ends_the_walk(monkeypatch):
    monkeypatch.setattr("racecraft.worlds.battlesnake.players.mcts.MAX_NODES", 64)
    monkeypatch.setattr("racecraft.worlds.battlesnake.players.mcts.FIRST_NODES", 32)
    tree = NetworkTree(open_board(), DUEL, "a", Network(Sure(), SnakeConfig(view=5)))
    tree.simulate(5000)
    assert tree.size == 64


def cornered():
    """The other has one way left, into a pocket without a way out, and is gone in a few turns."""
    mine = [(1, 1), (2, 1), (3, 1), (4, 1), (4, 0)]
    return Board(7, 7, 30, [Snake("a", mine), Snake("b", [(1, 0), (2, 0), (3, 0)])], [])


def test_a_proven_win_needs_no_network():
    policy = Sure(UP, value=-1.0)
    move = Search(most_walks=64, network=Network(policy, SnakeConfig(view=5))).choose(cornered(), DUEL, "a", 30.0)
    assert move in ("left", "up"), "either shuts the other in"
    assert policy.asked == 0


def test_a_network_that_loves_its_end_is_not_followed_there():
    # To the left a pocket of one square: proven to lose within two turns, whatever the policy thinks.
    body = [(1, 0), (1, 1), (0, 1), (0, 2), (1, 2), (2, 2), (2, 3)]
    board = Board(7, 7, 9, [Snake("a", body), Snake("b", [(5, 5), (5, 6), (4, 6)])], [])
    found = Search(most_walks=32, network=Network(Sure(LEFT, value=1.0), SnakeConfig(view=5)))
    assert found.choose(board, DUEL, "a", 30.0) == "right"


def test_the_same_walks_find_the_same_move():
    network = Network(Sure(), SnakeConfig(view=5))
    moves = {Search(most_walks=100, network=network).choose(crowd(), GameSettings(7, 7, 4), "a", 30.0) for _ in "12"}
    assert len(moves) == 1
    assert moves <= set(MOVES)


def test_a_forest_searches_each_game_as_if_alone():
    boards, settings = [open_board(), crowd(), cornered(), open_board()], GameSettings(7, 7, 4)
    forest = BatchedMcts(Network(Sure(RIGHT), SnakeConfig(view=5)), settings, 40, 0.25)
    dice = lambda: [np.random.default_rng(number) for number in range(4)]  # noqa: E731
    together = forest.search(boards, dice())
    assert [visits.shape for visits in together] == [(2, 4), (4, 4), (2, 4), (2, 4)]
    assert all((visits.sum(axis=1) == 40).all() for visits in together), "every walk counts once for each"
    for number, board in enumerate(boards):
        alone = BatchedMcts(Network(Sure(RIGHT), SnakeConfig(view=5)), settings, 40, 0.25)
        assert np.array_equal(alone.search([board], [dice()[number]])[0], together[number])
    assert (together[0][0] != together[3][0]).any(), "other dice, other walks"
    still = BatchedMcts(Network(Sure(RIGHT), SnakeConfig(view=5)), settings, 40, 0.0)
    assert np.array_equal(*(still.search([open_board()], [np.random.default_rng(seed)])[0] for seed in (1, 2)))


def test_search_on_a_folder_that_is_none_is_refused():
    with pytest.raises(PlayerError, match="search:runs/absent: no such folder; expected the RUN"):
        find_player("search:runs/absent")
