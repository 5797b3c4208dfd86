"""What search keeps of its games between turns, and thinks on about while others think.

Nobody tells a player which game it is asked about, and none need: a mind is found again by the position, where the own
snake's body is the one of the turn before with a new head. What proves not to follow from it is thought about afresh.
"""

from __future__ import annotations

import threading
import time
from collections import OrderedDict
from collections.abc import Callable

from racecraft.worlds.battlesnake.env.board import Board, BoardError, Snake
from racecraft.worlds.battlesnake.env.settings import GameSettings
from racecraft.worlds.battlesnake.players.alpha_beta_search import AlphaBetaSearch
from racecraft.worlds.battlesnake.players.mcts import Tree
from racecraft.worlds.battlesnake.players.weights import DEFAULT_WEIGHTS, Weights

MINDS_KEPT = 64
"""Games remembered; the one not heard of for the longest goes first."""
PONDER_SECONDS = 2.0
"""How long a mind is pondered on at most, if nobody asks: then the game is over, or the other will not answer."""
PONDER_CHUNK_SECONDS = 0.004
HELPERS_CURIOSITY = 1.5
"""How much more curious the tree of a second core is."""

Key = tuple[object, ...]
Plant = Callable[[Board, GameSettings, str], Tree]
"""Begins a tree of a position, for the snake whose move is asked for."""


class SearchSession:
    """What one snake thinks about one game.

    Args:
        board: The position.
        settings: What is played.
        snake_id: Whose mind it is; alive.
        plant: Begins its tree.
        weights: What positions are appraised by where it looks for what is certain.
    """

    def __init__(
        self,
        board: Board,
        settings: GameSettings,
        snake_id: str,
        plant: Plant = Tree,
        weights: Weights = DEFAULT_WEIGHTS,
    ) -> None:
        self.board, self.settings, self.snake_id = board, settings, snake_id
        self._plant, self._weights = plant, weights
        self._certainty: AlphaBetaSearch | None = None
        self._is_current = False
        self.tree: Tree | None = None
        self._helper: SearchSession | None = None

    def go_on(self, board: Board, settings: GameSettings) -> None:
        """Turn to the game's next position; keep what is still true there."""
        if self.tree is not None and not self.tree.follow(board, settings):
            self.tree = None
        self.board, self.settings, self._is_current = board, settings, False
        if self._helper is not None:
            self._helper.go_on(board, settings)

    @property
    def certainty(self) -> AlphaBetaSearch:
        """What it can be sure of at this position."""
        if self._certainty is None:
            self._certainty = AlphaBetaSearch(self.board, self.settings, self.snake_id, self._weights)
        elif not self._is_current:
            self._certainty.set_position(self.board, self.settings, self.snake_id)
        self._is_current = True
        return self._certainty

    def grown_tree(self) -> Tree:
        """Return the tree, begun if there is none."""
        if self.tree is None:
            self.tree = self._plant(self.board, self.settings, self.snake_id)
        return self.tree

    @property
    def helper(self) -> SearchSession:
        """A mind about the same position for another thread, which remembers proofs in the same place.

        Its tree is its own, and more curious than this one's, so that both do not walk the same.
        """
        if self._helper is None:
            self._helper = SearchSession(self.board, self.settings, self.snake_id, self._plant_curious, self._weights)
            self._helper._certainty = AlphaBetaSearch(
                self.board, self.settings, self.snake_id, self._weights, self.certainty
            )
            self._helper._is_current = True
        return self._helper

    def _plant_curious(self, board: Board, settings: GameSettings, snake_id: str) -> Tree:
        tree = self._plant(board, settings, snake_id)
        tree.eagerness *= HELPERS_CURIOSITY
        return tree

    def settle_on(self, move: str) -> None:
        """Look, from now on, only at what may follow the move that was chosen."""
        if self.tree is None:
            self.certainty.narrow([move])

    def ponder(self) -> bool:
        """Think on for a few milliseconds; return whether there is anything left to think about."""
        if self.tree is not None:
            before = self.tree.size
            self.tree.simulate(self.tree.walks_at_a_time)
            return self.tree.size > before
        before = self.certainty.found.turns
        found = self.certainty.deepen(time.monotonic() + PONDER_CHUNK_SECONDS)
        return found.turns > before


class SessionCache:
    """The minds of many games, each used by one thread at a time.

    Args:
        most: Games remembered.
        ponders: Whether a thread thinks on about the game asked about last, while nobody asks.
        plant: Begins the trees.
        weights: What positions are appraised by where they look for what is certain.
    """

    def __init__(
        self, most: int = MINDS_KEPT, ponders: bool = False, plant: Plant = Tree, weights: Weights = DEFAULT_WEIGHTS
    ) -> None:
        self._most, self.ponders, self._plant, self._weights = most, ponders, plant, weights
        self._kept: OrderedDict[Key, SearchSession] = OrderedDict()
        self._lock = threading.Condition()
        self._busy, self._pondered = 0, False
        self._waiting: SearchSession | None = None
        self._thread: threading.Thread | None = None

    def recall(self, board: Board, settings: GameSettings, snake_id: str) -> SearchSession:
        """Return the mind of the game that came to this position, or a new one; end pondering at once.

        Raises:
            BoardError: The snake is not alive here.
        """
        own = _own(board, snake_id)
        key = _key(board.width, board.height, settings, board.turn - 1, snake_id, own.body[1:3])
        with self._lock:
            self._busy += 1
            self._waiting = None
            while self._pondered:
                self._lock.wait()
            mind = self._kept.pop(key, None)
        if mind is None:
            return SearchSession(board, settings, snake_id, self._plant, self._weights)
        mind.go_on(board, settings)
        return mind

    def keep(self, mind: SearchSession, move: str | None) -> None:
        """Put a mind back that was recalled, with the move that was chosen; None: forget it."""
        with self._lock:
            self._busy -= 1
            if move is None:
                return
            own = _own(mind.board, mind.snake_id)
            board = mind.board
            key = _key(board.width, board.height, mind.settings, board.turn, mind.snake_id, own.body[:2])
            self._kept[key] = mind
            self._kept.move_to_end(key)
            while len(self._kept) > self._most:
                self._kept.popitem(last=False)
            if self.ponders and self._busy == 0:
                mind.settle_on(move)
                self._waiting = mind
                self._begin_to_ponder()
                self._lock.notify_all()

    def _begin_to_ponder(self) -> None:
        if self._thread is None:
            self._thread = threading.Thread(target=self._ponder, name="pondering", daemon=True)
            self._thread.start()

    def _ponder(self) -> None:
        """Think on about whatever waits, a few milliseconds at a time; nobody waits for more."""
        while True:
            with self._lock:
                while self._waiting is None:
                    self._lock.wait()
                mind = self._waiting
            until = time.monotonic() + PONDER_SECONDS
            going = True
            while going and time.monotonic() < until:
                with self._lock:
                    if self._waiting is not mind:
                        break
                    self._pondered = True
                try:
                    going = mind.ponder()
                finally:
                    with self._lock:
                        self._pondered = False
                        self._lock.notify_all()
            with self._lock:
                if self._waiting is mind:
                    self._waiting = None


def _own(board: Board, snake_id: str) -> Snake:
    for snake in board.alive():
        if snake.id == snake_id:
            return snake
    raise BoardError("snake '{snake_id}' is not alive on this board.", snake_id=snake_id)


def _key(width: int, height: int, settings: GameSettings, turn: int, snake_id: str, body: list[tuple[int, int]]) -> Key:
    return width, height, settings.ruleset, turn, snake_id, *body
