"""A game that was played elsewhere as a game of ours: to watch, to film, to study, to keep.

Positions, deaths and moves are read by `game_files.py`; here comes what a game is shown with: names, colours, the time
for an answer.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from racecraft.contract.errors import InputFileError
from racecraft.contract.message import Message
from racecraft.worlds.battlesnake.env.verify import verify_games
from racecraft.worlds.battlesnake.evaluation.game_files import games_in, is_output, values_in
from racecraft.worlds.battlesnake.evaluation.match import Played
from racecraft.worlds.battlesnake.evaluation.record import read_record
from racecraft.worlds.battlesnake.players.messages import LOOKS, GameCard

_FRAME_LOOKS = {"Color": "color", "HeadType": "head", "TailType": "tail"}


@dataclass(frozen=True)
class Imported:
    """A game that was read."""

    played: Played
    mismatches: int
    """Turns that our rules would have told otherwise, and player; see `verify.Report`."""


def import_game(paths: Sequence[Path], number: int | None = None) -> Imported:
    """Read one game out of a file, or out of the pieces of the production engine.

    Args:
        paths: One file of any kind that `game_files.py` lists, or the engine's pieces of one game.
        number: Which game of a file that holds several, from 1; None: the only one.

    Raises:
        InputFileError: No such file, game or number; names the file.
        BoardError: A ruleset, map or size that is unknown.
    """
    games = games_in(paths)
    if number is None and len(games) > 1:
        raise InputFileError(
            paths[0],
            Message("{count} games", count=len(games)),
            Message("one, or --game with a number from 1 to {count}", count=len(games)),
        )
    chosen = 1 if number is None else number
    if not 1 <= chosen <= len(games):
        held = f"{len(games)} game" + "s" * (len(games) != 1)
        raise InputFileError(
            paths[0],
            Message("{held}, no number {chosen}", held=held, chosen=chosen),
            Message("--game from 1 to {count}", count=len(games)),
        )
    game = games[chosen - 1]
    boards = [game.start, *(step.after_map for step in game.steps)]
    card = _card(paths, [snake.id for snake in game.start.snakes])
    return Imported(Played(game.settings, card, boards, game.over_turn is not None), verify_games([game]).mismatches)


def read_game(path: Path) -> Played:
    """Return the one game of a file: of `snakes play --output`, or of any other kind that `import_game` reads.

    Raises:
        InputFileError: It is no such file, or holds several games; names the line where there is one.
        BoardError: A ruleset, map or size that is unknown.
    """
    return read_record(path) if is_output(path) else import_game([path]).played


def _card(paths: Sequence[Path], ids: Sequence[str]) -> GameCard:
    """Return what the files tell of a game beside its positions; what they do not tell is as ours has it."""
    card = GameCard(paths[0].name.split(".")[0], names={one: one for one in ids}, appearances={one: {} for one in ids})
    for said in _objects(paths):
        one, name = str(said.get("id", said.get("ID", ""))), said.get("name", said.get("Name"))
        if one in card.names and ("body" in said or "Body" in said):
            card.names[one] = str(name or card.names[one])
            looks = said.get("customizations")
            looks = looks if isinstance(looks, dict) else {ours: said.get(key) for key, ours in _FRAME_LOOKS.items()}
            card.appearances[one] = {key: text for key in LOOKS if isinstance(text := looks.get(key), str) and text}
        elif "Width" in said or "ruleset" in said or "game_type" in said:
            card.id, card.source = one or card.id, str(said.get("source", said.get("Source")) or "")
            timeout = said.get("timeout", said.get("SnakeTimeout"))
            card.timeout_ms = timeout if isinstance(timeout, int) and timeout > 0 else card.timeout_ms
    return card


def _objects(paths: Sequence[Path]) -> Iterator[dict[str, Any]]:
    """Yield every JSON object of the files, however deep it lies."""
    waiting = [value for path in paths for value in values_in(path)]
    while waiting:
        value = waiting.pop()
        if isinstance(value, dict):
            yield value
            waiting += value.values()
        elif isinstance(value, list):
            waiting += value
