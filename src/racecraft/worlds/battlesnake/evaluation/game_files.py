"""Games to verify, out of every file in which they are kept; what a file is shows in its first lines, not in its name.

    recorded      JSON Lines with `game`, `step` and `over` (`env/records.py`): moves and dice are told
    output        JSON Lines of `snakes play --output` and of the official `battlesnake play --output`, one game after
                  another
    log           one JSON object of a snake that kept what production sent it:
                  {"start_request": …, "moves": [[request, answer], …], "end_request": …}
    frames        what an engine tells of a game: the production engine, the board protocol, the arena of 2026
                  (`frame_files.py`)

Each may be gzipped. In the last three moves are read off the bodies (`transcript.py`); a snake's own log ends with its
death, and so does what can be verified of it.
"""

from __future__ import annotations

import gzip
import json
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from racecraft.contract.errors import InputFileError
from racecraft.contract.message import Message
from racecraft.formats.user_file import regular
from racecraft.worlds.battlesnake.env.board import BoardError
from racecraft.worlds.battlesnake.env.maps import MAPS
from racecraft.worlds.battlesnake.env.records import RecordedGame, read_games
from racecraft.worlds.battlesnake.env.rulesets import RULESETS
from racecraft.worlds.battlesnake.env.settings import GameSettings
from racecraft.worlds.battlesnake.env.verify import Report, verify_games
from racecraft.worlds.battlesnake.evaluation.frame_files import PIECES, Pieces, dead_snake, known
from racecraft.worlds.battlesnake.evaluation.transcript import Frame, recorded_game
from racecraft.worlds.battlesnake.players.living_snakes import LivingSnakes
from racecraft.worlds.battlesnake.players.messages import GameRequest, read_message

MAX_BYTES = 1 << 29
EXPECTED = (
    "a game from `snakes play --output` or the official `battlesnake play --output`, a snake's log of a production "
    "game, the production engine's frames, or recorded games as JSON Lines"
)


def verify_file(path: str | Path) -> Report:
    """Replay every game of a file by our rules.

    Raises:
        InputFileError: The file is none of those above; says where.
        BoardError: A game's ruleset, map or size is unknown.
    """
    return verify_games(games_of(Path(path)))


def games_of(path: Path) -> Iterator[RecordedGame]:
    """Yield the games of a file, in order. Raises what `verify_file` raises."""
    first, whole = _open(path)
    if isinstance(first, dict) and "t" in first:
        yield from read_games(path)
        return
    try:
        if isinstance(whole, dict) and "start_request" in whole:
            yield _from_log(whole)
        elif is_frames(first, whole):
            yield _from_pieces([path])
        else:
            yield from (_from_output(lines, path) for lines in _one_by_one(_lines(path)))
    except (KeyError, TypeError, ValueError, IndexError, AttributeError, OverflowError) as problem:
        raise InputFileError(
            path,
            Message("{type_name}: {problem}", type_name=type(problem).__name__, problem=str(problem)[:200]),
            EXPECTED,
        ) from problem


def games_in(paths: Sequence[Path]) -> list[RecordedGame]:
    """Return the games of a file, or the one game whose pieces several files of the production engine hold.

    Raises:
        InputFileError: A file is none of those above, or a piece is missing; says which.
        BoardError: A game's ruleset, map or size is unknown.
    """
    if len(paths) == 1:
        return list(games_of(paths[0]))
    try:
        return [_from_pieces(paths)]
    except (KeyError, TypeError, ValueError, IndexError, AttributeError, OverflowError) as problem:
        raise InputFileError(
            paths[-1],
            Message("{type_name}: {problem}", type_name=type(problem).__name__, problem=str(problem)[:200]),
            PIECES,
        ) from problem


def snake_names(path: Path) -> dict[str, str]:
    """Return the names of a file's snakes by id, where it tells any; of several games, those of the last."""
    names: dict[str, str] = {}
    waiting = values_in(path)
    while waiting:
        value = waiting.pop()
        if isinstance(value, list):
            waiting += value
        elif isinstance(value, dict):
            one, name = value.get("id", value.get("ID")), value.get("name", value.get("Name"))
            if name and ("body" in value or "Body" in value):
                names[str(one)] = str(name)
            else:
                waiting += value.values()
    return names


def is_output(path: Path) -> bool:
    """Tell whether a file is of the form that `snakes play --output` writes. Raises InputFileError: it is no JSON."""
    first, whole = _open(path)
    is_log = isinstance(whole, dict) and "start_request" in whole
    return not is_log and not is_frames(first, whole) and not (isinstance(first, dict) and "t" in first)


def values_in(path: Path) -> list[Any]:
    """Return the JSON value of a file, or of each of its lines. Raises InputFileError where there is none."""
    _, whole = _open(path)
    return [whole] if whole is not None else [value for _, value in _lines(path)]


def _open(path: Path) -> tuple[Any, Any]:
    """Return the value of the first line, and of the whole file where it is one value (else None)."""
    data = _read(path)
    text = data.strip()
    if not text:
        raise InputFileError(path, "no game in it", EXPECTED)
    line, further, _ = text.partition(b"\n")
    first = _value(line)
    whole = _value(text) if further else first
    if first is None and whole is None:
        raise InputFileError(path, "no JSON", EXPECTED, line=1)
    return first, whole


def _read(path: Path) -> bytes:
    try:
        with regular(path).open("rb") as file:
            zipped = file.read(2) == b"\x1f\x8b"
        with gzip.open(path) if zipped else open(path, "rb") as file:
            data = file.read(MAX_BYTES + 1)
    except (OSError, EOFError) as problem:
        found = getattr(problem, "strerror", None) or str(problem)
        raise InputFileError(path, Message("the file cannot be read ({found})", found=found), EXPECTED) from problem
    if len(data) > MAX_BYTES:
        raise InputFileError(path, Message("more than {most_bytes} MB", most_bytes=MAX_BYTES >> 20), EXPECTED)
    return data


def _value(text: bytes) -> Any:
    try:
        return json.loads(text)
    except (ValueError, RecursionError):
        return None


def _lines(path: Path) -> Iterator[tuple[int, Any]]:
    for number, text in enumerate(_read(path).splitlines(), 1):
        if text.strip():
            value = _value(text)
            if not isinstance(value, dict):
                raise InputFileError(path, "no JSON object", EXPECTED, line=number)
            yield number, value


def _one_by_one(lines: Iterable[tuple[int, Any]]) -> Iterator[list[tuple[int, Any]]]:
    """Yield the lines of each game of an output file: a game begins with its card, which is no turn and no verdict."""
    game: list[tuple[int, Any]] = []
    for number, line in lines:
        if game and "board" not in line and "winnerId" not in line and any("board" in one for _, one in game):
            yield game
            game = []
        game.append((number, line))
    yield game


def _from_output(lines: Sequence[tuple[int, Any]], path: Path) -> RecordedGame:
    """Read the official output file, or ours: ours tells how snakes died."""
    requests: list[GameRequest] = []
    end: dict[str, Any] = {}
    for number, line in lines:
        if "board" in line:
            try:
                requests.append(_request_in(line))
            except BoardError as problem:
                raise InputFileError(path, str(problem)[:200], EXPECTED, line=number) from problem
        elif "winnerId" in line:
            end = line
    if not requests:
        raise InputFileError(path, "no turn of a game in it", EXPECTED)
    frames = [Frame(request.board) for request in requests]
    for dead in end.get("eliminations", []):
        snake = dead_snake(dead["id"], dead["body"], "xy", dead["cause"], dead["turn"])
        for frame in frames:
            if frame.board.turn >= snake.on:
                frame.dead[snake.id] = snake
    over = bool(end.get("winnerId") or end.get("isDraw"))
    return recorded_game(_settings(requests[0]), frames, over, lines[0][0])


def _from_log(log: dict[str, Any]) -> RecordedGame:
    """Read what a snake kept of a production game; the arena of 2026 leaves the dead on its boards."""
    requests = [log["start_request"], *(pair[0] for pair in log["moves"])]
    if isinstance(log.get("end_request"), dict):
        requests.append(log["end_request"])
    if _keeps_dead(requests):
        living = LivingSnakes()
        requests = [living.only(request, asks=request is not log.get("end_request")) for request in requests]
    letters = [_request_in(request) for request in requests]
    letters.sort(key=lambda letter: letter.board.turn)
    return recorded_game(_settings(letters[0]), [Frame(letter.board) for letter in letters], "end_request" in log)


def _keeps_dead(requests: Sequence[dict[str, Any]]) -> bool:
    """Tell whether some snake's head stays on its square from one turn to the next, as only the dead do."""
    heads = [{part["id"]: part["body"][0] for part in request["board"]["snakes"]} for request in requests]
    return any(
        later["turn"] == sooner["turn"] + 1 and any(after.get(one) == head for one, head in before.items())
        for sooner, later, before, after in zip(requests, requests[1:], heads, heads[1:], strict=False)
    )


def is_frames(first: Any, whole: Any) -> bool:
    """Tell whether a file, of which these are the first line's value and the whole value, holds an engine's frames."""
    value = whole if isinstance(whole, dict) else first
    return isinstance(value, dict) and any(key in value for key in ("Game", "Type", "Frames", "frames"))


def _from_pieces(paths: Sequence[Path]) -> RecordedGame:
    """Put together what an engine tells of one game."""
    pieces = Pieces()
    for path in paths:
        values = values_in(path)
        if not any([isinstance(value, dict) and pieces.add(value, path) for value in values]):
            raise InputFileError(path, "neither 'Game' nor 'Frames'", PIECES)
    return pieces.recorded(paths[-1])


def _request_in(request: dict[str, Any]) -> GameRequest:
    """Read a request; a ruleset or map that we do not know is refused here: there would be nothing to verify by."""
    letter = read_message(request)
    known(str(request["game"].get("ruleset", {}).get("name", "standard")), RULESETS, "ruleset")
    known(str(request["game"].get("map") or "standard"), MAPS, "map")
    return letter


def _settings(first: GameRequest) -> GameSettings:
    return replace(first.settings, solo=True) if first.settings.players == 1 else first.settings
