"""Whose squares are whose, and what a position is worth to each snake, compiled.

All heads set out at once, one square a turn; a square belongs to whoever can be there first, among equals to the
longest, between equal lengths to nobody. Squares under bodies open when the body has moved on. Arrays are those of
`envs.battlesnake.state.Games`.
"""

from __future__ import annotations

import numpy as np

from racecraft.kernels import lean_kernel
from racecraft.worlds.battlesnake.env.kernels.columns import (
    CAUSE,
    DAMAGE,
    HAZARD,
    HEALTH,
    HEIGHT,
    LENGTH,
    MEAL,
    SOLO,
    START,
    WIDTH,
    WRAPPED,
)
from racecraft.worlds.battlesnake.env.kernels.outlook import NOBODY, claimant


@lean_kernel
def neighbour(cell, way, width, height, wrapped):
    """Return the cell a move leads to, -1 off the board."""
    x = cell % width + (way == 3) - (way == 2)
    y = cell // width + (way == 0) - (way == 1)
    if wrapped:
        x = x - width if x >= width else x + width if x < 0 else x
        y = y - height if y >= height else y + height if y < 0 else y
    elif x < 0 or y < 0 or x >= width or y >= height:
        return -1
    return y * width + x


@lean_kernel
def claim(g, bodies, snakes, cells, params, scratch, squares, food_steps):
    """Count each snake's squares and its steps to the nearest food of its own.

    `scratch` int32 (4, C): turn of opening, owner, steps, queue. `squares`, `food_steps` int32 (M,) are written;
    food that is not one's own is as far as the board has squares.
    """
    width, height, wrapped = params[WIDTH], params[HEIGHT], params[WRAPPED]
    area = width * height
    opening, owner, steps, queue = scratch[0], scratch[1], scratch[2], scratch[3]
    last = bodies.shape[2] - 1
    for cell in range(area):
        opening[cell], steps[cell] = 0, -1
    tail_of_queue = 0
    for s in range(snakes.shape[1]):
        squares[s], food_steps[s] = 0, area
        if snakes[g, s, CAUSE]:
            continue
        start, length = snakes[g, s, START], snakes[g, s, LENGTH]
        for place in range(length):
            cell = bodies[g, s, (start + place) & last]
            opening[cell] = max(opening[cell], length - place)
        head = bodies[g, s, start & last]
        steps[head], owner[head] = 0, s
        queue[tail_of_queue] = head
        tail_of_queue += 1
    front = 0
    while front < tail_of_queue:
        cell = queue[front]
        front += 1
        s = owner[cell]
        if s == NOBODY:
            continue
        if steps[cell]:
            squares[s] += 1
        if cells[g, MEAL, cell] and steps[cell] < food_steps[s]:
            food_steps[s] = steps[cell]
        step = steps[cell] + 1
        for way in range(4):
            beyond = neighbour(cell, way, width, height, wrapped)
            if beyond < 0 or opening[beyond] > step:
                continue
            if steps[beyond] < 0:
                steps[beyond], owner[beyond] = step, s
                queue[tail_of_queue] = beyond
                tail_of_queue += 1
            elif steps[beyond] == step and owner[beyond] != s and owner[beyond] != NOBODY:
                owner[beyond] = claimant(g, s, owner[beyond], snakes)


@lean_kernel
def evaluate(g, bodies, snakes, cells, params, scratch, squares, food_steps, worths):
    """Write what the position is worth to each snake, 0 (dead) to 1 (won), into `worths` float64 (M,).

    A living snake is worth its share of the claimed squares (0.6), its share of the lengths (0.2), and how sure its
    next meal is (0.2); less where its body has no room or its head lies in a hazard.
    """
    alive, last_alive, total_length, total_squares = 0, 0, 0, 0
    claim(g, bodies, snakes, cells, params, scratch, squares, food_steps)
    last = bodies.shape[2] - 1
    for s in range(snakes.shape[1]):
        worths[s] = 0.0
        if snakes[g, s, CAUSE] == 0:
            alive += 1
            last_alive = s
            total_length += snakes[g, s, LENGTH]
            total_squares += squares[s]
    if alive == 1 and not params[SOLO]:
        worths[last_alive] = 1.0
        return
    area = cells.shape[2]
    for s in range(snakes.shape[1]):
        if snakes[g, s, CAUSE]:
            continue
        share = squares[s] / max(1, total_squares) if alive > 1 else squares[s] / area
        bulk = snakes[g, s, LENGTH] / total_length if alive > 1 else snakes[g, s, LENGTH] / area
        health = snakes[g, s, HEALTH]
        meal = 0.0 if food_steps[s] >= health else (health / 100.0) * 0.6 + 0.4 / (1.0 + food_steps[s])
        room = min(1.0, squares[s] / snakes[g, s, LENGTH])
        head = bodies[g, s, snakes[g, s, START] & last]
        burn = 0.003 * cells[g, HAZARD, head] * params[DAMAGE]
        worths[s] = min(0.95, max(0.02, (0.6 * share + 0.2 * bulk + 0.2 * meal) * (0.3 + 0.7 * room) - burn))


@lean_kernel
def safe_ways(g, s, bodies, snakes, cells, params, ways):
    """Write which moves of snake s are not surely fatal into `ways` float64 (4,), 1 or 0; return how many."""
    last = bodies.shape[2] - 1
    head = bodies[g, s, snakes[g, s, START] & last]
    count = 0
    for way in range(4):
        ways[way] = 0.0
        cell = neighbour(head, way, params[WIDTH], params[HEIGHT], params[WRAPPED])
        if cell < 0:
            continue
        other = cells[g, 0, cell] - 1
        if other >= 0:
            end = snakes[g, other, START] + snakes[g, other, LENGTH] - 1
            tail, before = bodies[g, other, end & last], bodies[g, other, (end - 1) & last]
            if tail != cell or before == cell:
                continue
        left = snakes[g, s, HEALTH] - 1 - cells[g, HAZARD, cell] * params[DAMAGE]
        if left <= 0 and cells[g, MEAL, cell] == 0:
            continue
        ways[way] = 1.0
        count += 1
    return count


@lean_kernel
def copy_game(source, target, bodies, snakes, games, cells):
    """Copy the position of one game over another's; loops, since slices take Numba long to compile."""
    for s in range(snakes.shape[1]):
        for place in range(bodies.shape[2]):
            bodies[target, s, place] = bodies[source, s, place]
        for column in range(snakes.shape[2]):
            snakes[target, s, column] = snakes[source, s, column]
    for column in range(games.shape[1]):
        games[target, column] = games[source, column]
    for plane in range(cells.shape[1]):
        for cell in range(cells.shape[2]):
            cells[target, plane, cell] = cells[source, plane, cell]


def scratch_arrays(num_snakes: int, area: int) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """Return `scratch`, `squares`, `food_steps` and `worths` for `evaluate`."""
    scratch = np.zeros((4, area), np.int32)
    return scratch, np.zeros(num_snakes, np.int32), np.zeros(num_snakes, np.int32), np.zeros(num_snakes, np.float64)
