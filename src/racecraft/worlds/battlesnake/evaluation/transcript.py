"""From the positions of a game, one a turn, to a game that can be replayed: moves are read off the bodies.

Who lives on shows its move by its new head. Who left is seldom shown where it died, so its move is looked for: one that
makes the rules tell the next position as it was. There being none is a difference, and is reported as such. In
solo_maze a meal is followed by another maze with another snake in it, and food runs away: that turn's own end, and that
food, are not kept, nor verified.
"""

from __future__ import annotations

import itertools
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, field, replace

from racecraft.worlds.battlesnake.env.board import MOVES, STEPS, Board, Point, Snake
from racecraft.worlds.battlesnake.env.maps import find_map
from racecraft.worlds.battlesnake.env.records import RecordedGame, RecordedStep
from racecraft.worlds.battlesnake.env.reference import apply_rules
from racecraft.worlds.battlesnake.env.rulesets import find_ruleset, is_over
from racecraft.worlds.battlesnake.env.settings import GameSettings
from racecraft.worlds.battlesnake.env.stages import GameContext, outside_safe_zone

MAX_GUESSES = 4096
"""Combinations of moves tried for those who left in one turn: six snakes."""
_ANY_SIDES = [0] * 1000
"""Royale's hazards come after the snakes have moved, so they do not matter for guessing moves."""


@dataclass
class Frame:
    """One position of a game as it was kept."""

    board: Board
    """The living snakes, food and hazards."""
    dead: dict[str, Snake] = field(default_factory=dict)
    """What is told of those who left, by id."""


def recorded_game(settings: GameSettings, frames: Sequence[Frame], over: bool, line: int = 1) -> RecordedGame:
    """Return a game to replay, up to the first gap between turns.

    Args:
        settings: What was played.
        frames: Positions in the order of their turns, from the first.
        over: Whether the last frame is the game's end.
        line: Where the game begins in its file.
    """
    game = RecordedGame(line, settings, frames[0].board.copy())
    whole = True
    zones = _royale_zones(settings, frames)
    for frame in frames[1:]:
        last = game.steps[-1].after_map if game.steps else game.start
        if frame.board.turn == last.turn:
            continue
        if frame.board.turn != last.turn + 1:
            whole, game.missing_turn = False, last.turn + 1
            break
        if is_over(last, settings) and _bodies(frame.board) == _bodies(last):
            break  # the official program counts one turn more when the game is decided
        game.steps.append(_step(settings, last, frame, zones.get(frame.board.turn)))
    last = game.steps[-1].after_map if game.steps else game.start
    game.over_turn = last.turn if over and whole else None
    return game


def _royale_zones(settings: GameSettings, frames: Sequence[Frame]) -> dict[int, Counter[Point]]:
    """Return what the ruleset royale lays on each turn, by the turn of its frame; empty for other rulesets.

    A map may lay hazards of its own on top, so a side has closed in where all its squares are hazards.
    """
    if settings.ruleset != "royale" or settings.shrink_every < 1:
        return {}
    sides: list[int] = []
    zones = {}
    for board in (frame.board for frame in frames):
        while len(sides) < min(board.turn // settings.shrink_every, board.width + board.height):
            zones_by_side = {side: outside_safe_zone(board, [*sides, side]) for side in range(4)}
            fits = [side for side, zone in zones_by_side.items() if zone <= board.hazards]
            sides.append(max(fits, key=lambda side: zones_by_side[side].total(), default=0))
        zones[board.turn] = outside_safe_zone(board, sides)
    return zones


def _step(settings: GameSettings, before: Board, frame: Frame, zone: Counter[Point] | None) -> RecordedStep:
    """Return the turn that leads from one position to the next; `zone` is what royale's rule lays on it."""
    rebuilds = find_map(settings.map).hazards == "maze"
    known = {snake.id: "" if rebuilds else _move_to(snake, frame, settings) for snake in before.alive()}
    guessed = [name for name, word in known.items() if not word]
    best: RecordedStep | None = None
    least = (True, 0, 0)
    for guess in itertools.islice(itertools.product(MOVES, repeat=len(guessed)), MAX_GUESSES):
        moves = known | dict(zip(guessed, guess, strict=True))
        ours = before.copy()
        apply_rules(find_ruleset(settings.ruleset), ours, moves, GameContext(settings, _ANY_SIDES))
        if rebuilds and len(ours.food) < len(before.food):
            return RecordedStep(moves, before.copy(), ours, _after_map(before, frame.board.snakes, frame))
        step = _completed(settings, before, ours, moves, frame, zone)
        differs = _difference(step, ours, frame)
        if best is None or differs < least:
            best, least = step, differs
        if least == (False, 0, 0):
            break
    assert best is not None
    return best


def _difference(step: RecordedStep, ours: Board, frame: Frame) -> tuple[bool, int, int]:
    """Return how badly a guess explains a turn: other snakes, food that is gone though nobody ate it, new food."""
    left, theirs = set(ours.food), set(frame.board.food)
    return step.after_rules.snakes != ours.snakes, len(left - theirs), len(theirs - left)


def _completed(
    settings: GameSettings,
    before: Board,
    ours: Board,
    moves: dict[str, str],
    frame: Frame,
    zone: Counter[Point] | None,
) -> RecordedStep:
    """Return a turn as the file tells it, with what it does not tell as the rules have it."""
    alive = {snake.id: snake for snake in frame.board.snakes}
    snakes = []
    for snake in ours.snakes:
        if snake.id in alive:
            snakes.append(alive[snake.id])
        elif snake.alive:  # it left, and by our rules would not have
            snakes.append(frame.dead.get(snake.id, replace(snake, cause="snake-collision", on=frame.board.turn)))
        elif snake.id in frame.dead:
            death = frame.dead[snake.id]
            snakes.append(replace(snake, cause=death.cause or snake.cause, on=death.on or snake.on))
        else:
            snakes.append(snake)
    runs_away = find_map(settings.map).hazards == "maze"
    left = [point for point in ours.food if runs_away or point in frame.board.food]
    hazards = ours.hazards if zone is None else zone
    after_rules = Board(before.width, before.height, before.turn, snakes, left, hazards.copy())
    return RecordedStep(moves, before.copy(), after_rules, _after_map(before, snakes, frame))


def _after_map(before: Board, snakes: Sequence[Snake], frame: Frame) -> Board:
    """Return the next position with all its snakes, the dead too."""
    board, bodies = frame.board, [replace(snake) for snake in snakes]
    return Board(before.width, before.height, board.turn, bodies, list(board.food), board.hazards.copy())


def _move_to(snake: Snake, frame: Frame, settings: GameSettings) -> str:
    """Return the word of the move that leads a snake to its next head; "" where that is not told."""
    later = next((one for one in frame.board.snakes if one.id == snake.id), frame.dead.get(snake.id))
    if later is None or not later.body:
        return ""
    x, y = snake.head
    wraps = settings.ruleset.startswith("wrapped")
    for word, (dx, dy) in zip(MOVES, STEPS, strict=True):
        square = (x + dx, y + dy)
        if wraps:
            square = (square[0] % settings.width, square[1] % settings.height)
        if square == later.head:
            return word
    return ""


def _bodies(board: Board) -> dict[str, list[tuple[int, int]]]:
    return {snake.id: snake.body for snake in board.alive()}
