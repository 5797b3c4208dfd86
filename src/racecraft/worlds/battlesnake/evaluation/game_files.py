"""Games to verify, out of every file in which they are kept; what a file is shows in its first lines, not in its name.

    recorded      JSON Lines with `game`, `step` and `over` (`env/records.py`): moves and dice are told
    output        JSON Lines of `snakes play --output` and of the official `battlesnake play --output`, one game after
                  another
    log           one JSON object of a snake that kept what production sent it:
                  {"start_request": …, "moves": [[request, answer], …], "end_request": …}
    frames        what the production engine and the board protocol tell of a game: one JSON object with `Game` and
                  `Frames`, or JSON Lines of events {"Type": "frame", "Data": …} (the `Game` is the first line, or
                  stands in the last event, "game_end"). The engine's own answers come in pieces, which `games_in` puts
                  together: {"Game": …, "LastFrame": …}, and pages {"Count": …, "Frames": [ … ]}

Each may be gzipped. In the last three moves are read off the bodies (`transcript.py`); a snake's own log ends with its
death, and so does what can be verified of it.
"""

from __future__ import annotations

import gzip
import json
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from racecraft.contract.errors import InputFileError, nearest
from racecraft.worlds.battlesnake.env.board import CAUSES, MAX_HEALTH, Board, BoardError, Point, Snake
from racecraft.worlds.battlesnake.env.maps import MAPS
from racecraft.worlds.battlesnake.env.records import RecordedGame, read_games
from racecraft.worlds.battlesnake.env.rulesets import RULESETS
from racecraft.worlds.battlesnake.env.settings import GameSettings
from racecraft.worlds.battlesnake.env.verify import Report, verify_games
from racecraft.worlds.battlesnake.evaluation.transcript import Frame, recorded_game
from racecraft.worlds.battlesnake.players.messages import Letter, read_message

MOST_BYTES = 1 << 29
FARTHEST = 1000
"""Squares from the origin; hazards and the dead may lie off the board."""
EXPECTED = (
    "a game from `snakes play --output` or the official `battlesnake play --output`, a snake's log of a production "
    "game, the production engine's frames, or recorded games as JSON Lines"
)

PIECES = (
    "the engine's answers for one game: {'Game': …} of /games/ID and one or more {'Frames': …} of /games/ID/frames, in "
    "one file or given together to `snakes import`"
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
        elif isinstance(whole, dict) and "Frames" in whole:
            yield _from_frames(whole.get("Game", {}), whole["Frames"], path)
        elif isinstance(first, dict) and ("Game" in first or "Type" in first):
            yield _from_events(_lines(path), path)
        else:
            yield from (_from_output(lines, path) for lines in _one_by_one(_lines(path)))
    except (KeyError, TypeError, ValueError, IndexError, AttributeError, OverflowError) as problem:
        raise InputFileError(path, f"{type(problem).__name__}: {str(problem)[:200]}", EXPECTED) from problem


def games_in(paths: Sequence[Path]) -> list[RecordedGame]:
    """Return the games of a file, or the one game whose pieces several files of the production engine hold.

    Raises:
        InputFileError: A file is none of those above, or a piece is missing; says which.
        BoardError: A game's ruleset, map or size is unknown.
    """
    if len(paths) == 1:
        return list(games_of(paths[0]))
    game: dict[str, Any] = {}
    frames: list[Any] = []
    for path in paths:
        _, whole = _open(path)
        if not isinstance(whole, dict) or not ("Game" in whole or "Frames" in whole):
            raise InputFileError(path, "neither 'Game' nor 'Frames'", PIECES)
        if isinstance(whole.get("Game"), dict):
            if game and game.get("ID") != whole["Game"].get("ID"):
                other = f"game '{whole['Game'].get('ID')!s:.60}' beside game '{game.get('ID')!s:.60}'"
                raise InputFileError(path, other, "pieces of one game")
            game = whole["Game"]
        if isinstance(whole.get("Frames"), list):
            frames += whole["Frames"]
    try:
        return [_from_frames(game, frames, paths[-1])]
    except (KeyError, TypeError, ValueError, IndexError, AttributeError, OverflowError) as problem:
        raise InputFileError(paths[-1], f"{type(problem).__name__}: {str(problem)[:200]}", PIECES) from problem


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
        with open(path, "rb") as file:
            zipped = file.read(2) == b"\x1f\x8b"
        with gzip.open(path) if zipped else open(path, "rb") as file:
            data = file.read(MOST_BYTES + 1)
    except (OSError, EOFError) as problem:
        found = getattr(problem, "strerror", None) or str(problem)
        raise InputFileError(path, f"the file cannot be read ({found})", EXPECTED) from problem
    if len(data) > MOST_BYTES:
        raise InputFileError(path, f"more than {MOST_BYTES >> 20} MB", EXPECTED)
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
    letters: list[Letter] = []
    end: dict[str, Any] = {}
    for number, line in lines:
        if "board" in line:
            try:
                letters.append(_letter(line))
            except BoardError as problem:
                raise InputFileError(path, str(problem)[:200], EXPECTED, line=number) from problem
        elif "winnerId" in line:
            end = line
    if not letters:
        raise InputFileError(path, "no turn of a game in it", EXPECTED)
    frames = [Frame(letter.board) for letter in letters]
    for dead in end.get("eliminations", []):
        snake = _dead(dead["id"], dead["body"], "xy", dead["cause"], dead["turn"])
        for frame in frames:
            if frame.board.turn >= snake.on:
                frame.dead[snake.id] = snake
    over = bool(end.get("winnerId") or end.get("isDraw"))
    return recorded_game(_settings(letters[0]), frames, over, lines[0][0])


def _from_log(log: dict[str, Any]) -> RecordedGame:
    """Read what a snake kept of a production game."""
    requests = [log["start_request"], *(pair[0] for pair in log["moves"])]
    if isinstance(log.get("end_request"), dict):
        requests.append(log["end_request"])
    letters = [_letter(request) for request in requests]
    letters.sort(key=lambda letter: letter.board.turn)
    return recorded_game(_settings(letters[0]), [Frame(letter.board) for letter in letters], "end_request" in log)


def _from_events(lines: Iterable[tuple[int, Any]], path: Path) -> RecordedGame:
    """Read the events of the board protocol."""
    game: dict[str, Any] = {}
    frames = []
    over = False
    for _, line in lines:
        if "Game" in line:
            game = line["Game"]
        elif line.get("Type") == "frame":
            frames.append(line["Data"])
        elif line.get("Type") == "game_end":
            over, game = True, game or line["Data"].get("game") or line["Data"]
    return _from_frames(game, frames, path, over)


def _from_frames(game: dict[str, Any], frames: list[Any], path: Path, over: bool | None = None) -> RecordedGame:
    """Read the engine's frames: every snake in every frame, the dead where and how they died."""
    if not frames or not game:
        raise InputFileError(path, "no frames" if game else "no Game that says size and rules", PIECES)
    rules = game.get("Ruleset") or {}
    name = str(game.get("RulesetName") or rules.get("name") or "standard")
    settings = GameSettings(
        width=int(game["Width"]), height=int(game["Height"]), players=len(frames[0]["Snakes"]),
        ruleset=_known(name, RULESETS, "ruleset"), map=_known(str(game.get("Map") or "standard"), MAPS, "map"),
        food_spawn_chance=int(rules.get("foodSpawnChance", 15)), minimum_food=int(rules.get("minimumFood", 1)),
        hazard_damage=int(rules.get("damagePerTurn", 14)), shrink_every=int(rules.get("shrinkEveryNTurns", 25)),
        solo=True if len(frames[0]["Snakes"]) == 1 else None,
    )  # fmt: skip
    read = sorted((_frame(frame, settings) for frame in frames), key=lambda frame: frame.board.turn)
    return recorded_game(settings, read, game.get("Status") == "complete" if over is None else over)


def _frame(data: dict[str, Any], settings: GameSettings) -> Frame:
    living, dead = [], {}
    for part in data["Snakes"]:
        death = part.get("Death")
        if death:
            cause, turn = death["Cause"], int(death.get("Turn") or 0)
            dead[part["ID"]] = _dead(part["ID"], part["Body"], "XY", cause, turn)
        else:
            living.append(Snake(str(part["ID"]), _points(part["Body"], "XY"), _health(part["Health"])))
    food, hazards = _points(data["Food"] or [], "XY"), Counter(_points(data["Hazards"] or [], "XY"))
    board = Board(settings.width, settings.height, int(data["Turn"]), living, food, hazards)
    for square in (*food, *(square for snake in living for square in snake.body)):
        if not board.holds(square):
            raise ValueError(f"food or a living snake at {square}; expected squares of the board")
    return Frame(board, dead)


def _dead(name: Any, body: Any, keys: str, cause: Any, turn: Any) -> Snake:
    if cause not in CAUSES or not cause:
        raise ValueError(f"cause {cause!r:.40}; expected one of {', '.join(CAUSES[1:])}")
    return Snake(str(name), _points(body, keys), 0, cause, "", int(turn))


def _points(parts: Any, keys: str) -> list[Point]:
    points = [(int(part[keys[0]]), int(part[keys[1]])) for part in parts]
    if any(abs(x) > FARTHEST or abs(y) > FARTHEST for x, y in points):
        raise ValueError(f"a square beyond {FARTHEST}")
    return points


def _health(value: Any) -> int:
    if not 0 <= int(value) <= MAX_HEALTH:
        raise ValueError(f"health {value}; expected 0 to {MAX_HEALTH}")
    return int(value)


def _letter(request: dict[str, Any]) -> Letter:
    """Read a request; a ruleset or map that we do not know is refused here: there would be nothing to verify by."""
    letter = read_message(request)
    _known(str(request["game"].get("ruleset", {}).get("name", "standard")), RULESETS, "ruleset")
    _known(str(request["game"].get("map") or "standard"), MAPS, "map")
    return letter


def _settings(first: Letter) -> GameSettings:
    return replace(first.settings, solo=True) if first.settings.players == 1 else first.settings


def _known(name: str, names: Iterable[str], what: str) -> str:
    if name not in names:
        raise BoardError(f"There is no {what} '{name[:40]}'. {nearest(name, list(names))}")
    return name
