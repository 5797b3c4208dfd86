"""Player 4: wants more squares than the others, whatever they reply.

For each of its moves it plays every reply of the snakes nearby, one turn by the true rules, and asks of each position:
whose squares are whose (`kernels/territory.py`)? A move is worth the mean over the replies and, as much again, the
worst of them: others do not mean well, but they do not read minds either.
"""

from __future__ import annotations

import itertools

import numpy as np

from racecraft.contract.world import Array
from racecraft.worlds.battlesnake.env.board import MOVES, Board
from racecraft.worlds.battlesnake.env.kernels.rules import apply_rules
from racecraft.worlds.battlesnake.env.settings import GameSettings
from racecraft.worlds.battlesnake.env.state import Games, allocate_games, params_of, put_board
from racecraft.worlds.battlesnake.players.hungry import steps_between
from racecraft.worlds.battlesnake.players.kernels.territory import copy_game, evaluate, scratch_arrays
from racecraft.worlds.battlesnake.players.safe_moves import best_safe_move, find_snake, safe_moves

NEARBY = 6
"""Moves between two heads up to which replies are looked at."""
MAX_REPLIES = 81
"""Joint replies looked at for one move."""
POSITION, AFTER = 0, 1  # games in the arrays: the one asked about, and the one after a turn


class AreaControl:
    """Looks one turn ahead at every reply and counts squares."""

    def choose(self, board: Board, settings: GameSettings, snake_id: str, seconds: float) -> str:
        """Return the move with the best mean and worst case over the others' replies."""
        me = find_snake(board, snake_id)
        seats = [snake for snake in board.snakes if snake.alive]
        mine = safe_moves(board, settings, snake_id)
        if len(mine) < 2:
            return mine[0] if mine else best_safe_move(board, settings, snake_id)
        replies = []
        for snake in seats:
            moves = safe_moves(board, settings, snake.id) or ["up"]
            near = steps_between(snake.head, me.head, board, settings) <= NEARBY
            replies.append(moves if near else [best_safe_move(board, settings, snake.id)])
        table = Lookout(board, settings)
        number = seats.index(me)

        def worth(move: str) -> float:
            replies[number] = [move]
            joint_moves = itertools.islice(itertools.product(*replies), MAX_REPLIES)
            worths = [table.values_after(joint)[number] for joint in joint_moves]
            return float(np.mean(worths) + min(worths))

        return max(mine, key=worth)


class Lookout:
    """A position from which turns are tried out under the compiled rules, without dice: no food falls.

    Args:
        board: The position; only its living snakes take part, in their order.
        settings: Size, ruleset and hazards.

    Raises:
        BoardError: The position cannot be told in the kernels' arrays (living snakes overlap).
    """

    def __init__(self, board: Board, settings: GameSettings) -> None:
        self.games, self.params = position_arrays(board, settings, copies=2)
        num_snakes = self.games.snakes.shape[1]
        self._moves = np.zeros((2, num_snakes), np.int64)
        self._scratch, self._squares, self._food_steps, self._worths = scratch_arrays(num_snakes, settings.area)

    def values_after(self, moves: tuple[str, ...]) -> Array:
        """Return what the position after one turn is worth to each snake, float64 (M,), 0 dead to 1 won."""
        games = self.games
        copy_game(POSITION, AFTER, games.bodies, games.snakes, games.games, games.cells)
        self._moves[AFTER] = [MOVES.index(move) for move in moves]
        apply_rules(
            AFTER, self._moves, games.bodies, games.snakes, games.games, games.cells, games.sides, self.params
        )  # fmt: skip
        evaluate(
            AFTER, games.bodies, games.snakes, games.cells, self.params,
            self._scratch, self._squares, self._food_steps, self._worths,
        )  # fmt: skip
        return self._worths


def position_arrays(board: Board, settings: GameSettings, copies: int) -> tuple[Games, Array]:
    """Return a position's living snakes in the kernels' arrays, as the first of `copies` games, and its parameters.

    The map is left out: nobody knows what it will do next.
    """
    living = Board(board.width, board.height, board.turn, board.alive(), board.food, board.hazards)
    seats = GameSettings(
        width=board.width,
        height=board.height,
        players=max(1, len(living.snakes)),
        ruleset="standard" if settings.ruleset == "royale" else settings.ruleset,
        hazard_damage=settings.hazard_damage,
        solo=settings.solo if len(living.snakes) > 1 else True,
    )
    games = allocate_games(seats, copies)
    put_board(games, 0, living)
    return games, params_of(seats)
