"""Alpha-beta, compiled: what one snake is sure of when all others play against it and know its move.

"Paranoid": in every turn the own snake chooses first and the others, one seat after another, answer so that it fares
worst; then all moves are played together. What is proven so, a win or a long life, holds against anybody; and a cell
that a head as long may enter too counts as a head-to-head. The stack of choices lies in arrays, so that `think` can
stop after any number of turns and go on later: whoever calls it looks at the clock in between.

Values are those of the own snake, in ten-thousandths of worth: WIN less the turn at which the last other is gone, -WIN
and the turn of the own end, DRAWN and the turn where all leave together; between them what `worth.evaluate` says.
"""

from __future__ import annotations

import numpy as np

from racecraft.kernels import lean_kernel
from racecraft.kernels.rng import random_bits
from racecraft.worlds.battlesnake.players.kernels.position import (
    COUNT,
    FOOD,
    HEAD,
    HEALTH,
    OUT,
    SOLO,
    STACK,
    START,
    TURN,
    advance,
    count_alive,
    safe_ways,
)
from racecraft.worlds.battlesnake.players.kernels.worth import evaluate

WIN, PROVEN = 1_000_000, 500_000
"""A value beyond PROVEN, up or down, is no opinion."""
DRAWN = -6_000
UNIT = 10_000.0
LEAST, MOST = -2_000_000, 2_000_000
SEAT, PLY, ALPHA, BETA, BEST, BEST_WAY, NEXT, WAYS, FIRST_WAY = 0, 1, 2, 3, 4, 5, 6, 7, 8
NUM_FRAME_COLUMNS = 12
"""Columns of a choice: whose (index into `seats`), at which ply, the window it was met with, the best so far, how many
moves are done and how many there are, and the moves in the order in which they are tried."""
TOP, DEPTH, TOLD, VALUE, TURNS, LEAVES = 0, 1, 2, 3, 4, 5
NUM_STATE = 6
"""What `think` keeps: top of the stack (-1 when done), turns to look ahead, whether VALUE is an answer not yet heard;
then counts of turns played and positions appraised."""
EXACT, AT_LEAST, AT_MOST = 1, 2, 3
TABLE_VALUE, TABLE_DEPTH, TABLE_KIND, TABLE_WAY = 0, 1, 2, 3


@lean_kernel
def begin(depth, first, only, state, stack, seats, history, ring, rows, bits, cells, rules):
    """Make ready to look `depth` turns ahead from ply 0, at move `first` (-1: none) before all others.

    `only` are the own moves to look at there, as bits, of those that are not surely fatal; 15 are all. `seats` int64
    (M,) are the snakes in the order in which they choose, the own one first; `stack` int32 (F, 12), `state` int64 (6,)
    and `history` int32 (M, C, 4), which moves have cut a tree short where, are written.
    """
    state[TOP], state[DEPTH], state[TOLD] = 0, depth, 0
    _push(0, 0, 0, LEAST, MOST, first, only, stack, seats, history, ring, rows, bits, cells, rules)


@lean_kernel
def think(most_turns, state, stack, seats, ways, history, keys, table, ring, rows, bits, cells, edges, rules,
          pools, found, worths):  # fmt: skip
    """Go on until the look that `begin` began is done, or so many turns were played; the answer is in stack[0].

    `ways` int64 (D, M) are the moves at each ply. `keys` uint64 (T,) and `table` int32 (T, 4), T a power of two,
    remember positions of one game as its own snake sees them.
    """
    end = state[TURNS] + most_turns
    while state[TOP] >= 0 and state[TURNS] < end:
        top = state[TOP]
        if state[TOLD]:
            state[TOLD] = 0
            _take_value(top, state[VALUE], stack, seats, history, rows)
        if stack[top, NEXT] == stack[top, WAYS]:
            _answer(top, state, stack, seats, keys, table, ring, rows, bits)
            continue
        seat, d = stack[top, SEAT], stack[top, PLY]
        ways[d, seats[seat]] = stack[top, FIRST_WAY + stack[top, NEXT]]
        stack[top, NEXT] += 1
        alpha, beta = stack[top, ALPHA], stack[top, BETA]
        if seat == 0:
            alpha = max(alpha, stack[top, BEST])
        else:
            beta = min(beta, stack[top, BEST])
        seat += 1
        while seat < seats.shape[0] and rows[d, seats[seat], OUT]:
            seat += 1
        if seat < seats.shape[0]:
            state[TOP] = top + 1
            _push(top + 1, seat, d, alpha, beta, -1, 15, stack, seats, history, ring, rows, bits, cells, rules)
            continue
        advance(d, ways, ring, rows, bits, cells, rules)
        state[TURNS] += 1
        d += 1
        me = seats[0]
        alive = count_alive(d, rows)
        if rows[d, me, OUT]:
            state[VALUE] = (DRAWN if alive == 0 and seats.shape[0] > 1 else -WIN) + rules[TURN] + d
            state[TOLD] = 1
        elif alive == 1 and not rules[SOLO]:
            state[VALUE], state[TOLD] = WIN - rules[TURN] - d, 1
        elif d == state[DEPTH]:
            evaluate(d, ring, rows, bits, cells, edges, rules, pools, found, worths)
            state[LEAVES] += 1
            state[VALUE], state[TOLD] = _opinion(me, alive, worths), 1
        else:
            first = -1
            if state[DEPTH] - d > 1:
                key = key_of(d, me, ring, rows, bits)
                place = np.int64(key & np.uint64(keys.shape[0] - 1))
                if keys[place] == key ^ _seal(place, table):
                    first = table[place, TABLE_WAY]
                    if _is_known(place, state[DEPTH] - d, alpha, beta, table):
                        state[VALUE], state[TOLD] = table[place, TABLE_VALUE], 1
                        continue
            state[TOP] = top + 1
            _push(top + 1, 0, d, alpha, beta, first, 15, stack, seats, history, ring, rows, bits, cells, rules)


@lean_kernel
def _opinion(me, alive, worths):
    """Return what an appraised position is worth to snake `me` beside the others, on average."""
    others = -worths[me]
    for s in range(worths.shape[0]):
        others += worths[s]
    return np.int64(UNIT * (worths[me] - others / max(1, alive - 1)))


@lean_kernel
def _is_known(place, depth, alpha, beta, table):
    """Tell whether a remembered position says enough: looked at as deep, and inside or beyond the window."""
    value, kind = table[place, TABLE_VALUE], table[place, TABLE_KIND]
    deep = table[place, TABLE_DEPTH] >= depth or abs(value) > PROVEN
    return deep and (kind == EXACT or (kind == AT_LEAST and value >= beta) or (kind == AT_MOST and value <= alpha))


@lean_kernel
def _seal(place, table):
    """Return a number that what is remembered at a place is sealed with.

    Two threads may write into one place at once; a key then opens nothing but what was written with it (Hyatt, Mann:
    "A lockless transposition table implementation for parallel search", 2002).
    """
    rest = (table[place, TABLE_DEPTH] * 4 + table[place, TABLE_KIND]) * 8 + table[place, TABLE_WAY] + 1
    return random_bits(np.uint64(table[place, TABLE_VALUE] - LEAST), np.uint64(rest))


@lean_kernel
def _push(top, seat, d, alpha, beta, first, only, stack, seats, history, ring, rows, bits, cells, rules):
    """Open a choice: list the moves that are not surely fatal, `first` first, then by what has cut before."""
    s = seats[seat]
    safe, head, count = safe_ways(d, s, ring, rows, bits, cells, rules) & only, rows[d, s, HEAD], 0
    for way in range(4):
        if (safe >> way) & 1:
            score = MOST if way == first else history[s, head, way]
            place = count
            while place > 0:
                before = stack[top, FIRST_WAY + place - 1]
                if before == first or history[s, head, before] >= score:
                    break
                stack[top, FIRST_WAY + place] = before
                place -= 1
            stack[top, FIRST_WAY + place] = way
            count += 1
    if count == 0:
        stack[top, FIRST_WAY], count = 0, 1
    stack[top, SEAT], stack[top, PLY], stack[top, ALPHA], stack[top, BETA] = seat, d, alpha, beta
    stack[top, BEST], stack[top, BEST_WAY] = LEAST if seat == 0 else MOST, -1
    stack[top, NEXT], stack[top, WAYS] = 0, count


@lean_kernel
def _take_value(top, value, stack, seats, history, rows):
    """Take the value of the move that was tried last; what lies beyond the window ends the choice."""
    seat, d = stack[top, SEAT], stack[top, PLY]
    way = stack[top, FIRST_WAY + stack[top, NEXT] - 1]
    better = value > stack[top, BEST] if seat == 0 else value < stack[top, BEST]
    if better:
        stack[top, BEST], stack[top, BEST_WAY] = value, way
    cut = stack[top, BEST] >= stack[top, BETA] if seat == 0 else stack[top, BEST] <= stack[top, ALPHA]
    if cut:
        if stack[top, NEXT] > 0 and stack[top, WAYS] > 1:
            s = seats[seat]
            history[s, rows[d, s, HEAD], way] += 1
        stack[top, NEXT] = stack[top, WAYS]


@lean_kernel
def _answer(top, state, stack, seats, keys, table, ring, rows, bits):
    """Close a choice: remember it where a turn begins, and tell the one above."""
    value, d = stack[top, BEST], stack[top, PLY]
    depth = state[DEPTH] - d
    if stack[top, SEAT] == 0 and depth > 1 and d > 0:
        key = key_of(d, seats[0], ring, rows, bits)
        place = np.int64(key & np.uint64(keys.shape[0] - 1))
        kind = EXACT
        if value <= stack[top, ALPHA]:
            kind = AT_MOST
        elif value >= stack[top, BETA]:
            kind = AT_LEAST
        table[place, TABLE_VALUE], table[place, TABLE_DEPTH], table[place, TABLE_KIND] = value, depth, kind
        table[place, TABLE_WAY] = stack[top, BEST_WAY]
        seal = random_bits(np.uint64(value - LEAST), np.uint64((depth * 4 + kind) * 8 + stack[top, BEST_WAY] + 1))
        keys[place] = key ^ seal
    state[VALUE], state[TOLD] = value, 1
    state[TOP] = top - 1


@lean_kernel
def key_of(d, me, ring, rows, bits):
    """Return a number that two positions share only by the rarest accident: of bodies, healths, food and who asks."""
    key = np.uint64(rows.shape[1] * 16 + me)
    for s in range(rows.shape[1]):
        key = random_bits(key, np.uint64(rows[d, s, STACK] * 4 + (rows[d, s, OUT] == 0)))
        if rows[d, s, OUT] == 0:
            key = random_bits(key, np.uint64(rows[d, s, HEALTH]))
            for place in range(rows[d, s, COUNT]):
                cell = ring[s, (rows[d, s, START] + place) & (ring.shape[1] - 1)]
                key = (key ^ np.uint64(cell + 1)) * np.uint64(0x9E3779B97F4A7C15)
                key ^= key >> np.uint64(29)
    for word in range(bits.shape[2]):
        key = random_bits(key ^ bits[d, FOOD, word], np.uint64(word))
    return key
