"""Player 5: looks many moves ahead, as long as it is given time.

Against one other it looks for what it can be sure of (`certainty.py`): deeper and deeper, with the other's best reply
to every move. Among several it grows a tree of what may happen (`tree.py`), for nobody there plays against it alone.
Both may be stopped at any time; more time means deeper and surer.

A guide, another player, may say where to look first: its move then has more than its share of the tree's first walks. A
guide that weighs moves, such as a trained policy, says so for every snake on the board, whose replies are then looked
at as likely as it thinks them.
"""

from __future__ import annotations

import time
from contextlib import suppress

import numpy as np

from racecraft.envs.battlesnake.board import MOVES, Board
from racecraft.envs.battlesnake.settings import GameSettings
from racecraft.players.battlesnake.certainty import Certainty
from racecraft.players.battlesnake.protocol import SnakePlayer, Weigher
from racecraft.players.battlesnake.sight import best_safe_move, find_snake, safe_moves
from racecraft.players.battlesnake.tree import WALKS_AT_A_TIME, Tree

SURE_AMONG = 2
"""Snakes alive up to which it looks for what it can be sure of."""


class Search:
    """Alpha-beta in duels, decoupled PUCT among more; area control where they stop. Anytime.

    Args:
        most_walks: Walks of the tree, or turns played by alpha-beta, after which it is sure enough; None: until the
            time is up. With a number and enough time its moves are the same every time.
        guide: A player that says where to look first; with one it always grows a tree.
        sure_among: Snakes alive up to which it looks for what it can be sure of; 0 never.
    """

    def __init__(
        self, most_walks: int | None = None, guide: SnakePlayer | None = None, sure_among: int = SURE_AMONG
    ) -> None:
        self.most_walks, self.guide = most_walks, guide
        self.sure_among = 0 if guide is not None else sure_among

    def choose(self, board: Board, settings: GameSettings, snake_id: str, seconds: float) -> str:
        """Return the move that is surest, or was walked most, when the time is up."""
        until = time.monotonic() + seconds
        find_snake(board, snake_id)
        mine = safe_moves(board, settings, snake_id)
        if len(mine) < 2:
            return mine[0] if mine else best_safe_move(board, settings, snake_id)
        if len(board.alive()) <= self.sure_among:
            found = Certainty(board, settings, snake_id).deepen(until, self.most_walks)
            return found.move
        return self._walk(board, settings, snake_id, seconds, until)

    def _walk(self, board: Board, settings: GameSettings, snake_id: str, seconds: float, until: float) -> str:
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
