"""The output file of the official `battlesnake play`: JSON Lines, both ways (facts: A.11).

The first line is the game, then comes one whole message a turn, from 0 to the last (its `you` does not matter), then
`{"winnerId", "winnerName", "isDraw"}`. Nothing in the official file says how a snake died, so our last line has one key
more, which other readers pass over: `"eliminations": [{"id", "cause", "by", "turn", "health", "body"}]`.
"""

from __future__ import annotations

import json
from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path
from typing import Any

from racecraft.contract.errors import InputFileError
from racecraft.contract.message import Message
from racecraft.formats.atomic import write_atomic
from racecraft.formats.user_file import regular
from racecraft.worlds.battlesnake.env.board import CAUSES, MAX_HEALTH, Board, BoardError, Snake
from racecraft.worlds.battlesnake.evaluation.match import Played
from racecraft.worlds.battlesnake.players.messages import (
    MAX_SEGMENTS,
    GameCard,
    GameRequest,
    game_part,
    message,
    read_message,
)

MAX_LINE_BYTES = 1 << 22
UNKNOWN_CAUSE = "eliminated"
"""The cause of a snake of which only is known that it left."""
_EXPECTED = "the output file of `snakes play --output`"


def write_record(played: Played, path: str | Path) -> None:
    """Write a game that was played, whole or not at all."""
    write_atomic(path, record_text(played))


def record_text(played: Played) -> str:
    """Return what the file holds of a game that was played."""
    lines: list[dict[str, Any]] = [game_part(played.card, played.settings)]
    for board in played.boards:
        you = (board.alive() or board.snakes)[0].id
        lines.append(message(board, played.settings, you, played.card))
    dead = [snake for snake in played.boards[-1].snakes if not snake.alive]
    lines.append(verdict(played) | {"eliminations": [_elimination(snake) for snake in dead]})
    return "".join(json.dumps(line, separators=(",", ":")) + "\n" for line in lines)


def verdict(played: Played) -> dict[str, Any]:
    """Return who won: the last line of the file."""
    nobody_left = not played.boards[-1].alive()
    winner = played.winner
    return {
        "winnerId": winner,
        "winnerName": played.card.names.get(winner, ""),
        "isDraw": nobody_left and not played.is_solo,
    }


def read_record(path: str | Path) -> Played:
    """Read such a file; also one of the official engine.

    Eliminated snakes are no longer on its boards; they are put back where they were seen last, with the cause that our
    own files tell, and `UNKNOWN_CAUSE` where nobody does.

    Raises:
        InputFileError: It is no such file; names the line.
    """
    path = Path(path)
    try:
        with regular(path).open(encoding="utf-8") as file:
            return played_in(file, path)
    except UnicodeDecodeError as problem:
        raise InputFileError(path, "the file is no UTF-8 text", _EXPECTED) from problem
    except OSError as problem:
        raise InputFileError(
            path, Message("the file cannot be read ({strerror})", strerror=problem.strerror), _EXPECTED
        ) from problem


def played_in(texts: Iterable[str], path: Path) -> Played:
    """Return the game that such lines tell; `path` is where they come from, for errors.

    Raises:
        InputFileError: They tell none; names the line.
    """
    requests: list[tuple[GameRequest, list[Any]]] = []
    told: dict[str, Any] = {}
    for number, text in enumerate(texts, 1):
        line = _read_line(text, path, number)
        if number == 1 or not isinstance(line, dict):
            continue
        if "board" in line:
            requests.append((_read_request(line, path, number), line["board"]["snakes"]))
        elif "winnerId" in line:
            told = line
    if not requests:
        raise InputFileError(path, "no turn in it", _EXPECTED)
    boards = [request.board for request, _ in requests]
    sizes = {(board.width, board.height) for board in boards}
    if len(sizes) > 1:
        raise InputFileError(path, Message("boards of {count} sizes", count=len(sizes)), "one size all game long")
    _put_back(boards, _eliminations(told))
    first = requests[0][0]
    return Played(first.settings, _card(requests), boards)


def _read_line(text: str, path: Path, number: int) -> Any:
    if len(text) > MAX_LINE_BYTES:
        raise InputFileError(path, Message("{count} characters", count=len(text)), _EXPECTED, line=number)
    try:
        return json.loads(text)
    except (ValueError, RecursionError) as problem:
        raise InputFileError(path, str(problem)[:200], _EXPECTED, line=number) from problem


def _read_request(line: dict[str, Any], path: Path, number: int) -> GameRequest:
    try:
        return read_message(line)
    except BoardError as problem:
        raise InputFileError(path, str(problem)[:200], _EXPECTED, line=number) from problem


def _card(requests: list[tuple[GameRequest, list[Any]]]) -> GameCard:
    last = requests[-1][0]
    card = GameCard(last.game_id, last.timeout_ms)
    for _, snakes in requests:
        for part in snakes:
            card.names[part["id"]] = str(part.get("name") or part["id"])
            looks = part.get("customizations")
            card.appearances[part["id"]] = looks if isinstance(looks, dict) else {}
    return card


def _elimination(snake: Snake) -> dict[str, Any]:
    body = [{"x": x, "y": y} for x, y in snake.body]
    return {
        "id": snake.id, "cause": snake.cause, "by": snake.by, "turn": snake.on, "health": snake.health, "body": body,
    }  # fmt: skip


def _eliminations(document: dict[str, Any]) -> dict[str, Snake]:
    """Return how every snake lies of which our last line tells it; what is no such thing is passed over."""
    parts = document.get("eliminations")
    found = {}
    for part in parts if isinstance(parts, list) else []:
        try:
            body = [(int(point["x"]), int(point["y"])) for point in part["body"][:MAX_SEGMENTS]]
            cause, health = CAUSES[CAUSES.index(part["cause"])], max(0, min(int(part["health"]), MAX_HEALTH))
            if body and cause:
                found[part["id"]] = Snake(str(part["id"]), body, health, cause, str(part["by"]), int(part["turn"]))
        except (TypeError, KeyError, ValueError, IndexError, OverflowError):
            continue
    return found


def _put_back(boards: list[Board], eliminations: dict[str, Snake]) -> None:
    """Lay every snake that left where it died, or was seen last, in the order in which the snakes began."""
    seats = list(dict.fromkeys(snake.id for board in boards for snake in board.snakes))
    seen: dict[str, Snake] = {}
    for board in boards:
        here = {snake.id: snake for snake in board.snakes}
        for one, snake in seen.items():
            if one not in here and snake.alive:
                last = eliminations.get(one, Snake(one, snake.body, snake.health, UNKNOWN_CAUSE))
                seen[one] = replace(last, on=board.turn)
        seen |= here
        board.snakes = [seen[one] for one in seats if one in seen]
