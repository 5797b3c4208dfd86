"""What snakes see of a board that their windows hold whole: drawn once a game, then laid down for each of them.

A window is a row of bytes, plane after plane and line after line. One that holds the whole board wherever the head is
shows the same bytes to every snake, only so many places further: nothing of the board ever leaves a line or a plane. So
the board is drawn on a sheet, as seen from its upper left corner, and what a snake sees is a stretch of that sheet, one
block move. What differs from snake to snake is written after it: its own body, the heads of the others, the walls.
"""

from __future__ import annotations

import numpy as np

from racecraft.kernels import inner_kernel
from racecraft.worlds.battlesnake.env.kernels.columns import (
    CAUSE,
    DAMAGE,
    FOOD,
    HAZARD,
    HEALTH,
    HEIGHT,
    LENGTH,
    MEAL,
    START,
    WIDTH,
    X,
    Y,
)
from racecraft.worlds.battlesnake.env.kernels.observe import (
    HAZARDS,
    HEALTHS,
    MEALS,
    OTHER_BODIES,
    WALLS,
    body_value,
    hazard_value,
    health_value,
    threat,
)


@inner_kernel
def draw(g, bodies, snakes, games, cells, params, squares, side, sheet):
    """Draw the board of game g: food, hazards, healths and every body on the plane of the others'.

    `sheet` uint8 (WALLS * V * V + (H - 1) * V + W - 1): room for all planes but the walls and the furthest shift.
    """
    width, height, last = params[WIDTH], params[HEIGHT], bodies.shape[2] - 1
    origin, area = _origin(side, params), side * side
    sheet[:] = 0
    if games[g, FOOD]:
        for y in range(height):
            line = origin + MEALS * area - y * side
            for x in range(width):
                sheet[line + x] = np.uint8(255 * cells[g, MEAL, y * width + x])
    stacked = 0
    for cell in range(cells.shape[2]):
        stacked |= cells[g, HAZARD, cell]
    if stacked:
        for y in range(height):
            line = origin + HAZARDS * area - y * side
            for x in range(width):
                sheet[line + x] = hazard_value(cells[g, HAZARD, y * width + x], params[DAMAGE])
    for s in range(snakes.shape[1]):
        if snakes[g, s, CAUSE]:
            continue
        head = origin + HEALTHS * area - snakes[g, s, Y] * side + snakes[g, s, X]
        sheet[head] = health_value(snakes[g, s, HEALTH])
        end, first = snakes[g, s, START] + snakes[g, s, LENGTH] - 1, origin + OTHER_BODIES * area
        for place in range(snakes[g, s, LENGTH]):  # the tail first: the segment that stays longest is drawn last
            cell = bodies[g, s, (end - place) & last]
            sheet[first - squares[cell, 1] * side + squares[cell, 0]] = body_value(place + 1)


@inner_kernel
def lay_down(g, m, bodies, snakes, params, squares, side, sheet, walls, seen):
    """Write what snake m of game g sees into `seen`, uint8 (8 * V * V); `walls` see `observe.observe`."""
    area, last = side * side, bodies.shape[2] - 1
    if snakes[g, m, CAUSE]:
        seen[:] = 0
        return
    head_x, head_y = snakes[g, m, X], snakes[g, m, Y]
    shift = (params[HEIGHT] - 1 - head_y) * side + head_x
    _copy(sheet[shift : shift + WALLS * area], seen[: WALLS * area])
    _copy(walls[head_y * params[WIDTH] + head_x], seen[WALLS * area :])
    first = _origin(side, params) - shift  # where square (0, 0) lies on the first plane, that of the own body
    end = snakes[g, m, START] + snakes[g, m, LENGTH] - 1
    for place in range(snakes[g, m, LENGTH]):
        cell = bodies[g, m, (end - place) & last]
        at = first - squares[cell, 1] * side + squares[cell, 0]
        seen[at], seen[at + OTHER_BODIES * area] = body_value(place + 1), 0
    for s in range(snakes.shape[1]):
        if s != m and snakes[g, s, CAUSE] == 0:
            plane, value = threat(g, m, s, snakes)
            seen[first + plane * area - snakes[g, s, Y] * side + snakes[g, s, X]] = value


@inner_kernel
def _origin(side, params):
    """Return where square (0, 0) lies on the sheet's first plane."""
    return (side // 2 + params[HEIGHT] - 1) * side + side // 2


@inner_kernel
def _copy(source, target):
    """Copy byte by byte, which compiles to one block move (a slice assignment does not)."""
    for place in range(target.size):
        target[place] = source[place]
