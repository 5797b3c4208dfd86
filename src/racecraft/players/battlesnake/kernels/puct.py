"""The search tree, compiled: decoupled PUCT. Begin at `look_ahead`.

Snakes move at the same time, so a node keeps for every snake its own visits, worths and priors of four moves, and each
snake chooses as if alone (Tak, Lanctot, Winands: "Monte Carlo Tree Search variants for simultaneous move games", 2014).
A child is known by the joint move that leads to it. Positions are not kept: each walk replays the rules from the root.
"""

from __future__ import annotations

import numpy as np

from racecraft.envs.battlesnake.kernels.columns import ALIVE, CAUSE, SOLO, TURN
from racecraft.envs.battlesnake.kernels.rules import apply_rules
from racecraft.kernels import kernel
from racecraft.players.battlesnake.kernels.territory import appraise, copy_game, safe_ways

ROOT, WALKED = 0, 1  # games in the arrays: the position asked about, and the one that is walked forward
FIRST_CHILD, NEXT_SIBLING, IS_OVER = 0, 1, 2  # columns of links


@kernel
def look_ahead(walks, me, eager, bodies, snakes, games, cells, sides, params, links, joints, visits, sums, priors,
               first_worths, size, path, moves, scratch, squares, food_steps, worths):  # fmt: skip
    """Add walks to the tree. `size` int64 (1,) is the number of nodes; 0 begins a new tree.

    Nodes (K): links int32 (K, 3), joints int64 (K,), visits int32 (K, M, 4), sums and priors float64 (K, M, 4),
    first_worths float64 (K, M). `path` int32 (D, M + 1) holds the node and the moves of each ply of a walk.
    `eager` weighs curiosity against what is known.
    """
    num_snakes = snakes.shape[1]
    if size[0] == 0:
        copy_game(ROOT, WALKED, bodies, snakes, games, cells)
        grow(0, me, bodies, snakes, games, cells, params, links, visits, sums, priors, first_worths,
             scratch, squares, food_steps, worths)  # fmt: skip
        size[0] = 1
    for _ in range(walks):
        copy_game(ROOT, WALKED, bodies, snakes, games, cells)
        node, depth = 0, 0
        while True:
            if links[node, IS_OVER] or depth == path.shape[0]:
                for s in range(num_snakes):
                    worths[s] = first_worths[node, s]
                break
            path[depth, num_snakes] = node
            joint = np.int64(0)
            for s in range(num_snakes):
                way = 0
                if snakes[WALKED, s, CAUSE] == 0:
                    way = favourite(visits[node, s], sums[node, s], priors[node, s], first_worths[node, s], eager)
                path[depth, s] = way if snakes[WALKED, s, CAUSE] == 0 else -1
                moves[WALKED, s] = way
                joint = joint * 4 + way
            depth += 1
            apply_rules(WALKED, moves, bodies, snakes, games, cells, sides, params)
            games[WALKED, TURN] += 1
            child = links[node, FIRST_CHILD]
            while child > 0 and joints[child] != joint:
                child = links[child, NEXT_SIBLING]
            if child > 0:
                node = child
                continue
            if size[0] == links.shape[0]:
                appraise(WALKED, bodies, snakes, cells, params, scratch, squares, food_steps, worths)
                break
            child = size[0]
            size[0] += 1
            grow(child, me, bodies, snakes, games, cells, params, links, visits, sums, priors, first_worths,
                 scratch, squares, food_steps, worths)  # fmt: skip
            joints[child] = joint
            links[child, NEXT_SIBLING] = links[node, FIRST_CHILD]
            links[node, FIRST_CHILD] = child
            break
        for ply in range(depth):
            for s in range(num_snakes):
                way = path[ply, s]
                if way >= 0:
                    visits[path[ply, num_snakes], s, way] += 1
                    sums[path[ply, num_snakes], s, way] += worths[s]


@kernel
def grow(node, me, bodies, snakes, games, cells, params, links, visits, sums, priors, first_worths,
         scratch, squares, food_steps, worths):  # fmt: skip
    """Make a node of the walked position: what it is worth to each, and which moves are worth a look."""
    appraise(WALKED, bodies, snakes, cells, params, scratch, squares, food_steps, worths)
    alive = games[WALKED, ALIVE]
    links[node, FIRST_CHILD] = 0
    links[node, NEXT_SIBLING] = 0
    links[node, IS_OVER] = alive == 0 or (alive == 1 and not params[SOLO]) or snakes[WALKED, me, CAUSE] != 0
    for s in range(snakes.shape[1]):
        first_worths[node, s] = worths[s]
        count = 0
        if snakes[WALKED, s, CAUSE] == 0:
            count = safe_ways(WALKED, s, bodies, snakes, cells, params, priors[node, s])
        for way in range(4):
            visits[node, s, way], sums[node, s, way] = 0, 0.0
            priors[node, s, way] = priors[node, s, way] / count if count else 0.25


@kernel
def favourite(visits, sums, priors, first_worth, eager):
    """Return the move with the best of worth and curiosity; what was never tried is thought as good as the node."""
    root = np.sqrt(visits[0] + visits[1] + visits[2] + visits[3] + 1.0)
    best, best_score = 0, -1.0
    for way in range(4):
        if priors[way] <= 0.0:
            continue
        worth = sums[way] / visits[way] if visits[way] else first_worth
        score = worth + eager * priors[way] * root / (1.0 + visits[way])
        if score > best_score:
            best, best_score = way, score
    return best
