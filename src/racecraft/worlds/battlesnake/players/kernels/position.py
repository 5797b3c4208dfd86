"""A position for search, compiled: small, played forward in a blink, and taken back for nothing.

Positions stand on a line, one a ply: `advance` plays the moves of all snakes at ply d and writes ply d + 1, by the same
rules as `envs.battlesnake.kernels.rules`, to which it is held equal by test; to take a turn back is to look at ply d
again. A body is a ring of the cells it lies on, each once, and the number of segments stacked on its tail. So a turn
writes one cell of the ring and nothing that an earlier ply needs. What dice decide stays as it is: no food falls and no
hazard moves.

The arrays, for M snakes on C = width * height cells (cell y * width + x); boards of bits hold 64 cells a word:

    ring    int16 (M, P)          cells of each body from its head on; P is a power of two, more than cells and plies
    rows    int32 (D + 1, M, 6)   START … OUT of each snake at each ply; its length is COUNT + STACK
    bits    uint64 (D + 1, 2, W)  boards of bits of each ply: BODIES of the living, FOOD
    cells   int16 (C, 5)          the cell that each move leads to (-1 off the board), and stacked HAZARDS
    edges   uint64 (5, W)         boards of bits that stay: BOARD, LEFT, RIGHT, BOTTOM, TOP
    rules   int32 (14,)           WIDTH … TURN, that of ply 0, and SQUARES_WEIGHT … BURN_WEIGHT of `worth.py`

No function takes a slice of an array: to make one costs more than a turn.
"""

from __future__ import annotations

import numpy as np

from racecraft.kernels import inner_kernel, lean_kernel

START, COUNT, STACK, HEALTH, HEAD, OUT = 0, 1, 2, 3, 4, 5
"""Place of the head in the ring, cells the body lies on, segments stacked on its tail beyond one, health, cell of the
head (-1 off the board), 0 while alive or the ply at which it left."""
NUM_COLUMNS = 6
BODIES, FOOD = 0, 1
HAZARDS = 4
BOARD, LEFT, RIGHT, BOTTOM, TOP = 0, 1, 2, 3, 4
WIDTH, HEIGHT, WRAPPED, CONSTRICTOR, SOLO, DAMAGE, TURN = 0, 1, 2, 3, 4, 5, 6
SQUARES_WEIGHT, LENGTH_WEIGHT, MEAL_WEIGHT, HEALTH_WEIGHT, ROOM_WEIGHT, BURN_WEIGHT = 7, 8, 9, 10, 11, 12
"""What counts how much, in parts of WEIGHT_SCALE."""
NUM_RULES = 14
WEIGHT_SCALE = 10_000

NONE, ONE, LOW_SIX = np.uint64(0), np.uint64(1), np.uint64(63)


@inner_kernel
def is_set(d, plane, cell, bits):
    """Tell whether a cell's bit is set on a board of ply d."""
    return (bits[d, plane, cell >> 6] >> (np.uint64(cell) & LOW_SIX)) & ONE != NONE


@inner_kernel
def clear(d, plane, cell, bits):
    """Clear a cell's bit."""
    bits[d, plane, cell >> 6] &= ~(ONE << (np.uint64(cell) & LOW_SIX))


@inner_kernel
def count_alive(d, rows):
    """Return how many snakes live at ply d."""
    alive = 0
    for s in range(rows.shape[1]):
        alive += rows[d, s, OUT] == 0
    return alive


@inner_kernel
def is_over(d, rows, rules):
    """Tell whether the game is over at ply d."""
    return count_alive(d, rows) <= (0 if rules[SOLO] else 1)


@lean_kernel
def advance(d, ways, ring, rows, bits, cells, rules):
    """Play one turn at ply d and write ply d + 1; `ways` int64 (D, M): 0 up, 1 down, 2 left, 3 right, of the living."""
    e = d + 1
    for s in range(rows.shape[1]):
        for column in range(NUM_COLUMNS):
            rows[e, s, column] = rows[d, s, column]
    for word in range(bits.shape[2]):
        bits[e, BODIES, word], bits[e, FOOD, word] = bits[d, BODIES, word], bits[d, FOOD, word]
    _move(e, ways, ring, rows, bits, cells, rules)
    _feed(e, ring, rows, bits)
    _collide(e, ring, rows, bits)
    for s in range(rows.shape[1]):
        if rows[e, s, OUT] == 0:
            cell = rows[e, s, HEAD]
            bits[e, BODIES, cell >> 6] |= ONE << (np.uint64(cell) & LOW_SIX)
            if rules[CONSTRICTOR]:
                rows[e, s, HEALTH], rows[e, s, STACK] = 100, max(1, rows[e, s, STACK])
    if rules[CONSTRICTOR]:
        for word in range(bits.shape[2]):
            bits[e, FOOD, word] = NONE


@inner_kernel
def _move(e, ways, ring, rows, bits, cells, rules):
    """New heads, tails away, one health less and what hazards take; whom a hazard kills is gone at once."""
    last = ring.shape[1] - 1
    for s in range(rows.shape[1]):
        if rows[e, s, OUT]:
            continue
        start = rows[e, s, START]
        if rows[e, s, STACK]:
            rows[e, s, STACK] -= 1
            rows[e, s, COUNT] += 1
        else:
            clear(e, BODIES, ring[s, (start + rows[e, s, COUNT] - 1) & last], bits)
        cell, start = cells[rows[e, s, HEAD], ways[e - 1, s]], (start - 1) & last
        ring[s, start] = cell
        rows[e, s, START], rows[e, s, HEAD] = start, cell
        health = rows[e, s, HEALTH] - 1
        if cell >= 0 and cells[cell, HAZARDS] and not is_set(e, FOOD, cell, bits):
            for _ in range(cells[cell, HAZARDS]):
                health = max(0, min(100, health - rules[DAMAGE]))
                if health <= 0:
                    _leave(e, s, ring, rows, bits)
                    break
        rows[e, s, HEALTH] = health


@inner_kernel
def _feed(e, ring, rows, bits):
    """Heads on food eat it, all of them; then the starved and those off the board leave."""
    fed = False
    for s in range(rows.shape[1]):
        if rows[e, s, OUT] == 0 and rows[e, s, HEAD] >= 0 and is_set(e, FOOD, rows[e, s, HEAD], bits):
            rows[e, s, HEALTH] = 100
            rows[e, s, STACK] += 1
            fed = True
    for s in range(rows.shape[1]):
        if rows[e, s, OUT] == 0:
            if fed and rows[e, s, HEAD] >= 0:
                clear(e, FOOD, rows[e, s, HEAD], bits)
            if rows[e, s, HEAD] < 0 or rows[e, s, HEALTH] <= 0:
                _leave(e, s, ring, rows, bits)


@inner_kernel
def _collide(e, ring, rows, bits):
    """Judge all heads, then let those leave who ran into a body, or into a head of a snake that is not shorter."""
    hit = 0
    for s in range(rows.shape[1]):
        if rows[e, s, OUT]:
            continue
        cell, length = rows[e, s, HEAD], rows[e, s, COUNT] + rows[e, s, STACK]
        dies = is_set(e, BODIES, cell, bits)
        for other in range(rows.shape[1]):
            if other != s and rows[e, other, OUT] == 0 and rows[e, other, HEAD] == cell:
                dies = dies or rows[e, other, COUNT] + rows[e, other, STACK] >= length
        if dies:
            hit |= 1 << s
    if hit:
        for s in range(rows.shape[1]):
            if (hit >> s) & 1:
                _leave(e, s, ring, rows, bits)


@lean_kernel
def _leave(e, s, ring, rows, bits):
    """Take a snake out; its body, all but the new head, falls off the board."""
    rows[e, s, OUT] = e
    for place in range(1, rows[e, s, COUNT]):
        clear(e, BODIES, ring[s, (rows[e, s, START] + place) & (ring.shape[1] - 1)], bits)


@inner_kernel
def safe_ways(d, s, ring, rows, bits, cells, rules):
    """Return the moves of snake s at ply d that are not surely fatal, as bits: 1 up, 2 down, 4 left, 8 right.

    Bodies that stay, walls, hunger and hazards are surely fatal; a tail that moves on and another's head are not.
    """
    safe, health = 0, rows[d, s, HEALTH] - 1
    for way in range(4):
        cell = cells[rows[d, s, HEAD], way]
        if cell < 0:
            continue
        if health - cells[cell, HAZARDS] * rules[DAMAGE] <= 0 and not is_set(d, FOOD, cell, bits):
            continue
        if not is_set(d, BODIES, cell, bits) or _is_leaving(d, cell, ring, rows):
            safe |= 1 << way
    return safe


@inner_kernel
def _is_leaving(d, cell, ring, rows):
    """Tell whether a cell is that of a tail that moves on."""
    for s in range(rows.shape[1]):
        tail = ring[s, (rows[d, s, START] + rows[d, s, COUNT] - 1) & (ring.shape[1] - 1)]
        if rows[d, s, OUT] == 0 and rows[d, s, STACK] == 0 and tail == cell:
            return True
    return False


@lean_kernel
def play_on(turns, chance, ways, ring, rows, bits, cells, rules):
    """Play up to so many turns with random safe moves, every one from ply 0 to ply 1 and back; return how many it was.

    The yardstick of the rules alone, choosing included. `chance` uint64 (1,) is the state of the dice.
    """
    for turn in range(turns):
        if is_over(0, rows, rules):
            return turn
        for s in range(rows.shape[1]):
            if rows[0, s, OUT] == 0:
                safe = safe_ways(0, s, ring, rows, bits, cells, rules)
                chance[0] = chance[0] * np.uint64(6364136223846793005) + np.uint64(1442695040888963407)
                way = np.int64(chance[0] >> np.uint64(62))
                while safe and not (safe >> way) & 1:
                    way = (way + 1) & 3
                ways[0, s] = way
        advance(0, ways, ring, rows, bits, cells, rules)
        for s in range(rows.shape[1]):
            for column in range(NUM_COLUMNS):
                rows[0, s, column] = rows[1, s, column]
        for word in range(bits.shape[2]):
            bits[0, BODIES, word], bits[0, FOOD, word] = bits[1, BODIES, word], bits[1, FOOD, word]
    return turns
