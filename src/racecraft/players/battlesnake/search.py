"""Player 5: looks many moves ahead, as long as it is given time.

Against one other it looks for what it can be sure of (`certainty.py`): deeper and deeper, with the other's best reply
to every move. Among several it grows a tree of what may happen (`tree.py`), for nobody there plays against it alone;
moves of which alpha-beta can tell within a blink that somebody may end it there are not walked. Both may be stopped at
any time, and both keep from turn to turn what still holds (`minds.py`).

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
from racecraft.players.battlesnake.kernels.alpha_beta import DRAWN
from racecraft.players.battlesnake.minds import Mind, Minds
from racecraft.players.battlesnake.protocol import SnakePlayer, Weigher
from racecraft.players.battlesnake.sight import best_safe_move, find_snake, safe_moves
from racecraft.players.battlesnake.tree import Tree
from racecraft.players.battlesnake.weights import USUAL, Weights

SURE_AMONG = 2
"""Snakes alive up to which it looks for what it can be sure of."""
NEAR_TURNS = 3
"""Turns ahead within which a tree's moves must not lose, or end in a draw, against any play."""
NEAR_EFFORT = 3000
"""Turns played for that, for each move; a few milliseconds."""
NEAR_SHARE = 0.3
"""Share of the time that it may take."""


class Search:
    """Alpha-beta in duels, decoupled PUCT among more; area control where they stop. Anytime.

    Args:
        most_walks: Walks of the tree, or turns played by alpha-beta, after which it is sure enough; None: until the
            time is up. With a number and enough time its moves are the same every time, for it then keeps nothing
            from turn to turn.
        guide: A player that says where to look first; with one it always grows a tree.
        sure_among: Snakes alive up to which it looks for what it can be sure of; 0 never.
        ponders: Whether it thinks on while nobody asks it.
        weights: What positions are appraised by.
    """

    def __init__(
        self,
        most_walks: int | None = None,
        guide: SnakePlayer | None = None,
        sure_among: int = SURE_AMONG,
        ponders: bool = False,
        weights: Weights = USUAL,
    ) -> None:
        self.weights = weights
        self.most_walks, self.guide = most_walks, guide
        self.sure_among = 0 if guide is not None else sure_among
        self.minds = Minds(ponders=ponders, weights=weights)

    def choose(self, board: Board, settings: GameSettings, snake_id: str, seconds: float) -> str:
        """Return the move that is surest, or was walked most, when the time is up."""
        until = time.monotonic() + seconds
        find_snake(board, snake_id)
        mine = safe_moves(board, settings, snake_id)
        if len(mine) < 2:
            return mine[0] if mine else best_safe_move(board, settings, snake_id)
        if self.most_walks is not None:
            return self._think(Mind(board, settings, snake_id, self.weights), mine, seconds, until)
        mind, move = self.minds.recall(board, settings, snake_id), None
        try:
            move = self._think(mind, mine, seconds, until)
        finally:
            self.minds.keep(mind, move)
        return move

    def warm_up(self, board: Board, settings: GameSettings, snake_id: str) -> None:
        """Have everything compiled that a game may come to need."""
        mind = Mind(board, settings, snake_id, self.weights)
        mind.certainty.deepen(0.0)
        mind.grown_tree().keep_below(0)
        mind.go_on(board, settings)

    def _think(self, mind: Mind, mine: list[str], seconds: float, until: float) -> str:
        if len(mind.board.alive()) <= self.sure_among:
            mind.tree = None
            found = mind.certainty.deepen(until, self.most_walks)
            if not found.loses or found.depth > NEAR_TURNS:
                return found.move
        return self._walk(mind, mine, seconds, until)

    def _walk(self, mind: Mind, mine: list[str], seconds: float, until: float) -> str:
        tree = mind.grown_tree()
        self._ask_guide(tree, mind, seconds)
        tree.shun(self._dangers(mind, mine, until - (1 - NEAR_SHARE) * seconds))
        left = self.most_walks if self.most_walks is not None else 1 << 30
        while left > 0:
            walks = min(left, tree.walks_at_a_time)
            tree.walk(walks)
            left -= walks
            if time.monotonic() >= until:
                break
        return MOVES[int(np.argmax(tree.visits()))]

    def _ask_guide(self, tree: Tree, mind: Mind, seconds: float) -> None:
        board, settings, guide = mind.board, mind.settings, self.guide
        if isinstance(guide, Weigher):
            tree.believe(guide.weigh(board, settings))
        elif guide is not None:
            with suppress(TimeoutError):  # a user's file that is too slow is no help, and no harm
                tree.trust(guide.choose(board, settings, mind.snake_id, seconds / 4))

    def _dangers(self, mind: Mind, mine: list[str], until: float) -> list[str]:
        """Return the moves after which others may end the snake within a few turns, whatever it does."""
        found = []
        for move in mine:
            mind.certainty.narrow([move])
            deepest = 1 if time.monotonic() >= until else NEAR_TURNS
            if mind.certainty.deepen(until, NEAR_EFFORT, deepest).value <= DRAWN + mind.board.turn + NEAR_TURNS:
                found.append(move)
        return found
