"""The common set-up, compiled: a square board of side 7 or more, up to 8 snakes, standard start squares.

Rolls the dice of `starts.py` in the same order; every other set-up is made by the referee and copied in.
"""

from __future__ import annotations

from racecraft.kernels import inner_kernel, lean_kernel
from racecraft.worlds.battlesnake.env.kernels.columns import (
    ALIVE,
    BY,
    CONSTRICTOR,
    HAZARD,
    HAZARD_RULE,
    HEALTH,
    LENGTH,
    MEAL,
    OWNER,
    ROYALE,
    START_FOOD,
    WIDTH,
    X,
    Y,
)
from racecraft.worlds.battlesnake.env.kernels.food_and_hazards import below, drop_food


@lean_kernel
def begin_standard(g, bodies, snakes, games, cells, sides, chance, params, start_hazards):
    """Begin game g anew; `start_hazards` (C,) are the hazards that stand from the start."""
    snakes[g] = 0
    games[g] = 0
    cells[g] = 0
    for cell in range(start_hazards.size):
        cells[g, HAZARD, cell] = start_hazards[cell]
    games[g, ALIVE] = snakes.shape[1]
    _place_snakes(g, bodies, snakes, cells, chance, params)
    if params[START_FOOD]:
        _first_food(g, snakes, games, cells, chance, params)
        if params[CONSTRICTOR]:
            cells[g, MEAL, :] = 0
            games[g] = 0
            games[g, ALIVE] = snakes.shape[1]
    if params[ROYALE] or params[HAZARD_RULE] == 1:
        _draw_sides(g, sides, chance, params)


@lean_kernel
def _place_snakes(g, bodies, snakes, cells, chance, params):
    side = params[WIDTH]
    order = 0o76543210  # the numbers 0 to 7, the first one lowest: a list that takes no array
    for group in range(2):
        for end in range(3, 0, -1):
            one, two = 4 * group + end, 4 * group + below(g, chance, end + 1)
            order = _swapped(order, one, two)
    first = 4 * below(g, chance, 2)
    for s in range(snakes.shape[1]):
        x, y = _start_square(_digit(order, (first + s) % 8), side)
        snakes[g, s, X], snakes[g, s, Y] = x, y
        snakes[g, s, LENGTH], snakes[g, s, HEALTH], snakes[g, s, BY] = 3, 100, -1
        for place in range(3):
            bodies[g, s, place] = y * side + x
        cells[g, OWNER, y * side + x] = s + 1


@inner_kernel
def _digit(order, place):
    return order >> 3 * place & 7


@inner_kernel
def _swapped(order, one, two):
    change = _digit(order, one) ^ _digit(order, two)
    return order ^ change << 3 * one ^ change << 3 * two


@lean_kernel
def _start_square(number, side):
    """Return x and y of a start square: 0 to 3 the corners, 4 to 7 the cardinal points, in the order of `starts.py`."""
    low, middle, high = 1, (side - 1) // 2, side - 2
    if number < 4:
        return low if number < 2 else high, low if number % 2 == 0 else high
    x = low if number == 4 else high if number == 7 else middle
    y = low if number == 5 else high if number == 6 else middle
    return x, y


@lean_kernel
def _first_food(g, snakes, games, cells, chance, params):
    side = params[WIDTH]
    middle = (side - 1) // 2
    if snakes.shape[1] <= 4 or side * side >= 121:
        for s in range(snakes.shape[1]):
            _place_food_near(g, snakes[g, s, X], snakes[g, s, Y], middle, games, cells, chance, side)
    if cells[g, OWNER, middle * side + middle] == 0:
        drop_food(g, middle * side + middle, games, cells)


@lean_kernel
def _place_food_near(g, x, y, middle, games, cells, chance, side):
    """Lay one food diagonal to (x, y), away from the centre (see `starts.food_beside_heads`)."""
    free = 0
    for corner in range(4):
        free += _suits(g, x, y, corner, middle, cells, side)
    if free == 0:
        return
    left = below(g, chance, free)
    corner = -1
    while left >= 0:
        corner += 1
        left -= _suits(g, x, y, corner, middle, cells, side)
    drop_food(g, (y - 1 + 2 * (corner % 2)) * side + x - 1 + 2 * (corner // 2), games, cells)


@lean_kernel
def _suits(g, x, y, corner, middle, cells, side):
    fx, fy = x - 1 + 2 * (corner // 2), y - 1 + 2 * (corner % 2)
    if fx < 0 or fy < 0 or fx >= side or fy >= side or cells[g, MEAL, fy * side + fx]:
        return 0
    if (fx == 0 or fx == side - 1) and (fy == 0 or fy == side - 1):
        return 0
    if fx == middle and fy == middle:
        return 0
    return 1 if abs(fx - middle) > abs(x - middle) or abs(fy - middle) > abs(y - middle) else 0


@lean_kernel
def _draw_sides(g, sides, chance, params):
    """Draw royale's sides until the rectangle is gone (see `hazard_plans.royale_sides`)."""
    width, height = params[WIDTH], params[WIDTH]
    number = 0
    sides[g] = 0
    while width > 0 and height > 0:
        side = below(g, chance, 4)
        sides[g, number] = side
        number += 1
        if side < 2:
            width -= 1
        else:
            height -= 1
