"""What an engine sends for one snake, turned into a message of the documented API: only living snakes, all readable.

Engines differ. The documented API leaves eliminated snakes out of `board.snakes`; the official arena of 2026 leaves
them where they died, unmarked, heads off the board included (facts: battlesnake-arena.md). A snake has to move whatever
is sent about the others, so what cannot be read about them is left out, too.
"""

from __future__ import annotations

from typing import Any

from racecraft.worlds.battlesnake.env.board import MAX_HEALTH, Board, BoardError, Point, Snake
from racecraft.worlds.battlesnake.env.settings import GameSettings
from racecraft.worlds.battlesnake.env.stages import GameContext, eliminate
from racecraft.worlds.battlesnake.players.messages import read_point, read_snake
from racecraft.worlds.battlesnake.players.protocol import Message
from racecraft.worlds.battlesnake.players.safe_moves import best_safe_move


class LivingSnakes:
    """Tells the living from the dead in one game, request by request.

    A snake is dead where its head stayed on its square for a turn, or where the rules eliminate it on the board as
    sent. The snake that is asked for a move is alive.
    """

    def __init__(self) -> None:
        self._turn = -1
        self._heads: dict[str, Point] = {}
        """Where each snake's head was at the last request, by id."""
        self._dead: set[str] = set()

    def restart(self) -> None:
        """Begin the game anew: nobody is dead."""
        self._turn, self._heads, self._dead = -1, {}, set()

    def only(self, message: Any, asks: bool = True) -> Any:
        """Return the message with the living snakes alone, and food on the board alone.

        Args:
            message: As sent.
            asks: Whether it asks for a move, so that `you` is alive.

        A message that is no object, or whose board has no size, is returned as it is: `read_message` names its error.
        """
        try:
            turn, board = int(message["turn"]), message["board"]
            width, height, you = int(board["width"]), int(board["height"]), message["you"]
            parts, snakes = _readable(board["snakes"], you if asks else {"id": ""})
        except (KeyError, TypeError, ValueError, AttributeError):
            return message
        playing, mine = Board(width, height, turn, snakes), you.get("id") if asks else ""
        dead = self._stayed(playing, mine)
        dead |= _eliminated(playing, dead, mine)
        self._turn, self._heads, self._dead = turn, {snake.id: snake.head for snake in snakes}, dead
        living = [part for part in parts if part["id"] not in dead]
        return {**message, "board": {**board, "snakes": living, "food": _food(board, playing)}}

    def _stayed(self, board: Board, you: str) -> set[str]:
        """Return the snakes whose head has not moved since they died or, if that was the last request, for a turn."""
        if board.turn < self._turn:
            self.restart()
        known = self._dead if board.turn != self._turn + 1 else self._heads.keys()
        return {
            snake.id
            for snake in board.snakes
            if snake.id in known and snake.id != you and self._heads.get(snake.id) == snake.head
        }


def move_anyway(message: Any) -> str:
    """Return a safe move for a message that is refused, as far as its board can be read; else "up"."""
    try:
        board, you = message["board"], message["you"]
        _, snakes = _readable(board["snakes"], you)
        return best_safe_move(Board(int(board["width"]), int(board["height"]), 0, snakes), GameSettings(), you["id"])
    except (BoardError, KeyError, TypeError, ValueError, AttributeError):
        return "up"


def _readable(parts: Any, you: Any) -> tuple[list[Message], list[Snake]]:
    """Return the snakes with a readable body, as sent and read; `you` also where it is missing among them."""
    mine: Any = next((part for part in parts if isinstance(part, dict) and part.get("id") == you["id"]), None)
    if mine is None and you["id"]:
        mine, parts = you, [*parts, you]
    kept: list[Message] = []
    snakes: list[Snake] = []
    for number, part in enumerate(parts):
        sound = part if part is mine else _mended(part, number, {you["id"], *(snake.id for snake in snakes)})
        try:
            snake = read_snake(sound, "")
        except BoardError:
            kept += [part] * (part is mine)
            continue
        if part is mine or all(snake.body != other.body for other in snakes):
            snakes.append(snake)
            kept.append(sound)
    return kept, snakes


def _mended(part: Any, number: int, taken: set[str]) -> Any:
    """Return another snake with an id of its own and a health of the rules; its body is as sent."""
    if not isinstance(part, dict):
        return part
    one, health = part.get("id"), part.get("health")
    one = one if isinstance(one, str) and one not in taken else f"snake {number}"
    health = max(0, min(health, MAX_HEALTH)) if isinstance(health, int) else MAX_HEALTH
    return {**part, "id": one, "health": health}


def _eliminated(board: Board, dead: set[str], you: str) -> set[str]:
    """Return the snakes that the rules eliminate on the board as sent; whoever would eliminate `you` is dead, too."""
    if board.turn <= 0:
        return set()
    gone = set(dead)
    while True:
        judged = Board(board.width, board.height, board.turn - 1)
        judged.snakes = [snake.copy() for snake in board.snakes if snake.id not in gone]
        eliminate(judged, {}, GameContext(GameSettings()))
        blamed = {snake.by for snake in judged.snakes if snake.id == you and snake.by not in ("", you)}
        if not blamed:
            return {snake.id for snake in judged.snakes if not snake.alive and snake.id != you} | (gone - dead)
        gone |= blamed


def _food(board: Message, playing: Board) -> list[Any]:
    """Return the food that lies on the board."""
    kept = []
    for part in board.get("food") or []:
        try:
            if playing.holds(read_point(part, "")):
                kept.append(part)
        except BoardError:
            continue
    return kept
