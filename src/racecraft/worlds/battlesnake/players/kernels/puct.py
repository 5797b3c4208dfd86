"""The search tree, compiled: decoupled PUCT. Begin at `look_ahead`.

Snakes move at the same time, so a node keeps for every snake its own visits, worths and priors of four moves, and each
snake chooses as if alone (Tak, Lanctot, Winands: "Monte Carlo Tree Search variants for simultaneous move games", 2014).
A child is known by the joint move that leads to it. Positions are not kept: each walk plays forward from the root.

A tree is, for K nodes and M snakes:

    links         int32 (K, 3)        FIRST_CHILD, NEXT_SIBLING, IS_OVER (0; 1; 2 while `leaves.py` waits for it)
    joints        int64 (K,)          the joint move that led here, two bits a snake
    visits        int32 (K, M, 4)
    sums          float64 (K, M, 4)   worths that came of each move
    priors        float32 (K, M, 4)   how likely each move is thought; 0 where it is surely fatal, if another is not
    first_worths  float32 (K, M)      what the position looked worth
    size          int64 (1,)          nodes in use; node 0 is the root, 0 nodes begin a new tree
"""

from __future__ import annotations

import numpy as np

from racecraft.kernels import lean_kernel
from racecraft.worlds.battlesnake.players.kernels.position import OUT, SOLO, advance, count_alive, safe_ways
from racecraft.worlds.battlesnake.players.kernels.worth import evaluate

FIRST_CHILD, NEXT_SIBLING, IS_OVER = 0, 1, 2


@lean_kernel
def look_ahead(walks, me, eager, ring, rows, bits, cells, edges, rules, pools, found, worths, ways, path,
               links, joints, visits, sums, priors, first_worths, size):  # fmt: skip
    """Add walks to the tree of snake `me`'s position at ply 0; a full tree is walked on, but grows no more.

    `ways` int64 (D, M) are the moves at each ply; `path` int32 (D,) the nodes that a walk comes by, D the plies it may
    have. `eager` weighs curiosity against what is known.
    """
    num_snakes, left = rows.shape[1], walks
    while left > 0 or size[0] == 0:
        node, d, child = 0, 0, 0 if size[0] == 0 else -1
        while child < 0 and not links[node, IS_OVER] and d < path.shape[0]:
            path[d] = node
            joint = np.int64(0)
            for s in range(num_snakes):
                way = 0
                if rows[d, s, OUT] == 0:
                    way = choose_way(node, s, eager, visits, sums, priors, first_worths)
                ways[d, s] = way
                joint = joint * 4 + way
            advance(d, ways, ring, rows, bits, cells, rules)
            d += 1
            known = links[node, FIRST_CHILD]
            while known > 0 and joints[known] != joint:
                known = links[known, NEXT_SIBLING]
            if known > 0:
                node = known
                continue
            child = size[0]
            if child < links.shape[0]:
                joints[child], links[child, NEXT_SIBLING] = joint, links[node, FIRST_CHILD]
                links[node, FIRST_CHILD] = child
        if child < 0:
            for s in range(num_snakes):
                worths[s] = first_worths[node, s]
        else:
            evaluate(d, ring, rows, bits, cells, edges, rules, pools, found, worths)
            if child < links.shape[0]:
                make_node(
                    child, d, me, ring, rows, bits, cells, rules, worths, links, visits, sums, priors, first_worths
                )
                size[0] = child + 1
        left -= d > 0
        for ply in range(d):
            for s in range(num_snakes):
                if rows[ply, s, OUT] == 0:
                    visits[path[ply], s, ways[ply, s]] += 1
                    sums[path[ply], s, ways[ply, s]] += worths[s]
        if links[0, IS_OVER]:
            return


@lean_kernel
def make_node(node, d, me, ring, rows, bits, cells, rules, worths, links, visits, sums, priors, first_worths):
    """Make a node of ply d: what it is worth to each, and which moves are worth a look."""
    alive = count_alive(d, rows)
    links[node, FIRST_CHILD] = 0
    links[node, IS_OVER] = alive == 0 or (alive == 1 and not rules[SOLO]) or rows[d, me, OUT] != 0
    for s in range(rows.shape[1]):
        first_worths[node, s] = worths[s]
        safe = 0
        if rows[d, s, OUT] == 0:
            safe = safe_ways(d, s, ring, rows, bits, cells, rules)
        count = (safe & 1) + (safe >> 1 & 1) + (safe >> 2 & 1) + (safe >> 3)
        for way in range(4):
            visits[node, s, way], sums[node, s, way] = 0, 0.0
            priors[node, s, way] = (safe >> way & 1) / count if count else 0.25


@lean_kernel
def choose_way(node, s, eager, visits, sums, priors, first_worths):
    """Return the move with the best of worth and curiosity; what was never tried is thought as good as the node."""
    tried = visits[node, s, 0] + visits[node, s, 1] + visits[node, s, 2] + visits[node, s, 3]
    root = np.sqrt(tried + 1.0)
    best, best_score = 0, -1.0
    for way in range(4):
        if priors[node, s, way] <= 0.0:
            continue
        count = visits[node, s, way]
        worth = sums[node, s, way] / count if count else first_worths[node, s]
        score = worth + eager * priors[node, s, way] * root / (1.0 + count)
        if score > best_score:
            best, best_score = way, score
    return best


@lean_kernel
def transplant(root, links, joints, visits, sums, priors, first_worths, places, new_links, new_joints, new_visits,
               new_sums, new_priors, new_first_worths):  # fmt: skip
    """Copy the tree below node `root` into other arrays, where it is node 0; return how many nodes it has.

    `places` int32 (K,) is room for the way there. Siblings keep their order.
    """
    places[0], count, done = root, 1, 0
    new_links[0, NEXT_SIBLING] = 0
    while done < count:
        node = places[done]
        new_joints[done], new_links[done, IS_OVER] = joints[node], links[node, IS_OVER]
        for s in range(visits.shape[1]):
            new_first_worths[done, s] = first_worths[node, s]
            for way in range(4):
                new_visits[done, s, way], new_sums[done, s, way] = visits[node, s, way], sums[node, s, way]
                new_priors[done, s, way] = priors[node, s, way]
        child, before = links[node, FIRST_CHILD], -1
        new_links[done, FIRST_CHILD] = count if child > 0 else 0
        while child > 0:
            places[count] = child
            if before >= 0:
                new_links[before, NEXT_SIBLING] = count
            new_links[count, NEXT_SIBLING] = 0
            before = count
            count += 1
            child = links[child, NEXT_SIBLING]
        done += 1
    return count
