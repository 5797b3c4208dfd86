"""What a snake can be sure of: alpha-beta, one turn deeper after the other, for one snake of one game.

`kernels/alpha_beta.py` looks a stated number of turns ahead. Here it is asked for one turn more again and again; each
time the moves that were best come first, so that most of the others need no look. What was found is remembered by
position and still helps in the turns that follow.
"""

from __future__ import annotations

import time
from collections.abc import Iterable
from dataclasses import dataclass, field

import numpy as np

from racecraft.contract.world import Array
from racecraft.worlds.battlesnake.env.board import MOVES, Board
from racecraft.worlds.battlesnake.env.settings import GameSettings
from racecraft.worlds.battlesnake.players.hungry import steps_between
from racecraft.worlds.battlesnake.players.kernels import alpha_beta as ab
from racecraft.worlds.battlesnake.players.search_position import DEEPEST, Position, fill_buffers, node_cost, position_of
from racecraft.worlds.battlesnake.players.weights import DEFAULT_WEIGHTS, Weights

TURNS_AT_A_TIME = 500
"""Turns played between two looks at the clock in a duel, one or two milliseconds; fewer where there is more to do."""
REMEMBERED = 1 << 15
"""Positions remembered for a game."""
ALL_MOVES = 15


@dataclass
class SearchResult:
    """What came of a look: the best move, what it is worth, how deep it was looked and at what cost."""

    move: str = ""
    value: int = 0
    """See `kernels/alpha_beta.py`; of the deepest look that was finished."""
    depth: int = 0
    """Turns ahead of the deepest look that was finished."""
    turns: int = 0
    """Turns played forward, all looks together."""
    leaves: int = 0
    """Positions appraised."""
    by_depth: list[tuple[str, int]] = field(default_factory=list)
    """Best move and value of each look that was finished."""

    @property
    def wins(self) -> bool:
        """Whether a win is proven against any play."""
        return self.value > ab.PROVEN

    @property
    def loses(self) -> bool:
        """Whether the own end is proven against the best play of the others."""
        return self.value < -ab.PROVEN


class AlphaBetaSearch:
    """Alpha-beta over the positions of one snake in one game.

    Args:
        board: Its position.
        settings: What is played.
        snake_id: Whose move is asked for; alive.
        weights: What positions are appraised by.
        beside: Another of the same snake and game, which may think in another thread: both remember in one place.

    Raises:
        BoardError: Living snakes overlap or lie off the board.
    """

    def __init__(
        self,
        board: Board,
        settings: GameSettings,
        snake_id: str,
        weights: Weights = DEFAULT_WEIGHTS,
        beside: AlphaBetaSearch | None = None,
    ) -> None:
        self._weights = weights
        self._keys, self._table = np.zeros(REMEMBERED, np.uint64), np.zeros((REMEMBERED, 4), np.int32)
        if beside is not None:
            self._keys, self._table = beside._keys, beside._table
        self._ahead = int(beside is not None)
        """Turns that its looks begin deeper, so that two do not look at the same."""
        self._state = np.zeros(ab.NUM_STATE, np.int64)
        self.set_position(board, settings, snake_id)

    def set_position(self, board: Board, settings: GameSettings, snake_id: str) -> None:
        """Turn to a position, of the same game; what is remembered stays."""
        self.position: Position = position_of(board, settings, weights=self._weights)
        num_snakes, area = self.position.rows.shape[1], len(self.position.cells)
        self._seats = _seats(board, settings, snake_id)
        self._stack = np.zeros((DEEPEST * num_snakes + 1, ab.NUM_FRAME_COLUMNS), np.int32)
        self._ways = np.zeros((DEEPEST, num_snakes), np.int64)
        self._history = np.zeros((num_snakes, area, 4), np.int32)
        self._room = (*fill_buffers(self.position), np.zeros(num_snakes))
        self._state[ab.TOP] = -1
        self._only, self._first, self.found = ALL_MOVES, -1, SearchResult()

    def look_first_at(self, move: str) -> None:
        """Begin the first look at this position with a move, which is kept where no other turns out better."""
        self._first = MOVES.index(move)

    def narrow(self, moves: Iterable[str]) -> None:
        """Look at some own moves only, and begin anew at one turn ahead; what is remembered stays."""
        self._only = sum(1 << MOVES.index(move) for move in moves)
        self._state[ab.TOP] = -1
        self.found = SearchResult()

    def deepen(self, until: float, most_turns: int | None = None, deepest: int = DEEPEST - 1) -> SearchResult:
        """Look deeper and deeper; return what was found. It may be called again to go on.

        Args:
            until: When to stop, of `time.monotonic`; a few milliseconds of looking there are always.
            most_turns: Turns played after which to stop; None: no limit.
            deepest: Turns ahead after which to stop.
        """
        while not (self.found.wins or self.found.loses) and self.found.depth < deepest:
            if not self._go_on(until, most_turns):
                break
        return self.found

    def _go_on(self, until: float, most_turns: int | None) -> bool:
        """Finish the look one turn deeper, if there is time; return whether it was finished."""
        state, found = self._state, self.found
        if state[ab.TOP] < 0:
            first = MOVES.index(found.move) if found.move else self._first
            deeper = 1 if found.depth else 1 + self._ahead
            ab.begin(
                found.depth + deeper, first, self._only, state, self._stack, self._seats, self._history,
                *self.position[:4], self.position.rules,
            )  # fmt: skip
        while state[ab.TOP] >= 0:
            out_of_time = time.monotonic() >= until or (most_turns is not None and found.turns >= most_turns)
            if out_of_time and found.turns > 0:
                self._take_proven_move()
                return False
            before, turns_at_a_time = state[[ab.TURNS, ab.LEAVES]], max(16, TURNS_AT_A_TIME // node_cost(self.position))
            ab.think(
                turns_at_a_time, state, self._stack, self._seats, self._ways, self._history, self._keys, self._table,
                *self.position, *self._room,
            )  # fmt: skip
            turns, leaves = state[[ab.TURNS, ab.LEAVES]] - before
            found.turns, found.leaves = found.turns + int(turns), found.leaves + int(leaves)
        found.depth = int(state[ab.DEPTH])
        found.move, found.value = MOVES[int(self._stack[0, ab.BEST_WAY])], int(self._stack[0, ab.BEST])
        found.by_depth.append((found.move, found.value))
        return True

    def _take_proven_move(self) -> None:
        """Take from an unfinished look a move that proved better than the one that was thought best."""
        top, best = self._stack[0], int(self._stack[0, ab.BEST_WAY])
        if best < 0:
            self.found.move = self.found.move or MOVES[int(top[ab.FIRST_WAY])]
            return
        self.found.move = MOVES[best]
        if top[ab.BEST] < -ab.PROVEN:  # what was thought best loses: rather a move that may not
            untold = [int(top[ab.FIRST_WAY + place]) for place in range(top[ab.NEXT] - 1, top[ab.WAYS])]
            self.found.move = next((MOVES[way] for way in untold if way != best), self.found.move)


def _seats(board: Board, settings: GameSettings, snake_id: str) -> Array:
    """Return the living snakes in the order in which they choose: the own one first, then the nearest."""
    living = board.alive()
    own = next(snake for snake in living if snake.id == snake_id)
    order = sorted(range(len(living)), key=lambda s: (s != living.index(own), steps_between(
        living[s].head, own.head, board, settings)))  # fmt: skip
    return np.array(order, np.int64)
