"""A tree of what may happen: decoupled PUCT with area control at the leaves (`kernels/puct.py`).

Every walk goes down where a move has been good or has hardly been tried, plays one position further, appraises it, and
tells all nodes on its way. It may be stopped at any time; more time means deeper and surer. Between two turns of a game
the part below the moves that were made is kept.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from racecraft.contract.world import Array
from racecraft.worlds.battlesnake.env.board import MOVES, Board
from racecraft.worlds.battlesnake.env.settings import GameSettings
from racecraft.worlds.battlesnake.players.kernels import position as at
from racecraft.worlds.battlesnake.players.kernels.position import advance
from racecraft.worlds.battlesnake.players.kernels.puct import FIRST_CHILD, NEXT_SIBLING, look_ahead, transplant
from racecraft.worlds.battlesnake.players.search_position import (
    DEEPEST,
    Position,
    board_at,
    fill_buffers,
    node_cost,
    position_of,
)
from racecraft.worlds.battlesnake.players.weights import Weights, default_weights

WALKS_AT_A_TIME = 128
"""Walks between two looks at the clock in a duel, one or two milliseconds; fewer where there is more to do."""
FIRST_NODES, MAX_NODES = 1 << 12, 1 << 17
"""Room of a new tree, doubled when it is full, and the most it is given (some 40 MB for four snakes)."""
EAGERNESS, EAGERNESS_AMONG_SEVERAL = 0.7, 0.25
"""Weight of curiosity, of two snakes and of more: the more share a board, the less is between a good move and a bad."""
GUIDE_SHARE = 0.6
"""Share of the first walks that the guide's move gets."""
WEIGHER_SHARE = 0.75
"""How far a guide that weighs moves is believed; the rest goes to all safe moves alike."""


class Tree:
    """A search tree over one position.

    Args:
        board: The position.
        settings: What is played.
        snake_id: Whose move is asked for; alive.
        weights: What positions are appraised by; None: what serves best among so many.

    Raises:
        BoardError: Living snakes overlap or lie off the board.
    """

    def __init__(self, board: Board, settings: GameSettings, snake_id: str, weights: Weights | None = None) -> None:
        self._weights = weights or default_weights(len(board.alive()))
        self.position: Position = position_of(board, settings, weights=self._weights)
        self._board = board
        self._me = [snake.id for snake in board.alive()].index(snake_id)
        num_snakes = self.position.rows.shape[1]
        self._room = (*fill_buffers(self.position), np.zeros(num_snakes))
        self._ways = np.zeros((DEEPEST, num_snakes), np.int64)
        self._path = np.zeros(DEEPEST, np.int32)
        self._size = np.zeros(1, np.int64)
        self.eagerness = EAGERNESS if num_snakes <= 2 else EAGERNESS_AMONG_SEVERAL
        self._nodes = empty_nodes(FIRST_NODES, num_snakes)
        self.simulate(0)

    @property
    def walks_at_a_time(self) -> int:
        """Walks between two looks at the clock."""
        return max(4, WALKS_AT_A_TIME // node_cost(self.position))

    @property
    def size(self) -> int:
        """Nodes of the tree."""
        return int(self._size[0])

    def simulate(self, walks: int) -> None:
        """Add walks."""
        self.make_room(walks)
        look_ahead(
            walks, self._me, self.eagerness, *self.position, *self._room, self._ways, self._path, *self._nodes,
            self._size,
        )  # fmt: skip

    def make_room(self, walks: int) -> None:
        """Give the tree room for so many walks more, up to the most it may have."""
        capacity = len(self._nodes[0])
        while capacity < min(self.size + walks, MAX_NODES):
            capacity = min(2 * capacity, MAX_NODES)
        if capacity > len(self._nodes[0]):
            self._nodes = tuple(_lengthened(array, capacity) for array in self._nodes)

    def exclude_move(self, moves: Iterable[str]) -> None:
        """Walk certain own moves no more, unless there are no others."""
        priors = self.priors()[self._me]
        shunned = [MOVES.index(move) for move in moves]
        if priors.sum() > priors[shunned].sum():
            priors[shunned] = 0.0
            priors /= priors.sum()
            self.visits()[shunned] = 0

    def boost_move(self, move: str) -> None:
        """Let a move have the guide's share of the first walks, if it is not surely fatal."""
        priors, way = self.priors()[self._me], MOVES.index(move)
        if priors[way] > 0 and np.count_nonzero(priors) > 1:
            priors *= (1 - GUIDE_SHARE) / (priors.sum() - priors[way])
            priors[way] = GUIDE_SHARE

    def mix_priors(self, chances: Array) -> None:
        """Mix chances of the living snakes' moves, float (M, 4), into the first walks; what is fatal stays out."""
        priors = self.priors()
        believed = np.where(priors > 0, chances, 0.0)
        total = believed.sum(axis=1, keepdims=True)
        mixed = WEIGHER_SHARE * believed / np.where(total > 0, total, 1.0) + (1 - WEIGHER_SHARE) * priors
        priors[...] = np.where(total > 0, mixed, priors)

    def priors(self) -> Array:
        """Return how likely each snake's moves are thought at the root, float32 (M, 4), to be changed in place."""
        found: Array = self._nodes[4][0]
        return found

    def visits(self) -> Array:
        """Return how often each of the own moves was walked, int32 (4,)."""
        found: Array = self._nodes[2][0, self._me]
        return found

    def turns_walked(self) -> int:
        """Return how many turns all walks together have played, below the root as it is now."""
        return int(self._nodes[2][: self.size, self._me].sum())  # a visit of the own snake for each

    def follow(self, board: Board, settings: GameSettings) -> bool:
        """Go on at a position one turn later, keeping what lies below the moves that led there.

        Returns:
            Whether it did: not where a snake or a food came or went in a way that the moves do not tell, and not where
            those moves were never walked. Then nothing has changed.
        """
        ways = self._ways_to(board)
        if ways is None:
            return False
        links, joints = self._nodes[:2]
        joint = 0
        for way in ways:
            joint = joint * 4 + way
        child = int(links[0, FIRST_CHILD])
        while child > 0 and joints[child] != joint:
            child = int(links[child, NEXT_SIBLING])
        if child <= 0:
            return False
        self.keep_below(child)
        self.position, self._board = position_of(board, settings, weights=self._weights), board
        return True

    def keep_below(self, node: int) -> None:
        """Let go of all that does not lie below a node, which becomes the root."""
        capacity = len(self._nodes[0])
        kept = empty_nodes(capacity, self.position.rows.shape[1])
        self._size[0] = transplant(node, *self._nodes, np.zeros(capacity, np.int32), *kept)
        self._nodes = kept

    def _ways_to(self, board: Board) -> list[int] | None:
        """Return the moves after which this position is exactly the one the rules give; None where there are none."""
        before, after = self._board.alive(), board.alive()
        if [snake.id for snake in before] != [snake.id for snake in after] or board.turn != self._board.turn + 1:
            return None
        ways = []
        for number, snake in enumerate(after):
            head = snake.head[1] * board.width + snake.head[0]
            came = self.position.cells[self.position.rows[0, number, at.HEAD], :4] == head
            ways.append(int(np.argmax(came)))
        self._ways[0] = ways
        advance(0, self._ways, *self.position[:4], self.position.rules)
        ahead = board_at(self.position, 1, self._board)
        same = ahead.snakes == after and set(ahead.food) == set(board.food) and self._board.hazards == board.hazards
        return ways if same else None


def empty_nodes(capacity: int, num_snakes: int) -> tuple[Array, ...]:
    """Return the arrays of so many nodes; see `kernels/puct.py`."""
    moves = (capacity, num_snakes, 4)
    return (
        np.zeros((capacity, 3), np.int32), np.zeros(capacity, np.int64), np.zeros(moves, np.int32), np.zeros(moves),
        np.zeros(moves, np.float32), np.zeros(moves[:2], np.float32),
    )  # fmt: skip


def _lengthened(array: Array, capacity: int) -> Array:
    longer = np.zeros((capacity, *array.shape[1:]), array.dtype)
    longer[: len(array)] = array
    return longer
