"""A tree of sums, sixteen children to a node: draw leaves in proportion to their weight.

The levels lie end to end in one float64 array, leaves first; `offsets[k]` is where level k begins. A level is padded
with zeros to a multiple of sixteen. Sixteen numbers are two cache lines, so that a million leaves are five steps away
and not twenty. A node is always summed afresh from its children, in their order: the tree is a function of its leaves,
and no rounding adds up over time.
"""

from __future__ import annotations

from racecraft.contract.world import Array
from racecraft.kernels import kernel

FAN_BITS = 4
FAN = 1 << FAN_BITS


@kernel
def set_leaves(tree: Array, offsets: Array, index: Array, values: Array) -> None:
    """Set leaves and the sums above them.

    Args:
        tree: float64, all levels.
        offsets: int64 (L,), where each level begins.
        index: int64 (B,), which leaves; neighbours that share a parent cost one sum.
        values: float64 (B,), 0 or more.
    """
    for i in range(len(index)):
        tree[index[i]] = values[i]
    for level in range(1, len(offsets)):
        last = -1
        for i in range(len(index)):
            place = index[i] >> (FAN_BITS * level)
            if place == last:
                continue
            last = place
            start = offsets[level - 1] + (place << FAN_BITS)
            total = 0.0
            for child in range(start, start + FAN):
                total += tree[child]
            tree[offsets[level] + place] = total


@kernel
def draw_leaves(tree: Array, offsets: Array, uniform: Array, index: Array, share: Array) -> None:
    """Draw a leaf from each of B equal slices of the whole sum, in proportion to its weight within.

    Args:
        tree: float64, all levels; the last one is the whole sum, above 0.
        offsets: int64 (L,), where each level begins.
        uniform: float64 (B,), in [0, 1).
        index: int64 (B,), written: the leaves; none has weight 0.
        share: float64 (B,), written: their weight in the whole sum, above 0.
    """
    whole = tree[offsets[-1]]
    count = len(uniform)
    for i in range(count):
        mass = (i + uniform[i]) / count * whole
        place = 0
        for level in range(len(offsets) - 2, -1, -1):
            start = offsets[level] + (place << FAN_BITS)
            chosen = start
            for child in range(start, start + FAN):
                weight = tree[child]
                if weight > 0.0:
                    chosen = child  # rounding may carry the mass past the last one: that one is meant then
                    if mass < weight:
                        break
                    mass -= weight
            place = chosen - offsets[level]
        index[i] = place
        share[i] = tree[place] / whole
