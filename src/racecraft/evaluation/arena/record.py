"""The output file of the official `battlesnake play`: JSON Lines, both ways (facts: A.11).

The first line is the game, then comes one whole message a turn, from 0 to the last (its `you` does not matter), then
`{"winnerId", "winnerName", "isDraw"}`.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from racecraft.contract.errors import InputFileError
from racecraft.envs.battlesnake.board import Board, BoardError
from racecraft.envs.battlesnake.rulesets import is_over
from racecraft.envs.battlesnake.settings import GameSettings
from racecraft.evaluation.arena.match import Played
from racecraft.formats.whole import write_whole
from racecraft.players.snakes.messages import GameCard, game_part, message, read_message

MOST_LINE_BYTES = 1 << 22


def write_record(played: Played, path: str | Path) -> None:
    """Write a game that was played, whole or not at all."""
    lines: list[dict[str, Any]] = [game_part(played.card, played.settings)]
    for board in played.boards:
        you = (board.alive() or board.snakes)[0].id
        lines.append(message(board, played.settings, you, played.card))
    lines.append(verdict(played))
    write_whole(path, "".join(json.dumps(line, separators=(",", ":")) + "\n" for line in lines))


def verdict(played: Played) -> dict[str, Any]:
    """Return who won: the last line of the file."""
    nobody_left = not played.boards[-1].alive()
    solo = not is_over(Board(1, 1, snakes=played.boards[0].snakes[:1]), played.settings)
    winner = played.winner
    return {
        "winnerId": winner,
        "winnerName": played.card.names.get(winner, ""),
        "isDraw": nobody_left and not solo,
    }


def read_record(path: str | Path) -> Played:
    """Read such a file; also one of the official engine. Eliminated snakes are no longer on its boards.

    Raises:
        InputFileError: It is no such file; names the line.
    """
    path = Path(path)
    expected = "the output file of `snakes play --output`"
    boards: list[Board] = []
    settings: GameSettings | None = None
    card = GameCard("")
    try:
        with open(path, encoding="utf-8") as file:
            for number, text in enumerate(file, 1):
                if len(text) > MOST_LINE_BYTES:
                    raise InputFileError(path, f"{len(text)} characters", expected, line=number)
                try:
                    line = json.loads(text)
                    if number == 1 or not isinstance(line, dict) or "board" not in line:
                        continue
                    letter = read_message(line)
                except (ValueError, RecursionError, BoardError) as problem:
                    raise InputFileError(path, str(problem)[:200], expected, line=number) from problem
                settings = settings or letter.settings
                card.id, card.timeout_ms = letter.game_id, letter.timeout_ms
                for part in line["board"]["snakes"]:
                    card.names[part["id"]] = str(part.get("name") or part["id"])
                    looks = part.get("customizations")
                    card.looks[part["id"]] = looks if isinstance(looks, dict) else {}
                boards.append(letter.board)
    except (OSError, UnicodeDecodeError) as problem:
        raise InputFileError(path, str(problem)[:200], expected) from problem
    if settings is None:
        raise InputFileError(path, "no turn in it", expected)
    return Played(settings, card, boards)
