"""solo_maze: a maze of hazards for one snake; every food eaten builds the next and larger one (facts: A.9).

The maze is a recursive division: a wall with one gap across a chamber, then the same in both halves. Which walls fall
where is our own; frame, growth, start, level notes and the food that runs away are as recorded.
"""

from __future__ import annotations

from collections import Counter

from racecraft.worlds.battlesnake.env.board import MAX_HEALTH, START_LENGTH, Board, Point
from racecraft.worlds.battlesnake.env.dice import Dice

_LEVEL_BITS = 16
_SHY_FROM_LEVEL = 5
_SHY_DISTANCE = 4


def build_level(board: Board, level: int, dice: Dice) -> None:
    """Lay a maze, put the snake at its lower left with one segment for every level, and the food somewhere inside."""
    side = min(7 + level, board.width, board.height - 2)
    left, bottom = (board.width - side) // 2, (board.height - side) // 2
    inside = {(left + x, bottom + y) for y in range(side) for x in range(side)}
    walls: set[Point] = set()
    _divide(walls, (left, bottom, left + side, bottom + side), dice)
    head = (left, bottom)
    outside = [p for p in board.squares() if p[1] > 0 and p not in inside]
    board.hazards = Counter([*outside, *walls, *_level_notes(board, level)])
    snake = board.snakes[0]
    snake.body = [head, *[(head[0], head[1] - 1)] * (START_LENGTH + level - 1)]
    snake.health = MAX_HEALTH
    places = sorted(_reachable(inside - walls, head) - {head})
    board.food = [places[dice.below(len(places))]]


def level_of(board: Board) -> int:
    """Read the level from its notes in the bottom row: the hazards there, from the right, are its binary digits."""
    right = board.width - 1
    return sum(1 << bit for bit in range(min(_LEVEL_BITS, board.width)) if board.hazards[(right - bit, 0)])


def after_turn(board: Board, dice: Dice) -> None:
    """Build the next level once the food is eaten; on late levels let the food run from a head that comes near."""
    if not board.snakes[0].alive:
        return
    if not board.food:
        build_level(board, level_of(board) + 1, dice)
        return
    (x, y), head = board.food[0], board.snakes[0].head
    if level_of(board) >= _SHY_FROM_LEVEL and abs(x - head[0]) + abs(y - head[1]) <= _SHY_DISTANCE:
        places = [p for p in board.free_squares(spare_hazards=True) if p[1] > 0]
        board.food = [places[dice.below(len(places))]] if places else board.food


def _level_notes(board: Board, level: int) -> list[Point]:
    return [(board.width - 1 - bit, 0) for bit in range(min(_LEVEL_BITS, board.width)) if level >> bit & 1]


def _divide(walls: set[Point], room: tuple[int, int, int, int], dice: Dice) -> None:
    """Cut a chamber (left, bottom, right, top; the last two beyond it) in two, leave a gap, go on in both halves."""
    left, bottom, right, top = room
    width, height = right - left, top - bottom
    if max(width, height) < 3 or min(width, height) < 2:
        return
    if width > height or (width == height and dice.below(2)):
        x = left + 1 + dice.below(width - 2)
        gap = bottom + dice.below(height)
        walls.update((x, y) for y in range(bottom, top) if y != gap)
        halves = ((left, bottom, x, top), (x + 1, bottom, right, top))
        doors = ((x - 1, gap), (x + 1, gap))
    else:
        y = bottom + 1 + dice.below(height - 2)
        gap = left + dice.below(width)
        walls.update((x, y) for x in range(left, right) if x != gap)
        halves = ((left, bottom, right, y), (left, y + 1, right, top))
        doors = ((gap, y - 1), (gap, y + 1))
    for half in halves:
        _divide(walls, half, dice)
    walls.difference_update(doors)


def _reachable(floor: set[Point], start: Point) -> set[Point]:
    seen, edge = {start}, [start]
    while edge:
        x, y = edge.pop()
        for point in ((x + 1, y), (x - 1, y), (x, y + 1), (x, y - 1)):
            if point in floor and point not in seen:
                seen.add(point)
                edge.append(point)
    return seen
