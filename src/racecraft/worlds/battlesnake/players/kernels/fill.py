"""Whose squares are whose, compiled: all heads pour out at once over a board of bits.

A square belongs to whoever can be there first, among equals to the longest, between equal lengths to nobody. Squares
under bodies open when the body has moved on, if nobody eats. The same law as `territory.claim`, sixty-four squares at a
time. Two words, that is boards of up to 128 squares, have a way of their own in which most bits stay in registers.
"""

from __future__ import annotations

import numpy as np

from racecraft.kernels import lean_kernel
from racecraft.worlds.battlesnake.players.kernels.position import (
    BOARD,
    BODIES,
    BOTTOM,
    COUNT,
    FOOD,
    HEAD,
    HEIGHT,
    LEFT,
    LOW_SIX,
    NONE,
    ONE,
    OUT,
    RIGHT,
    STACK,
    START,
    TOP,
    WIDTH,
    WRAPPED,
)

WORD = np.uint64(64)
FRONT, FRESH, OWN = 0, 1, 2
"""Planes of a snake's water: reached last, reached now, its own so far."""
SPARE = 0
"""Row of `pools` beyond the snakes' that is room for everybody: its planes are CLOSED, CLAIMED and a free board."""
CLOSED, CLAIMED, FREE = 0, 1, 2
SQUARES, MEAL_STEPS, LENGTH = 0, 1, 2
"""Columns of `found`."""


@lean_kernel
def count_bits(word):
    """Return how many bits of a word are set (LLVM knows the pattern)."""
    word = word - ((word >> ONE) & np.uint64(0x5555555555555555))
    word = (word & np.uint64(0x3333333333333333)) + ((word >> np.uint64(2)) & np.uint64(0x3333333333333333))
    word = (word + (word >> np.uint64(4))) & np.uint64(0x0F0F0F0F0F0F0F0F)
    return np.int64((word * np.uint64(0x0101010101010101)) >> np.uint64(56))


@lean_kernel
def claim(d, ring, rows, bits, edges, rules, pools, found):
    """Count every snake's squares at ply d, and its steps to the nearest food of its own.

    `pools` uint64 (M + 1, 3, W) is room to pour; `found` int32 (M, 3) is written: squares, steps to food (as many as
    the board has squares where there is none of its own) and length; 0 squares for those who are out.
    """
    for s in range(rows.shape[1]):
        found[s, SQUARES], found[s, MEAL_STEPS] = 0, rules[WIDTH] * rules[HEIGHT]
        found[s, LENGTH] = rows[d, s, COUNT] + rows[d, s, STACK]
        for word in range(bits.shape[2]):
            pools[s, FRONT, word] = NONE
            pools[s, FRESH, word] = NONE
            pools[s, OWN, word] = NONE
        if rows[d, s, OUT] == 0:
            cell = rows[d, s, HEAD]
            pools[s, FRONT, cell >> 6] = ONE << (np.uint64(cell) & LOW_SIX)
    if bits.shape[2] == 2:
        _pour_two_words(d, ring, rows, bits, edges, rules, pools, found)
    else:
        _pour(d, ring, rows, bits, edges, rules, pools, found)
    for s in range(rows.shape[1]):
        if rows[d, s, OUT] == 0:
            for word in range(bits.shape[2]):
                found[s, SQUARES] += count_bits(pools[s, OWN, word])


@lean_kernel
def _opening(d, s, step, ring, rows):
    """Return the cell that the tail of snake s leaves at a step; -1 where it leaves none. Heads are their snake's."""
    place = rows[d, s, COUNT] - step + rows[d, s, STACK]
    if rows[d, s, OUT] or place <= 0 or place >= rows[d, s, COUNT]:
        return -1
    return ring[s, (rows[d, s, START] + place) & (ring.shape[1] - 1)]


@lean_kernel
def _pour_two_words(d, ring, rows, bits, edges, rules, pools, found):
    num_snakes, step, flows = rows.shape[1], 0, True
    closed, high_closed = bits[d, BODIES, 0], bits[d, BODIES, 1]
    food, high_food = bits[d, FOOD, 0], bits[d, FOOD, 1]
    claimed, high_claimed = NONE, NONE
    while flows:
        step += 1
        for s in range(num_snakes):
            cell = _opening(d, s, step, ring, rows)
            if cell >= 64:
                high_closed &= ~(ONE << (np.uint64(cell) & LOW_SIX))
            elif cell >= 0:
                closed &= ~(ONE << np.uint64(cell))
        to, high_to = edges[BOARD, 0] & ~closed & ~claimed, edges[BOARD, 1] & ~high_closed & ~high_claimed
        for s in range(num_snakes):
            if pools[s, FRONT, 0] | pools[s, FRONT, 1]:
                low, high = _spread(pools[s, FRONT, 0], pools[s, FRONT, 1], edges, rules)
                pools[s, FRESH, 0], pools[s, FRESH, 1] = low & to, high & high_to
            else:
                pools[s, FRESH, 0], pools[s, FRESH, 1] = NONE, NONE
        flows = False
        for s in range(num_snakes):
            low, high = pools[s, FRESH, 0], pools[s, FRESH, 1]
            claimed |= low
            high_claimed |= high
            for other in range(num_snakes):
                if other != s and found[other, LENGTH] >= found[s, LENGTH]:
                    low &= ~pools[other, FRESH, 0]
                    high &= ~pools[other, FRESH, 1]
            pools[s, FRONT, 0], pools[s, FRONT, 1] = low, high
            pools[s, OWN, 0] |= low
            pools[s, OWN, 1] |= high
            flows = flows or (low | high) != NONE
            if (low & food) | (high & high_food) and step < found[s, MEAL_STEPS]:
                found[s, MEAL_STEPS] = step


@lean_kernel
def _spread(low, high, edges, rules):
    """Return the four neighbours of all squares of a board of two words."""
    width = np.uint64(rules[WIDTH])
    rest = WORD - width
    to = (low << width) | (low >> width) | (high << rest)
    high_to = (high << width) | (low >> rest) | (high >> width)
    leftward, high_leftward = low & ~edges[LEFT, 0], high & ~edges[LEFT, 1]
    rightward, high_rightward = low & ~edges[RIGHT, 0], high & ~edges[RIGHT, 1]
    to |= (leftward >> ONE) | (high_leftward << LOW_SIX) | (rightward << ONE)
    high_to |= (high_leftward >> ONE) | (high_rightward << ONE) | (rightward >> LOW_SIX)
    if rules[WRAPPED]:
        back = width - ONE
        left, high_left = low & edges[LEFT, 0], high & edges[LEFT, 1]
        right, high_right = low & edges[RIGHT, 0], high & edges[RIGHT, 1]
        to |= (left << back) | (right >> back) | (high_right << (WORD - back))
        high_to |= (high_left << back) | (left >> (WORD - back)) | (high_right >> back)
        far = width * np.uint64(rules[HEIGHT] - 1)
        bottom, top, high_top = low & edges[BOTTOM, 0], low & edges[TOP, 0], high & edges[TOP, 1]
        if far > WORD:
            high_to |= bottom << (far - WORD)
            to |= high_top >> (far - WORD)
        elif far == WORD:
            high_to |= bottom
            to |= high_top
        else:
            to |= (bottom << far) | (top >> far) | (high_top << (WORD - far))
            high_to |= bottom >> (WORD - far)
    return to, high_to


@lean_kernel
def _pour(d, ring, rows, bits, edges, rules, pools, found):
    """The same for a board of any size."""
    num_snakes, words, step, flows = rows.shape[1], bits.shape[2], 0, True
    spare = num_snakes
    for word in range(words):
        pools[spare, CLOSED, word], pools[spare, CLAIMED, word] = bits[d, BODIES, word], NONE
    while flows:
        step += 1
        for s in range(num_snakes):
            cell = _opening(d, s, step, ring, rows)
            if cell >= 0:
                pools[spare, CLOSED, cell >> 6] &= ~(ONE << (np.uint64(cell) & LOW_SIX))
        for s in range(num_snakes):
            _spread_words(s, edges, rules, pools)
        flows = False
        for word in range(words):
            food, claimed = bits[d, FOOD, word], NONE
            for s in range(num_snakes):
                mine = pools[s, FRESH, word]
                claimed |= mine
                for other in range(num_snakes):
                    if other != s and found[other, LENGTH] >= found[s, LENGTH]:
                        mine &= ~pools[other, FRESH, word]
                pools[s, FRONT, word] = mine
                pools[s, OWN, word] |= mine
                flows = flows or mine != NONE
                if mine & food and step < found[s, MEAL_STEPS]:
                    found[s, MEAL_STEPS] = step
            pools[spare, CLAIMED, word] |= claimed


@lean_kernel
def _spread_words(s, edges, rules, pools):
    """Write the open neighbours of what snake s reached last, which nobody has, as what it reaches now."""
    words, width = edges.shape[1], rules[WIDTH]
    far = width * (rules[HEIGHT] - 1)
    for word in range(words):
        pools[s, FRESH, word] = NONE
    for word in range(words):
        front = pools[s, FRONT, word]
        if front == NONE:
            continue
        _add_shifted(s, word, front, width, pools)
        _add_shifted(s, word, front, -width, pools)
        _add_shifted(s, word, front & ~edges[LEFT, word], -1, pools)
        _add_shifted(s, word, front & ~edges[RIGHT, word], 1, pools)
        if rules[WRAPPED]:
            _add_shifted(s, word, front & edges[LEFT, word], width - 1, pools)
            _add_shifted(s, word, front & edges[RIGHT, word], 1 - width, pools)
            _add_shifted(s, word, front & edges[BOTTOM, word], far, pools)
            _add_shifted(s, word, front & edges[TOP, word], -far, pools)
    spare = pools.shape[0] - 1
    for word in range(words):
        pools[s, FRESH, word] &= edges[BOARD, word] & ~pools[spare, CLOSED, word] & ~pools[spare, CLAIMED, word]


@lean_kernel
def _add_shifted(s, word, bits, places, pools):
    """Add a word's bits, moved by so many cells, to what snake s reaches now."""
    words, rest = abs(places) >> 6, np.uint64(abs(places) & 63)
    near = word + words if places > 0 else word - words
    far = near + 1 if places > 0 else near - 1
    if 0 <= near < pools.shape[2]:
        pools[s, FRESH, near] |= bits << rest if places > 0 else bits >> rest
    if rest and 0 <= far < pools.shape[2]:
        pools[s, FRESH, far] |= bits >> (WORD - rest) if places > 0 else bits << (WORD - rest)
