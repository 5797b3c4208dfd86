"""What the map does after a turn, compiled: food falls, hazards change. Dice roll exactly as in `maps.py`."""

from __future__ import annotations

import numpy as np

from racecraft.kernels import inner_kernel, lean_kernel
from racecraft.kernels.rng import random_bits
from racecraft.worlds.battlesnake.env.kernels.columns import (
    CASTLE_FOOD,
    CAUSE,
    CHANCE,
    FOOD,
    FOOD_RULE,
    HAZARD,
    HAZARD_RULE,
    HEIGHT,
    LENGTH,
    MEAL,
    MIN_FOOD,
    NEXT_EVENT,
    NOTE,
    OWNER,
    SHRINK,
    START,
    TURN,
    WIDTH,
    X,
    Y,
)


@inner_kernel
def below(g, chance, count):
    """Roll game g's dice: a number from 0 to count - 1 (twin of `dice.StreamDice`). `chance` (N, 2): key, counter."""
    bits = random_bits(chance[g, 0], chance[g, 1])
    chance[g, 1] += np.uint64(1)
    return np.int64(((bits >> np.uint64(32)) * np.uint64(count)) >> np.uint64(32))


@inner_kernel
def after_turn(g, bodies, snakes, games, cells, sides, events, chance, params, food_squares):
    """Let food fall and hazards change; the turn still shows the old number."""
    rule = params[FOOD_RULE]
    if rule == 1 or rule == 2:
        _standard_food(g, snakes, games, cells, chance, params)
    elif rule == 3:
        if params[CHANCE] and below(g, chance, 100) <= params[CHANCE]:
            _listed_food(g, snakes, games, cells, chance, params, food_squares)
    elif rule == 4 and games[g, TURN] >= 10 and games[g, FOOD] < params[CASTLE_FOOD]:
        _listed_food(g, snakes, games, cells, chance, params, food_squares)
    if params[HAZARD_RULE] == 0:
        _reveal(g, games, cells, events)
    elif params[HAZARD_RULE] == 1:
        if (games[g, TURN] + 1) % params[SHRINK] == 0:
            lay_safe_zone(g, (games[g, TURN] + 1) // params[SHRINK], cells, sides, params)
    elif params[HAZARD_RULE] == 2:
        _leave_trails(g, bodies, snakes, cells)


@lean_kernel
def lay_safe_zone(g, shrinks, cells, sides, params):
    """One hazard on every cell outside the rectangle that is left after so many shrinks, none inside, no notes."""
    width, height = params[WIDTH], params[HEIGHT]
    left, right, bottom, top = 0, width - 1, 0, height - 1
    for number in range(min(shrinks, sides.shape[1])):
        side = sides[g, number]
        left += side == 0
        right -= side == 1
        bottom += side == 2
        top -= side == 3
    for y in range(height):
        for x in range(width):
            inside = left <= x and x <= right and bottom <= y and y <= top
            cells[g, HAZARD, y * width + x] = np.int16(0) if inside else np.int16(1)
            cells[g, NOTE, y * width + x] = 0


@lean_kernel
def drop_food(g, cell, games, cells):
    """Lay food on a cell that has none."""
    cells[g, MEAL, cell] = 1
    games[g, FOOD] += 1


@lean_kernel
def fall_anywhere(g, count, spare_hazards, snakes, games, cells, chance, params):
    """Lay up to `count` foods on free cells (see `Board.free_squares`), each as likely as the next."""
    _mark_heads(g, snakes, cells, params, 0, -1)
    free = 0
    for cell in range(params[WIDTH] * params[HEIGHT]):
        free += _is_free(g, cell, cells, spare_hazards)
    for _ in range(min(count, free)):
        left = below(g, chance, free)
        cell = -1
        while left >= 0:
            cell += 1
            left -= _is_free(g, cell, cells, spare_hazards)
        drop_food(g, cell, games, cells)
        free -= 1
    _mark_heads(g, snakes, cells, params, -1, 0)


@inner_kernel
def _is_free(g, cell, cells, spare_hazards):
    free = (cells[g, OWNER, cell] == 0) & (cells[g, MEAL, cell] == 0)
    return np.int64(free & ((not spare_hazards) | (cells[g, HAZARD, cell] == 0)))


@lean_kernel
def _mark_heads(g, snakes, cells, params, before, after):
    """Turn owner `before` into `after` on the cells beside living heads: -1 keeps food away from them."""
    width, height = params[WIDTH], params[HEIGHT]
    for s in range(snakes.shape[1]):
        if snakes[g, s, CAUSE]:
            continue
        for way in range(4):
            x = snakes[g, s, X] + (way == 3) - (way == 2)
            y = snakes[g, s, Y] + (way == 0) - (way == 1)
            if x >= 0 and x < width and y >= 0 and y < height and cells[g, OWNER, y * width + x] == before:
                cells[g, OWNER, y * width + x] = after


@inner_kernel
def _standard_food(g, snakes, games, cells, chance, params):
    missing = params[MIN_FOOD] - games[g, FOOD]
    if missing <= 0:
        missing = 1 if 100 - below(g, chance, 100) < params[CHANCE] else 0
    if missing > 0:
        fall_anywhere(g, missing, params[FOOD_RULE] == 2, snakes, games, cells, chance, params)


@lean_kernel
def _listed_food(g, snakes, games, cells, chance, params, food_squares):
    """Lay one food on a free listed square; the castle rule also spares head neighbours and the next square to food."""
    castle = params[FOOD_RULE] == 4
    if castle:
        _mark_heads(g, snakes, cells, params, 0, -1)
    free = 0
    for number in range(food_squares.shape[0]):
        free += _is_listed_free(g, food_squares[number], cells, params, castle)
    if free:
        left = below(g, chance, free)
        number = -1
        while left >= 0:
            number += 1
            left -= _is_listed_free(g, food_squares[number], cells, params, castle)
        drop_food(g, food_squares[number], games, cells)
    if castle:
        _mark_heads(g, snakes, cells, params, -1, 0)


@lean_kernel
def _is_listed_free(g, cell, cells, params, castle):
    free = _is_free(g, cell, cells, False)
    if castle:
        width = params[WIDTH]
        x, y = cell % width, cell // width
        free = free and not (x > 0 and cells[g, MEAL, cell - 1]) and not (x < width - 1 and cells[g, MEAL, cell + 1])
        free = free and not (y > 0 and cells[g, MEAL, cell - width])
        free = free and not (y < params[HEIGHT] - 1 and cells[g, MEAL, cell + width])
    return np.int64(free)


@lean_kernel
def _reveal(g, games, cells, events):
    """Carry out the plan's changes up to this turn."""
    number = games[g, NEXT_EVENT]
    while number < events.shape[1] and events[g, number, 0] <= games[g, TURN]:
        cell = events[g, number, 1]
        cells[g, HAZARD, cell] = max(0, cells[g, HAZARD, cell] + events[g, number, 2])
        number += 1
    games[g, NEXT_EVENT] = number


@lean_kernel
def _leave_trails(g, bodies, snakes, cells):
    """snail_mode: trails fade by one, notes become trails where no living head stands, tails leave new notes."""
    last = bodies.shape[2] - 1
    for s in range(snakes.shape[1]):
        if snakes[g, s, CAUSE] == 0:
            cells[g, NOTE, bodies[g, s, snakes[g, s, START]]] = 0
    for cell in range(cells.shape[2]):
        cells[g, HAZARD, cell] = max(0, cells[g, HAZARD, cell] - 1) + cells[g, NOTE, cell]
        cells[g, NOTE, cell] = 0
    for s in range(snakes.shape[1]):
        if snakes[g, s, CAUSE]:
            continue
        start, length = snakes[g, s, START], snakes[g, s, LENGTH]
        tail = bodies[g, s, (start + length - 1) & last]
        if tail != bodies[g, s, (start + length - 2) & last]:
            cells[g, NOTE, tail] += length
