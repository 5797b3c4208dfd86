"""What lies behind each of four moves, compiled: room, territory, food, heads nearby. No move is played for it.

Bodies are thought to move away as they would if nobody ate: the square k places before a tail's end opens after k
turns. All others set out from their heads at once, one square a turn; the snake itself is one step ahead, on the square
the move leads to. See `observation.OUTLOOK` for the ten numbers of a move.
"""

from __future__ import annotations

from racecraft.kernels import lean_kernel
from racecraft.worlds.battlesnake.env.kernels.columns import (
    CAUSE,
    DAMAGE,
    HAZARD,
    HEIGHT,
    LENGTH,
    MEAL,
    START,
    WIDTH,
    WRAPPED,
)

NUM_OUTLOOKS = 10
NOBODY = -1


@lean_kernel
def outlook_games(first, beyond, which, looks, bodies, snakes, cells, params, mask, scratch, outlook):
    """Write the outlook of the snakes marked in `looks`, bool (N, M), in the games marked in `which`, bool (N,).

    `mask` bool (N, M, 4) says which moves are not surely fatal (`observe.allow`); `scratch` int32 (N, 5, C);
    `outlook` float32 (N, M, 4, 10), written; zero for all others, for snakes that are out and moves that are fatal.
    """
    for g in range(first, beyond):
        if which[g]:
            outlook_game(g, looks, bodies, snakes, cells, params, mask, scratch, outlook)


@lean_kernel
def outlook_game(g, looks, bodies, snakes, cells, params, mask, scratch, outlook):
    """Write the outlook of the snakes of game g that are marked in `looks`."""
    outlook[g].reshape(-1)[:] = 0
    openings(g, bodies, snakes, cells, scratch[g, 0])
    for m in range(snakes.shape[1]):
        if snakes[g, m, CAUSE] or not looks[g, m]:
            continue
        for way in range(4):
            cell = neighbour(head_of(g, m, bodies, snakes), way, params)
            if mask[g, m, way] and cell >= 0:
                _look(g, m, cell, bodies, snakes, cells, params, scratch[g], outlook[g, m, way])


@lean_kernel
def openings(g, bodies, snakes, cells, opening):
    """Write in how many turns each cell may be entered if nobody eats into `opening` int32 (C,); a tail's in 1."""
    last = bodies.shape[2] - 1
    for cell in range(cells.shape[2]):
        opening[cell] = 0
    for s in range(snakes.shape[1]):
        if snakes[g, s, CAUSE]:
            continue
        start, length = snakes[g, s, START], snakes[g, s, LENGTH]
        for place in range(length):
            cell = bodies[g, s, (start + place) & last]
            opening[cell] = max(opening[cell], length - place)


@lean_kernel
def neighbour(cell, way, params):
    """Return the cell a move leads to, -1 off the board."""
    width, height = params[WIDTH], params[HEIGHT]
    x = cell % width + (way == 3) - (way == 2)
    y = cell // width + (way == 0) - (way == 1)
    if params[WRAPPED]:
        x = x - width if x >= width else x + width if x < 0 else x
        y = y - height if y >= height else y + height if y < 0 else y
    elif x < 0 or y < 0 or x >= width or y >= height:
        return -1
    return y * width + x


@lean_kernel
def head_of(g, s, bodies, snakes):
    """Return the cell of a living snake's head."""
    return bodies[g, s, snakes[g, s, START] & (bodies.shape[2] - 1)]


@lean_kernel
def _look(g, m, cell, bodies, snakes, cells, params, scratch, ways):
    """Write the ten numbers of one move."""
    area, last = params[WIDTH] * params[HEIGHT], bodies.shape[2] - 1
    length = snakes[g, m, LENGTH]
    tail = bodies[g, m, (snakes[g, m, START] + length - 1) & last]
    room, food_steps, tail_steps = pour(g, cell, tail, cells, params, scratch)
    own, others, own_food_steps = _divide(g, m, cell, bodies, snakes, cells, params, scratch)
    ways[0] = 1.0
    ways[1] = min(1.0, room / length)
    ways[2] = room / area
    ways[3] = own / max(1, own + others)
    ways[4] = min(1.0, own / length)
    ways[5] = 1.0 / food_steps if food_steps else 0.0
    ways[6] = 1.0 / own_food_steps if own_food_steps else 0.0
    ways[7] = 1.0 / tail_steps if tail_steps else 0.0
    for s in range(snakes.shape[1]):
        if s == m or snakes[g, s, CAUSE]:
            continue
        for way in range(4):
            if neighbour(head_of(g, s, bodies, snakes), way, params) == cell:
                if snakes[g, s, LENGTH] >= length:
                    ways[8] = -1.0
                elif ways[8] == 0.0:
                    ways[8] = 1.0
    ways[9] = max(-1.0, min(1.0, 0.01 * cells[g, HAZARD, cell] * params[DAMAGE]))


@lean_kernel
def pour(g, cell, tail, cells, params, scratch):
    """Pour water onto a cell: squares reached, and the steps to the nearest food and to the own tail, 0 for never."""
    opening, steps, queue = scratch[0], scratch[1], scratch[2]
    for other in range(cells.shape[2]):
        steps[other] = 0
    steps[cell], queue[0] = 1, cell
    front, count, food_steps = 0, 1, 1 if cells[g, MEAL, cell] else 0
    while front < count:
        here = queue[front]
        front += 1
        step = steps[here] + 1
        for way in range(4):
            beyond = neighbour(here, way, params)
            if beyond < 0 or steps[beyond] or opening[beyond] > step:
                continue
            steps[beyond] = step
            queue[count] = beyond
            count += 1
            if food_steps == 0 and cells[g, MEAL, beyond]:
                food_steps = step
    return count, food_steps, steps[tail]


@lean_kernel
def _divide(g, m, cell, bodies, snakes, cells, params, scratch):
    """Let all run: squares that snake m reaches first from `cell`, those of all others, steps to the first own food.

    A square belongs to whoever can be there first, among equals to the longest, between equal lengths to nobody.
    """
    opening, steps, queue, owner, front, count, others = scratch[0], scratch[1], scratch[2], scratch[3], 0, 0, 0
    for other in range(cells.shape[2]):
        steps[other], owner[other] = -1, NOBODY
    steps[cell], owner[cell] = 1, m
    own, own_food_steps = 1, 1 if cells[g, MEAL, cell] else 0
    for s in range(snakes.shape[1]):
        if s != m and snakes[g, s, CAUSE] == 0:
            head = head_of(g, s, bodies, snakes)
            steps[head], owner[head], queue[count] = 0, s, head
            count += 1
    is_in = False
    while front < count or not is_in:
        if not is_in and (front == count or steps[queue[front]] >= 1):
            here, is_in = cell, True
        else:
            here = queue[front]
            front += 1
        s = owner[here]
        if s == NOBODY:
            continue
        if here != cell and steps[here] > 0:
            if s != m:
                others += 1
            else:
                own += 1
                if own_food_steps == 0 and cells[g, MEAL, here]:
                    own_food_steps = steps[here]
        step = steps[here] + 1
        for way in range(4):
            beyond = neighbour(here, way, params)
            if beyond < 0 or opening[beyond] > step or (beyond == cell):
                continue
            if steps[beyond] < 0:
                steps[beyond], owner[beyond] = step, s
                queue[count] = beyond
                count += 1
            elif steps[beyond] == step and owner[beyond] != s and owner[beyond] != NOBODY:
                owner[beyond] = claimant(g, s, owner[beyond], snakes)
    return own, others, own_food_steps


@lean_kernel
def claimant(g, s, rival, snakes):
    """Return whose a square is that two snakes reach in the same turn: the longer's, NOBODY's between equals."""
    if snakes[g, s, LENGTH] == snakes[g, rival, LENGTH]:
        return NOBODY
    return s if snakes[g, s, LENGTH] > snakes[g, rival, LENGTH] else rival
