"""A tree of sums, sixteen children to a node: draw leaves in proportion to their weight.

The levels lie end to end in one float64 array, leaves first; `offsets[k]` is where level k begins. A level is padded
with zeros to a multiple of sixteen. Sixteen numbers are two cache lines, so that a million leaves are five steps away
and not twenty. Beside each number is kept its running sum among its siblings, so that a child is found by counting and
not by trying one after the other.

A node is always summed afresh from its children, in their order: the tree is a function of its leaves, and no rounding
adds up over time.

Places are unsigned in here: of a signed one Numba asks at every access whether it counts from the end, which took
longer than all the rest.
"""

from __future__ import annotations

import numpy as np

from racecraft.contract.world import Array
from racecraft.kernels import kernel

FAN_BITS = 4
FAN = 1 << FAN_BITS
U = np.uint64
BELOW_ONE = 1.0 - 2.0**-53


@kernel
def set_leaves(tree: Array, running: Array, offsets: Array, index: Array, values: Array) -> None:
    """Set leaves and the sums above them.

    Args:
        tree: float64, all levels.
        running: float64, as `tree`: the sum of each number and its elder siblings.
        offsets: int64 (L,), where each level begins.
        index: int64 (B,), which leaves, 0 or more; neighbours that share a parent cost one sum.
        values: float64 (B,), 0 or more.
    """
    for i in range(len(index)):
        tree[U(index[i])] = values[i]
    for level in range(1, len(offsets)):
        below, above = U(offsets[level - 1]), U(offsets[level])
        last = U(len(tree))  # no place at all
        for i in range(len(index)):
            place = U(index[i]) >> U(FAN_BITS * level)
            if place == last:
                continue
            last = place
            start = below + (place << U(FAN_BITS))
            total = 0.0
            for child in range(U(FAN)):
                total += tree[start + child]
                running[start + child] = total
            tree[above + place] = total


@kernel
def draw_leaves(tree: Array, running: Array, offsets: Array, uniform: Array, index: Array, share: Array) -> None:
    """Draw a leaf from each of B equal slices of the whole sum, in proportion to its weight within.

    Args:
        tree: float64, all levels; the last one is the whole sum, above 0.
        running: float64, as `tree`; see `set_leaves`.
        offsets: int64 (L,), where each level begins.
        uniform: float64 (B,), in [0, 1).
        index: int64 (B,), written: the leaves; none has weight 0.
        share: float64 (B,), written: their weight in the whole sum, above 0.
    """
    whole, count = tree[U(offsets[-1])], len(uniform)
    masses, places = np.empty(count), np.zeros(count, np.uint64)
    for i in range(count):
        masses[i] = (i + uniform[i]) / count * whole
    # Level by level, so that the memory is asked for many leaves at a time.
    for level in range(len(offsets) - 2, -1, -1):
        below = U(offsets[level])
        for i in range(U(count)):
            start = below + (places[i] << U(FAN_BITS))
            mass = min(masses[i], running[start + U(FAN - 1)] * BELOW_ONE)  # rounding may carry it past the last child
            elder = _child_at(running, start, mass)
            masses[i] = mass - (running[start + elder - U(1)] if elder > U(0) else 0.0)
            places[i] = (places[i] << U(FAN_BITS)) + elder
    for i in range(U(count)):
        index[i] = np.int64(places[i])
        share[i] = tree[places[i]] / whole


@kernel
def _child_at(running: Array, start: np.uint64, mass: float) -> np.uint64:
    """Return how many of the sixteen running sums from `start` on are `mass` or less; the last is known to be more."""
    elder = U(mass >= running[start + U(7)]) << U(3)
    elder += U(mass >= running[start + elder + U(3)]) << U(2)
    elder += U(mass >= running[start + elder + U(1)]) << U(1)
    elder += U(mass >= running[start + elder])
    return elder
