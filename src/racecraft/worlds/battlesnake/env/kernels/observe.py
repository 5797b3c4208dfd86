"""What a snake sees, compiled: planes centred on its head, a few numbers, and the moves that are not surely fatal.

The one observation of the room: `world.py` calls it for many games, `observation.py` for one board.
"""

from __future__ import annotations

from racecraft.kernels import inner_kernel
from racecraft.worlds.battlesnake.env.kernels.columns import (
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

OWN_BODY = 0
OTHER_BODIES = 1
STRONGER_HEADS = 2
WEAKER_HEADS = 3
HEALTHS = 4
MEALS = 5
HAZARDS = 6
WALLS = 7
NUM_PLANES = 8
NUM_NUMBERS = 6


@inner_kernel
def mark(g, bodies, snakes, games, cells, params, squares, marks):
    """List everything that lies on the board of game g, once for all who look.

    `marks` int32 (K, 2): a place (plane, y and x, ten bits each) and a value. After a row for the game and one for each
    snake come food, hazards and healths, then body after body, shown on the plane of the others'; tails come before
    heads, so that the segment that stays longest is painted last. The first row holds the row after the healths, each
    snake's own row the row after its body.
    """
    last, count = bodies.shape[2] - 1, snakes.shape[1] + 1
    left = games[g, FOOD]
    for cell in range(cells.shape[2]):
        if left == 0:
            break
        if cells[g, MEAL, cell]:
            marks[count, 0], marks[count, 1] = _place(squares[cell, 0], squares[cell, 1], MEALS), 255
            count += 1
            left -= 1
    stacked = 0
    for cell in range(cells.shape[2]):
        stacked |= cells[g, HAZARD, cell]
    if stacked:
        for cell in range(cells.shape[2]):
            if cells[g, HAZARD, cell]:
                marks[count, 0] = _place(squares[cell, 0], squares[cell, 1], HAZARDS)
                marks[count, 1] = hazard_value(cells[g, HAZARD, cell], params[DAMAGE])
                count += 1
    for s in range(snakes.shape[1]):
        if snakes[g, s, CAUSE] == 0:
            marks[count, 0] = _place(snakes[g, s, X], snakes[g, s, Y], HEALTHS)
            marks[count, 1] = health_value(snakes[g, s, HEALTH])
            count += 1
    marks[0, 0] = count
    for s in range(snakes.shape[1]):
        if snakes[g, s, CAUSE] == 0:
            end, length = snakes[g, s, START] + snakes[g, s, LENGTH] - 1, snakes[g, s, LENGTH]
            for turns in range(1, length + 1):
                cell = bodies[g, s, (end + 1 - turns) & last]
                marks[count, 0] = _place(squares[cell, 0], squares[cell, 1], OTHER_BODIES)
                marks[count, 1] = body_value(turns)
                count += 1
        marks[1 + s, 0] = count


@inner_kernel
def body_value(turns):
    """Return what a square shows that clears in so many turns."""
    return min(255, 8 * turns)


@inner_kernel
def health_value(health):
    """Return what a head's square shows of its health."""
    return 5 * health // 2


@inner_kernel
def hazard_value(stacked, damage):
    """Return what a square shows of so many hazards."""
    return min(255, 5 * abs(damage) * stacked // 2)


@inner_kernel
def holds_board(side, params):
    """Tell whether a window of `side` squares holds the whole board, wherever the head in its middle is."""
    return params[WRAPPED] == 0 and side >= 2 * params[WIDTH] - 1 and side >= 2 * params[HEIGHT] - 1


@inner_kernel
def observe(g, m, snakes, params, marks, walls, planes):
    """Write what snake m of game g sees of any board (one held whole: `planes.py`); a snake that is out sees nothing.

    Args:
        g: Game.
        m: Snake.
        snakes: See `state.Games`.
        params: Settings, see `columns.py`.
        marks: See `mark`.
        walls: uint8 (C, V * V): the plane of walls for every square the head may be on.
        planes: uint8 (N, M, 8, V, V), row (g, m) written, all zero before; row 0 is the top of the window.
    """
    if snakes[g, m, CAUSE]:
        return
    side = planes.shape[3]
    if params[WRAPPED] == 0:
        square = snakes[g, m, Y] * params[WIDTH] + snakes[g, m, X]
        for row in range(side):
            for column in range(side):
                planes[g, m, WALLS, row, column] = walls[square, row * side + column]
    num_snakes = snakes.shape[1]
    for row in range(num_snakes + 1, marks[num_snakes, 0]):
        is_user_file, place = marks[m, 0] <= row and row < marks[m + 1, 0], marks[row, 0]
        plane = OWN_BODY if is_user_file else place >> 20
        _paint(g, m, place & 1023, place >> 10 & 1023, plane, marks[row, 1], snakes, params, planes)
    for s in range(num_snakes):
        if s != m and snakes[g, s, CAUSE] == 0:
            plane, value = threat(g, m, s, snakes)
            _paint(g, m, snakes[g, s, X], snakes[g, s, Y], plane, value, snakes, params, planes)


@inner_kernel
def count(g, snakes, games, params, numbers):
    """Write the numbers of every snake of game g, float32 (N, M, 6); of those that are out, zeros."""
    leader, longest, second = -1, 0, 0
    for s in range(snakes.shape[1]):
        if snakes[g, s, CAUSE] == 0:
            length = snakes[g, s, LENGTH]
            if length > longest:
                leader, longest, second = s, length, longest
            elif length > second:
                second = length
    area = params[WIDTH] * params[HEIGHT]
    others, food = (games[g, ALIVE] - 1) / 16.0, min(1.0, games[g, FOOD] / 16.0)
    damage = max(-1.0, min(1.0, params[DAMAGE] / 100.0))
    for m in range(snakes.shape[1]):
        if snakes[g, m, CAUSE]:
            for number in range(NUM_NUMBERS):
                numbers[g, m, number] = 0
            continue
        length, rival = snakes[g, m, LENGTH], second if m == leader else longest
        numbers[g, m, 0] = snakes[g, m, HEALTH] / 100.0
        numbers[g, m, 1] = min(1.0, length / area)
        numbers[g, m, 2] = max(-1.0, min(1.0, (length - rival) / 10.0)) if rival else 1.0
        numbers[g, m, 3] = others
        numbers[g, m, 4] = food
        numbers[g, m, 5] = damage


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
        for way in range(4):
            mask[g, m, way] = True


@inner_kernel
def _place(x, y, plane):
    """Return plane, y and x side by side, ten bits each."""
    return (plane << 20) + (y << 10) + x


@inner_kernel
def _paint(g, m, x, y, plane, value, snakes, params, planes):
    """Paint a square if it lies within the window; on a wrapped board the window shows the board again and again."""
    side = planes.shape[3]
    column, row = side // 2 - snakes[g, m, X] + x, side // 2 + snakes[g, m, Y] - y
    if params[WRAPPED]:
        for r in range(row % params[HEIGHT], side, params[HEIGHT]):
            for c in range(column % params[WIDTH], side, params[WIDTH]):
                planes[g, m, plane, r, c] = value
    elif column >= 0 and column < side and row >= 0 and row < side:
        planes[g, m, plane, row, column] = value


@inner_kernel
def threat(g, m, s, snakes):
    """Return the plane and the value of another's head: whether, and how surely, it would survive a meeting."""
    lead = snakes[g, s, LENGTH] - snakes[g, m, LENGTH]
    return STRONGER_HEADS if lead >= 0 else WEAKER_HEADS, min(255, 127 + 16 * abs(lead))
