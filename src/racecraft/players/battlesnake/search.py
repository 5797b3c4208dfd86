"""Player 5: looks many moves ahead, as long as it is given time.

It grows a tree of what may happen (`kernels/puct.py`): every walk goes down where a move has been good or has hardly
been tried, plays one position further, appraises it by area control, and tells all nodes on its way. The move that was
walked most is played. It may be stopped at any time; more time means deeper and surer.

A guide, another player, may say where to look first: its move then has more than its share of the first walks. A guide
that weighs moves, such as a trained policy, says so for every snake on the board, whose replies are then looked at as
likely as it thinks them.
"""

from __future__ import annotations

import time
from contextlib import suppress

import numpy as np

from racecraft.contract.world import Array
from racecraft.envs.battlesnake.board import MOVES, Board
from racecraft.envs.battlesnake.settings import GameSettings
from racecraft.players.battlesnake.area_control import position_arrays
from racecraft.players.battlesnake.kernels.puct import look_ahead
from racecraft.players.battlesnake.kernels.territory import scratch_arrays
from racecraft.players.battlesnake.protocol import SnakePlayer, Weigher
from racecraft.players.battlesnake.sight import best_safe_move, find_snake, safe_moves

WALKS_AT_A_TIME = 32
"""Walks between two looks at the clock; well under 10 ms."""
MOST_NODES = 4096
DEEPEST = 48
"""Turns a walk looks ahead at most."""
EAGERNESS = 0.7
"""Weight of curiosity."""
GUIDE_SHARE = 0.6
"""Share of the first walks that the guide's move gets."""
WEIGHER_SHARE = 0.75
"""How far a guide that weighs moves is believed; the rest goes to all safe moves alike."""


class Search:
    """Decoupled PUCT with area control at the leaves, anytime.

    Args:
        most_walks: Walks after which it is sure enough; None: until the time is up. With a number and enough time its
            moves are the same every time.
        guide: A player that says where to look first.
    """

    def __init__(self, most_walks: int | None = None, guide: SnakePlayer | None = None) -> None:
        self.most_walks, self.guide = most_walks, guide

    def choose(self, board: Board, settings: GameSettings, snake_id: str, seconds: float) -> str:
        """Return the move that was walked most when the time is up."""
        until = time.monotonic() + seconds
        find_snake(board, snake_id)
        mine = safe_moves(board, settings, snake_id)
        if len(mine) < 2:
            return mine[0] if mine else best_safe_move(board, settings, snake_id)
        tree = Tree(board, settings, snake_id)
        if isinstance(self.guide, Weigher):
            tree.believe(self.guide.weigh(board, settings))
        elif self.guide is not None:
            with suppress(TimeoutError):  # a user's file that is too slow is no help, and no harm
                tree.trust(self.guide.choose(board, settings, snake_id, seconds / 4))
        left = self.most_walks if self.most_walks is not None else 1 << 30
        while left > 0:
            walks = min(left, WALKS_AT_A_TIME)
            tree.walk(walks)
            left -= walks
            if time.monotonic() >= until:
                break
        return MOVES[int(np.argmax(tree.visits()))]


class Tree:
    """A search tree over one position; see `kernels/puct.py` for its arrays."""

    def __init__(self, board: Board, settings: GameSettings, snake_id: str) -> None:
        self._games, self._params = position_arrays(board, settings, copies=2)
        self._me = [snake.id for snake in board.alive()].index(snake_id)
        num_snakes = self._games.snakes.shape[1]
        nodes = (MOST_NODES, num_snakes, 4)
        self._links, self._joints = np.zeros((MOST_NODES, 3), np.int32), np.zeros(MOST_NODES, np.int64)
        self._visits, self._sums, self._priors = np.zeros(nodes, np.int32), np.zeros(nodes), np.zeros(nodes)
        self._first_worths = np.zeros(nodes[:2])
        self._size = np.zeros(1, np.int64)
        self._path = np.zeros((DEEPEST, num_snakes + 1), np.int32)
        self._moves = np.zeros((2, num_snakes), np.int64)
        self._scratch = scratch_arrays(num_snakes, settings.area)
        self.walk(0)

    def walk(self, walks: int) -> None:
        """Add walks."""
        games = self._games
        look_ahead(
            walks, self._me, EAGERNESS, games.bodies, games.snakes, games.games, games.cells, games.sides, self._params,
            self._links, self._joints, self._visits, self._sums, self._priors, self._first_worths, self._size,
            self._path, self._moves, *self._scratch,
        )  # fmt: skip

    def trust(self, move: str) -> None:
        """Let a move have the guide's share of the first walks, if it is not surely fatal."""
        priors, way = self._priors[0, self._me], MOVES.index(move)
        if priors[way] > 0 and np.count_nonzero(priors) > 1:
            priors *= (1 - GUIDE_SHARE) / (priors.sum() - priors[way])
            priors[way] = GUIDE_SHARE

    def believe(self, chances: Array) -> None:
        """Mix chances of the living snakes' moves, float (M, 4), into the first walks; what is fatal stays out."""
        priors = self._priors[0]
        believed = np.where(priors > 0, chances, 0.0)
        total = believed.sum(axis=1, keepdims=True)
        mixed = WEIGHER_SHARE * believed / np.where(total > 0, total, 1.0) + (1 - WEIGHER_SHARE) * priors
        priors[...] = np.where(total > 0, mixed, priors)

    def visits(self) -> Array:
        """Return how often each of the own moves was walked, int32 (4,)."""
        found: Array = self._visits[0, self._me]
        return found
