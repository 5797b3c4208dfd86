"""What lost a game: the move after which nothing could be saved as far as search sees, and what it would have played.

From a snake's end one goes back turn by turn, as long as its position is proven lost: the others can end it whatever it
does. The last position before those still held a choice, and the move that was made there is the losing one. Proofs are
alpha-beta's (`players/alpha_beta_search.py`): against any play of the others that knows the snake's moves, food
that is yet to fall and hazards that are yet to come left out.
"""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from racecraft.contract.errors import nearest
from racecraft.worlds.battlesnake.env.board import Board, BoardError, draw
from racecraft.worlds.battlesnake.env.records import RecordedGame
from racecraft.worlds.battlesnake.env.settings import GameSettings
from racecraft.worlds.battlesnake.players.alpha_beta_search import AlphaBetaSearch, SearchResult
from racecraft.worlds.battlesnake.players.kernels.alpha_beta import UNIT, WIN
from racecraft.worlds.battlesnake.players.protocol import PlayerError
from racecraft.worlds.battlesnake.players.safe_moves import safe_moves

MAX_TURNS_BACK = 60
EFFORT = 20_000
"""Turns played forward to judge one position; some 50 ms."""
_NO_HURRY = 3600.0


@dataclass(frozen=True)
class Loss:
    """How one snake came to lose."""

    snake_id: str
    died_on: int
    """Turn of its end."""
    cause: str
    by: str
    """Who ended it; "" where nobody did."""
    turn: int
    """Turn at which the losing move was made."""
    played: str
    """The losing move."""
    better: str
    """What search would have played; the same move where it saw nothing better."""
    played_finding: SearchResult
    """What search thinks of the move that was made."""
    better_finding: SearchResult
    """What search thinks of its own."""
    board: Board
    """The position in which it was made."""
    further_back: bool
    """Whether every position looked at was lost already, so that the true losing move lies further back."""

    def to_dict(self) -> dict[str, Any]:
        """Return it as plain JSON values."""
        return {
            "snake": self.snake_id, "died_on": self.died_on, "cause": self.cause, "by": self.by,
            "turn": self.turn, "played": self.played, "better": self.better,
            "played_says": finding_text(self.played_finding, self.turn),
            "better_says": finding_text(self.better_finding, self.turn),
            "depth": self.better_finding.depth, "further_back": self.further_back,
            "board": draw(self.board).splitlines(),
        }  # fmt: skip


def finding_text(found: SearchResult, turn: int) -> str:
    """Return what a finding says of a position at a turn.

    >>> finding_text(SearchResult("up", -999_988, 7), 5)
    'lost within 7 turns'
    """
    if found.wins:
        return f"won within {_turns(max(1, _ends_in(found, turn)))}"
    if found.loses:
        return f"lost within {_turns(max(1, _ends_in(found, turn)))}"
    return f"{found.value / UNIT:+.2f} after {_turns(found.depth)}"


def _turns(count: int) -> str:
    return f"{count} turn" + "s" * (count != 1)


def study_game(
    game: RecordedGame, who: Sequence[str] = (), effort: int = EFFORT, most_back: int = MAX_TURNS_BACK
) -> list[Loss]:
    """Return how the snakes lost that did, in the order of their ends.

    Args:
        game: What was played.
        who: Ids of the snakes to look at; all that died where it is empty.
        effort: Turns played forward to judge one position.
        most_back: Turns to go back from an end.

    Raises:
        PlayerError: No snake has such an id, or it did not die in what was recorded.
    """
    ids = [snake.id for snake in game.start.snakes]
    for one in who:
        if one not in ids:
            raise PlayerError("There is no snake '{one}' in this game. {hint}", one=one, hint=nearest(one, ids))
    last = game.steps[-1].after_map if game.steps else game.start
    dead = sorted((snake for snake in last.snakes if not snake.alive), key=lambda snake: snake.on)
    for one in who:
        if one not in [snake.id for snake in dead]:
            raise PlayerError("snake '{one}' lives to the end of what was recorded; expected one that lost.", one=one)
    chosen = [snake.id for snake in dead if not who or snake.id in who]
    return [loss for one in chosen if (loss := _study_snake(game, one, effort, most_back)) is not None]


def _study_snake(game: RecordedGame, snake_id: str, effort: int, most_back: int) -> Loss | None:
    """Go back from a snake's end to the last position that was not lost."""
    lived = [step for step in game.steps if any(snake.id == snake_id for snake in step.before.alive())]
    if not lived or any(snake.id == snake_id for snake in lived[-1].after_map.alive()):
        return None
    end = next(snake for snake in lived[-1].after_map.snakes if snake.id == snake_id)
    for step in reversed(lived[-most_back:]):
        board, played = step.before, step.moves[snake_id]
        mine = search_position(board, game.settings, snake_id, effort)
        if not mine.loses:
            break
    made = search_position(board, game.settings, snake_id, effort, played)
    return Loss(snake_id, end.on, end.cause, end.by, board.turn, played, mine.move, made, mine, board, mine.loses)


def search_position(board: Board, settings: GameSettings, snake_id: str, effort: int, move: str = "") -> SearchResult:
    """Return what search finds in a position, of all moves or of one.

    A move that is surely fatal needs no search; where all are, the position is lost.
    """
    safe = safe_moves(board, settings, snake_id)
    if not safe or (move and move not in safe):
        return SearchResult(move or "up", -WIN + board.turn + 1, 1)
    certainty = AlphaBetaSearch(board, settings, snake_id)
    if move:
        certainty.narrow([move])
    return certainty.deepen(time.monotonic() + _NO_HURRY, effort)


def _ends_in(found: SearchResult, turn: int) -> int:
    """Return in how many turns a proven end comes."""
    return WIN - turn - found.value if found.wins else WIN - turn + found.value


def study_games(games: Sequence[RecordedGame], who: Sequence[str], effort: int, most_back: int) -> list[Loss]:
    """Study several games; see `study_game`. Raises BoardError where a position cannot be told to search."""
    try:
        return [loss for game in games for loss in study_game(game, who, effort, most_back)]
    except BoardError as problem:
        raise BoardError("a position of this game cannot be studied: {problem}", problem=problem) from problem
