"""Hold the referee and the kernel against recorded games: same start, same moves, every position compared.

A record fixes the dice: before each turn food and hazards are set to what it says, after the rules snakes, food and
hazards must agree, then the map's share is copied and must at least be possible: food where food may fall, hazards by
the map's schedule where no dice are in it. Royale's sides are read off the record; then they must explain every turn.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from racecraft.contract.world import Array
from racecraft.worlds.battlesnake.env import maps
from racecraft.worlds.battlesnake.env.board import MOVES, Board, Point, draw
from racecraft.worlds.battlesnake.env.dice import LoadedDice
from racecraft.worlds.battlesnake.env.kernels import columns as col
from racecraft.worlds.battlesnake.env.kernels.rules import apply_rules as kernel_apply_rules
from racecraft.worlds.battlesnake.env.layouts import layout
from racecraft.worlds.battlesnake.env.records import RecordedGame, RecordedStep, read_games
from racecraft.worlds.battlesnake.env.reference import apply_rules
from racecraft.worlds.battlesnake.env.rulesets import find_ruleset, is_over
from racecraft.worlds.battlesnake.env.stages import GameContext, default_move, outside_safe_zone
from racecraft.worlds.battlesnake.env.state import Games, allocate_games, get_board, params_of, put_board

_EXAMPLES = 3


@dataclass
class Report:
    """What came of a check."""

    games: int = 0
    steps: int = 0
    """Recorded turns replayed by both referee and kernel."""
    mismatches: int = 0
    """Differences found; one a turn and player (referee, kernel, map, ending)."""
    examples: list[str] = field(default_factory=list)
    """The first few, drawn as boards."""
    unread: list[str] = field(default_factory=list)
    """What could not be replayed, a sentence each."""

    @property
    def agrees(self) -> bool:
        """Whether nothing differed."""
        return self.mismatches == 0

    def to_dict(self) -> dict[str, Any]:
        """Return the report as plain JSON values."""
        return asdict(self)

    def differ(self, game: RecordedGame, turn: int, what: str, found: Board, expected: Board) -> None:
        """Note a difference."""
        self.mismatches += 1
        if len(self.examples) < _EXAMPLES:
            rules = f"{game.settings.ruleset} on {game.settings.map}"
            place = f"game at line {game.line} ({rules}), turn {turn}: {what}"
            self.examples.append(f"{place}\nrecorded:\n{board_text(expected)}\nours:\n{board_text(found)}")


def verify_records(path: str | Path) -> Report:
    """Replay every game of a recorded file.

    Args:
        path: JSON Lines as described in `records.py`, gzipped where the name ends in `.gz`.

    Raises:
        InputFileError: The file is not such a record.
        BoardError: A game's ruleset, map or size is unknown.
    """
    return verify_games(read_games(Path(path)))


def verify_games(games: Iterable[RecordedGame]) -> Report:
    """Replay games.

    Raises:
        BoardError: A game's ruleset, map or size is unknown.
    """
    report = Report()
    for game in games:
        report.games += 1
        report.steps += len(game.steps)
        if game.missing_turn is not None:
            where = f"game at line {game.line}: turn {game.missing_turn} is missing"
            report.unread.append(f"{where}; the turns after it were not verified")
        _replay(game, report)
    return report


def board_text(board: Board) -> str:
    """Return a board as text with a line for each snake."""
    lines = [draw(board)]
    for snake in board.snakes:
        end = f" {snake.cause} by {snake.by or 'nobody'} on {snake.on}" if snake.cause else ""
        lines.append(f"{snake.id}: health {snake.health}, length {len(snake.body)}, head {snake.head}{end}")
    return "\n".join(lines)


def _replay(game: RecordedGame, report: Report) -> None:
    sides = _sides_seen(game)
    rules, table = find_ruleset(game.settings.ruleset), GameContext(game.settings, sides)
    games, params = allocate_games(game.settings, 1), params_of(game.settings)
    map_state = maps.MapState(_plan(game), sides)
    put_board(games, 0, game.start, map_state)
    ids = [snake.id for snake in game.start.snakes]
    for step in game.steps:
        turn = step.before.turn
        ours = step.before.copy()
        apply_rules(rules, ours, step.moves, table)
        if not _same(ours, step.after_rules):
            report.differ(game, turn, "referee", ours, step.after_rules)
        theirs = _kernel_turn(games, params, step, ids, game)
        if not _same(theirs, step.after_rules):
            report.differ(game, turn, "kernel", theirs, step.after_rules)
        _check_map(game, step, map_state, report)
        if is_over(step.before, game.settings):
            report.differ(game, turn, "the game was over before this turn", step.before, step.before)
        put_board(games, 0, step.after_map, map_state)
    last = game.steps[-1].after_map if game.steps else game.start
    if game.over_turn is not None and (last.turn != game.over_turn or not is_over(last, game.settings)):
        report.differ(game, last.turn, f"the record is over at turn {game.over_turn}", last, last)


def _kernel_turn(games: Games, params: Array, step: RecordedStep, ids: list[str], game: RecordedGame) -> Board:
    moves = np.zeros((1, len(ids)), np.int64)
    for number, snake in enumerate(step.before.snakes[: len(ids)]):
        word = step.moves.get(snake.id, "")
        if word not in MOVES:
            word = default_move(snake.body, game.settings.width, game.settings.height)
        moves[0, number] = MOVES.index(word)
    games.games[0, col.NEXT_EVENT] = 1  # the map may have laid hazards, which royale's rule then lays anew
    kernel_apply_rules(0, moves, games.bodies, games.snakes, games.games, games.cells, games.sides, params)
    return get_board(games, 0, game.settings, ids)


def _same(ours: Board, recorded: Board) -> bool:
    same_food = sorted(ours.food) == sorted(recorded.food)
    return ours.snakes == recorded.snakes and same_food and ours.hazards == recorded.hazards


def _check_map(game: RecordedGame, step: RecordedStep, state: maps.MapState, report: Report) -> None:
    """Look whether what the map did is possible."""
    settings, rules_board = game.settings, step.after_rules
    chosen = maps.find_map(settings.map)
    if chosen.hazards == "maze":
        return
    fallen = set(step.after_map.food) - set(rules_board.food)
    places: set[Point] = set(rules_board.free_squares(spare_hazards=chosen.food == "off hazards"))
    if chosen.food in ("arcade", "castle"):
        places = set(layout(chosen.id).food)
    if chosen.food == "none":
        places = set()
    if not fallen <= places:
        report.differ(game, rules_board.turn, f"food fell on {sorted(fallen - places)}", rules_board, step.after_map)
    if not chosen.has_dice:
        ours = rules_board.copy()
        still = maps.MapState(state.plan, state.sides)
        maps.move_hazards(ours, settings, still)
        if ours.hazards != step.after_map.hazards:
            report.differ(game, rules_board.turn, "the map's hazards", ours, step.after_map)


def _plan(game: RecordedGame) -> maps.Plan:
    chosen = maps.find_map(game.settings.map)
    return maps.Plan() if chosen.has_dice else chosen.plan(game.settings, LoadedDice())


def _sides_seen(game: RecordedGame) -> list[int]:
    """Read royale's sides off the record: at each shrink, the side that explains the new hazards."""
    settings = game.settings
    royale_rules = settings.ruleset == "royale"
    if not royale_rules and maps.find_map(settings.map).hazards != "royale":
        return []
    sides: list[int] = []
    for step in game.steps:
        if settings.shrink_every < 1 or (step.before.turn + 1) % settings.shrink_every:
            continue
        seen = (step.after_rules if royale_rules else step.after_map).hazards
        if len(sides) == settings.width + settings.height:
            break  # a game draws no more: nothing is left to close in on
        fits = [side for side in range(4) if outside_safe_zone(step.before, [*sides, side]) == seen]
        sides.append(fits[0] if fits else 0)
    return sides
