"""What a position of a search is worth to each snake, compiled: the weights of `territory.evaluate`, over bits."""

from __future__ import annotations

from racecraft.kernels import lean_kernel
from racecraft.worlds.battlesnake.players.kernels.fill import LENGTH, MEAL_STEPS, SQUARES, claim
from racecraft.worlds.battlesnake.players.kernels.position import (
    BURN_WEIGHT,
    DAMAGE,
    HAZARDS,
    HEAD,
    HEALTH,
    HEALTH_WEIGHT,
    HEIGHT,
    LENGTH_WEIGHT,
    MEAL_WEIGHT,
    OUT,
    ROOM_WEIGHT,
    SOLO,
    SQUARES_WEIGHT,
    WEIGHT_SCALE,
    WIDTH,
)


@lean_kernel
def evaluate(d, ring, rows, bits, cells, edges, rules, pools, found, worths):
    """Write what ply d is worth to each snake, 0 (dead) to 1 (won), into `worths` float64 (M,).

    A living snake is worth its share of the claimed squares (0.6), its share of the lengths (0.2), and how sure its
    next meal is (0.2); less where its body has no room or its head lies in a hazard. The weights stand in `rules`;
    those named here are the usual ones.
    """
    alive, last_alive = 0, 0
    for s in range(rows.shape[1]):
        worths[s] = 0.0
        if rows[d, s, OUT] == 0:
            alive += 1
            last_alive = s
    if alive == 0:
        return
    if alive == 1 and not rules[SOLO]:
        worths[last_alive] = 1.0
        return
    claim(d, ring, rows, bits, edges, rules, pools, found)
    total_length, total_squares = 0, 0
    for s in range(rows.shape[1]):
        if rows[d, s, OUT] == 0:
            total_length += found[s, LENGTH]
            total_squares += found[s, SQUARES]
    if alive == 1:
        total_length = total_squares = rules[WIDTH] * rules[HEIGHT]
    for_squares, for_length = rules[SQUARES_WEIGHT] / WEIGHT_SCALE, rules[LENGTH_WEIGHT] / WEIGHT_SCALE
    for_meal, for_health = rules[MEAL_WEIGHT] / WEIGHT_SCALE, rules[HEALTH_WEIGHT] / WEIGHT_SCALE
    for_steps = (WEIGHT_SCALE - rules[HEALTH_WEIGHT]) / WEIGHT_SCALE
    for_room, for_none = rules[ROOM_WEIGHT] / WEIGHT_SCALE, (WEIGHT_SCALE - rules[ROOM_WEIGHT]) / WEIGHT_SCALE
    for_burn = rules[BURN_WEIGHT] / WEIGHT_SCALE
    for s in range(rows.shape[1]):
        if rows[d, s, OUT]:
            continue
        length, squares, health, steps = found[s, LENGTH], found[s, SQUARES], rows[d, s, HEALTH], found[s, MEAL_STEPS]
        share, bulk = squares / max(1, total_squares), length / total_length
        meal = 0.0 if steps >= health else (health / 100.0) * for_health + for_steps / (1.0 + steps)
        room = min(1.0, squares / length)
        burn = for_burn * cells[rows[d, s, HEAD], HAZARDS] * rules[DAMAGE]
        good = (for_squares * share + for_length * bulk + for_meal * meal) * (for_none + for_room * room)
        worths[s] = min(0.95, max(0.02, good - burn))
