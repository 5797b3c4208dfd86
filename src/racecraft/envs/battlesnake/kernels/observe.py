"""What a snake sees, compiled: planes centred on its head, a few numbers, and the moves that are not surely fatal.

The one observation of the room: `world.py` calls it for many games, `observation.py` for one board.
"""

from __future__ import annotations

from racecraft.envs.battlesnake.kernels.columns import (
    ALIVE,
    CAUSE,
    DAMAGE,
    FOOD,
    HAZARD,
    HEALTH,
    HEIGHT,
    LENGTH,
    MEAL,
    OWNER,
    START,
    WIDTH,
    WRAPPED,
    X,
    Y,
)
from racecraft.kernels import inner_kernel, kernel

OWN_BODY = 0
OTHER_BODIES = 1
STRONGER_HEADS = 2
WEAKER_HEADS = 3
HEALTHS = 4
MEALS = 5
HAZARDS = 6
WALLS = 7
NUM_PLANES = 8
BODIES = 16
NUM_NUMBERS = 6


@kernel
def mark(g, bodies, snakes, cells, params, squares, marks):
    """List everything that lies on the board of game g, once for all who look.

    `marks` int16 (N, K, 4): x, y, value, plane; for a body the plane is BODIES + its snake. Tails come before heads, so
    that the segment that stays longest is painted last. Row 0 holds the number of rows.
    """
    last, count = bodies.shape[2] - 1, 0
    for cell in range(cells.shape[2]):
        if cells[g, MEAL, cell] or cells[g, HAZARD, cell]:
            if cells[g, MEAL, cell]:
                count += 1
                _note(g, count, marks, squares[cell, 0], squares[cell, 1], 255, MEALS)
            if cells[g, HAZARD, cell]:
                harm = min(255, 5 * abs(params[DAMAGE]) * cells[g, HAZARD, cell] // 2)
                count += 1
                _note(g, count, marks, squares[cell, 0], squares[cell, 1], harm, HAZARDS)
    for s in range(snakes.shape[1]):
        if snakes[g, s, CAUSE]:
            continue
        start, length = snakes[g, s, START], snakes[g, s, LENGTH]
        for place in range(length - 1, -1, -1):
            cell = bodies[g, s, (start + place) & last]
            count += 1
            marks[g, count, 0], marks[g, count, 1] = squares[cell, 0], squares[cell, 1]
            marks[g, count, 2], marks[g, count, 3] = min(255, 8 * (length - place)), BODIES + s
        count += 1
        _note(g, count, marks, snakes[g, s, X], snakes[g, s, Y], 5 * snakes[g, s, HEALTH] // 2, HEALTHS)
    marks[g, 0, 0] = count


@inner_kernel
def observe(g, m, snakes, games, params, marks, walls, planes, numbers):
    """Write what snake m of game g sees; a snake that is out sees nothing.

    Args:
        g: Game.
        m: Snake.
        snakes: See `state.Games`, as is `games`.
        games: See above.
        params: Settings, see `columns.py`.
        marks: See `mark`.
        walls: uint8 (C, V * V): the plane of walls for every square the head may be on.
        planes: uint8 (N, M, 8, V, V), row (g, m) written, all zero before; row 0 is the top of the window.
        numbers: float32 (N, M, 6), row (g, m) written.
    """
    for number in range(NUM_NUMBERS):
        numbers[g, m, number] = 0
    if snakes[g, m, CAUSE]:
        return
    side, width, height = planes.shape[3], params[WIDTH], params[HEIGHT]
    right, down = side // 2 - snakes[g, m, X], side // 2 + snakes[g, m, Y]
    if params[WRAPPED] == 0:
        _copy(walls[snakes[g, m, Y] * width + snakes[g, m, X]], planes[g, m, WALLS].reshape(-1))
    for number in range(1, marks[g, 0, 0] + 1):
        column, row = right + marks[g, number, 0], down - marks[g, number, 1]
        value, plane = marks[g, number, 2], marks[g, number, 3]
        if plane >= BODIES:
            plane = OWN_BODY if plane == BODIES + m else OTHER_BODIES
        if params[WRAPPED]:
            for r in range(row % height, side, height):
                for c in range(column % width, side, width):
                    planes[g, m, plane, r, c] = value
        elif column >= 0 and column < side and row >= 0 and row < side:
            planes[g, m, plane, row, column] = value
    _paint_heads(g, m, right, down, snakes, params, planes)
    _count(g, m, snakes, games, params, numbers)


@inner_kernel
def allow(g, m, bodies, snakes, cells, params, mask):
    """Write which moves of snake m are not surely fatal into `mask[g, m]`, bool (N, M, 4).

    All of them where none is, or where the snake is out.

    Surely fatal: a wall, and a body that will not have moved away (a tail does, unless it is doubled).
    """
    width, height, last = params[WIDTH], params[HEIGHT], bodies.shape[2] - 1
    head_x, head_y, wrapped = snakes[g, m, X], snakes[g, m, Y], params[WRAPPED]
    allowed = 0
    for way in range(4):
        x = head_x + (way == 3) - (way == 2)
        y = head_y + (way == 0) - (way == 1)
        if wrapped:
            x = x - width if x >= width else x + width if x < 0 else x
            y = y - height if y >= height else y + height if y < 0 else y
        free = False
        if 0 <= x < width and 0 <= y < height:
            cell = y * width + x
            owner = cells[g, OWNER, cell] - 1
            free = owner < 0
            if owner >= 0:
                end = snakes[g, owner, START] + snakes[g, owner, LENGTH]
                tail, before = bodies[g, owner, (end - 1) & last], bodies[g, owner, (end - 2) & last]
                free = tail == cell and before != cell
        mask[g, m, way] = free
        allowed += free
    if allowed == 0 or snakes[g, m, CAUSE]:
        mask[g, m, :] = True


@inner_kernel
def _note(g, row, marks, x, y, value, plane):
    marks[g, row, 0], marks[g, row, 1], marks[g, row, 2], marks[g, row, 3] = x, y, value, plane


@inner_kernel
def _copy(source, target):
    """Copy byte by byte, which compiles to one block move (a slice assignment does not)."""
    for place in range(target.size):
        target[place] = source[place]


@inner_kernel
def _paint_heads(g, m, right, down, snakes, params, planes):
    """Mark the others' heads by whether they would survive a meeting."""
    side = planes.shape[3]
    for s in range(snakes.shape[1]):
        if s == m or snakes[g, s, CAUSE]:
            continue
        lead = snakes[g, s, LENGTH] - snakes[g, m, LENGTH]
        plane = STRONGER_HEADS if lead >= 0 else WEAKER_HEADS
        value = min(255, 127 + 16 * abs(lead))
        column, row = right + snakes[g, s, X], down - snakes[g, s, Y]
        if params[WRAPPED]:
            for r in range(row % params[HEIGHT], side, params[HEIGHT]):
                for c in range(column % params[WIDTH], side, params[WIDTH]):
                    planes[g, m, plane, r, c] = value
        elif column >= 0 and column < side and row >= 0 and row < side:
            planes[g, m, plane, row, column] = value


@inner_kernel
def _count(g, m, snakes, games, params, numbers):
    longest = 0
    for s in range(snakes.shape[1]):
        if s != m and snakes[g, s, CAUSE] == 0:
            longest = max(longest, snakes[g, s, LENGTH])
    area, length = params[WIDTH] * params[HEIGHT], snakes[g, m, LENGTH]
    numbers[g, m, 0] = snakes[g, m, HEALTH] / 100.0
    numbers[g, m, 1] = min(1.0, length / area)
    numbers[g, m, 2] = max(-1.0, min(1.0, (length - longest) / 10.0)) if longest else 1.0
    numbers[g, m, 3] = (games[g, ALIVE] - 1) / 16.0
    numbers[g, m, 4] = min(1.0, games[g, FOOD] / 16.0)
    numbers[g, m, 5] = max(-1.0, min(1.0, params[DAMAGE] / 100.0))
