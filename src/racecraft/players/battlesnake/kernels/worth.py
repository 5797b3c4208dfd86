"""What a position of a search is worth to each snake, compiled: the weights of `territory.appraise`, over bits."""

from __future__ import annotations

from racecraft.kernels import kernel
from racecraft.players.battlesnake.kernels.fill import LENGTH, MEAL_STEPS, SQUARES, claim
from racecraft.players.battlesnake.kernels.position import DAMAGE, HAZARDS, HEAD, HEALTH, HEIGHT, OUT, SOLO, WIDTH


@kernel
def appraise(d, ring, rows, bits, cells, edges, rules, pools, found, worths):
    """Write what ply d is worth to each snake, 0 (dead) to 1 (won), into `worths` float64 (M,).

    A living snake is worth its share of the claimed squares (0.6), its share of the lengths (0.2), and how sure its
    next meal is (0.2); less where its body has no room or its head lies in a hazard.
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
    for s in range(rows.shape[1]):
        if rows[d, s, OUT]:
            continue
        length, squares, health, steps = found[s, LENGTH], found[s, SQUARES], rows[d, s, HEALTH], found[s, MEAL_STEPS]
        share, bulk = squares / max(1, total_squares), length / total_length
        meal = 0.0 if steps >= health else (health / 100.0) * 0.6 + 0.4 / (1.0 + steps)
        room = min(1.0, squares / length)
        burn = 0.003 * cells[rows[d, s, HEAD], HAZARDS] * rules[DAMAGE]
        worths[s] = min(0.95, max(0.02, (0.6 * share + 0.2 * bulk + 0.2 * meal) * (0.3 + 0.7 * room) - burn))
