"""Leaves of a search tree that a network appraises, compiled: many are found, then asked about at once.

`select_leaves` walks a tree of `puct.py` to positions that it does not know and lays them out as games of the world
(`env/state.py`), where the same kernels as in training say what each snake sees. `add_opinions` takes what the
network made of them back up the tree.

A walk that waits for its answer counts on its way as one that came to nothing ("virtual loss"), so that the next walks
of the batch look elsewhere; the answer makes it good. A walk that comes to a leaf which is still waited for is taken
back, and ends the batch.

L leaves of a batch, for M snakes and D plies:

    asked    int32 (L, 2)      NODE that the leaf is, and its PLY
    paths    int32 (L, D)      nodes on the way there
    tracks   int8 (L, D, M)    moves on the way; -1 of those who were out
    opinions float64 (L, M)    what area control says of the leaf
"""

from __future__ import annotations

import numpy as np

from racecraft.kernels import lean_kernel
from racecraft.worlds.battlesnake.env.kernels import columns as col
from racecraft.worlds.battlesnake.players.kernels import position as at
from racecraft.worlds.battlesnake.players.kernels.puct import FIRST_CHILD, IS_OVER, NEXT_SIBLING, choose_way, make_node
from racecraft.worlds.battlesnake.players.kernels.worth import evaluate

NODE, PLY = 0, 1
AWAITED = 2
MIN_WORTH, MAX_WORTH = 0.02, 0.98
"""What no opinion goes beyond: only what is over is worth 0 or 1."""


@lean_kernel
def select_leaves(walks, me, eager, first, beyond, ring, rows, bits, cells, edges, rules, pools, found, worths, ways,
            links, joints, visits, sums, priors, first_worths, size,
            asked, paths, tracks, opinions, bodies, snakes, games, board_cells):  # fmt: skip
    """Walk down up to `walks` times and lay out the leaves found as games `first` … `beyond` - 1.

    Returns:
        How many leaves there are to ask about, and how many walks came to an end that needs no asking. `me` is the
        snake whose end ends the tree, -1 for none. The arrays of the tree are those of `puct.look_ahead`.
    """
    leaf, done = first, 0
    while done + leaf - first < walks and leaf < beyond:
        node, d, is_new = 0, 0, size[0] == 0
        while not is_new and links[node, IS_OVER] == 0 and d < paths.shape[1]:
            paths[leaf, d] = node
            joint = np.int64(0)
            for s in range(rows.shape[1]):
                way = 0
                tracks[leaf, d, s] = -1
                if rows[d, s, at.OUT] == 0:
                    way = choose_way(node, s, eager, visits, sums, priors, first_worths)
                    tracks[leaf, d, s] = way
                ways[d, s] = way
                joint = joint * 4 + way
            for s in range(rows.shape[1]):
                if rows[d, s, at.OUT] == 0:
                    visits[node, s, ways[d, s]] += 1
            at.advance(d, ways, ring, rows, bits, cells, rules)
            d += 1
            known = links[node, FIRST_CHILD]
            while known > 0 and joints[known] != joint:
                known = links[known, NEXT_SIBLING]
            if known > 0:
                node = known
                continue
            is_new = True
            if size[0] < links.shape[0]:
                joints[size[0]], links[size[0], NEXT_SIBLING] = joint, links[node, FIRST_CHILD]
                links[node, FIRST_CHILD] = size[0]
        if (is_new and size[0] == links.shape[0]) or links[node, IS_OVER] == AWAITED:
            _take_back(leaf, d, paths, tracks, visits)
            break
        if is_new:
            node = size[0]
            size[0] += 1
            evaluate(d, ring, rows, bits, cells, edges, rules, pools, found, worths)
            make_node(node, d, me, ring, rows, bits, cells, rules, worths, links, visits, sums, priors, first_worths)
            if links[node, IS_OVER] == 0:
                links[node, IS_OVER] = AWAITED
                asked[leaf, NODE], asked[leaf, PLY] = node, d
                for s in range(rows.shape[1]):
                    opinions[leaf, s] = worths[s]
                _write_board(leaf, d, ring, rows, bits, cells, rules, bodies, snakes, games, board_cells)
                leaf += 1
                continue
        _back_up(leaf, d, node, paths, tracks, sums, first_worths)
        done += 1
        if d == 0:
            break
    return leaf - first, done


@lean_kernel
def add_opinions(first, beyond, network_share, prior_share, asked, paths, tracks, opinions, snakes, chances, values,
         links, sums, priors, first_worths):  # fmt: skip
    """Take what a network made of leaves `first` … `beyond` - 1 into the tree.

    Args:
        first: First leaf of this tree.
        beyond: The leaf after its last.
        network_share: Share of the network in what a leaf is worth; the rest is area control's.
        prior_share: How far its chances are believed; the rest goes to all moves alike that are not surely fatal.
        asked: As `select_leaves` left it, as are `paths`, `tracks`, `opinions` and `snakes`.
        paths: See above.
        tracks: See above.
        opinions: See above.
        snakes: See above.
        chances: float32 (L, M, 4), each row's sum 1.
        values: float32 (L, M), -1 (lost) to 1 (won).
        links: The tree's, as are the rest.
        sums: See above.
        priors: See above.
        first_worths: See above.
    """
    for leaf in range(first, beyond):
        node = asked[leaf, NODE]
        links[node, IS_OVER] = 0
        for s in range(priors.shape[1]):
            if snakes[leaf, s, col.CAUSE]:
                continue
            value = 0.5 + 0.5 * values[leaf, s]
            worth = network_share * value + (1.0 - network_share) * opinions[leaf, s]
            first_worths[node, s] = min(MAX_WORTH, max(MIN_WORTH, worth))
            total = 0.0
            for way in range(4):
                if priors[node, s, way] > 0.0:
                    total += chances[leaf, s, way]
            if total > 0.0:
                for way in range(4):
                    if priors[node, s, way] > 0.0:
                        believed = prior_share * chances[leaf, s, way] / total
                        priors[node, s, way] = believed + (1.0 - prior_share) * priors[node, s, way]
        _back_up(leaf, asked[leaf, PLY], node, paths, tracks, sums, first_worths)


@lean_kernel
def _back_up(leaf, d, node, paths, tracks, sums, first_worths):
    """Tell all nodes on the way what it led to; the visits are counted already."""
    for ply in range(d):
        for s in range(sums.shape[1]):
            if tracks[leaf, ply, s] >= 0:
                sums[paths[leaf, ply], s, tracks[leaf, ply, s]] += first_worths[node, s]


@lean_kernel
def _take_back(leaf, d, paths, tracks, visits):
    """Uncount the visits of a walk."""
    for ply in range(d):
        for s in range(visits.shape[1]):
            if tracks[leaf, ply, s] >= 0:
                visits[paths[leaf, ply], s, tracks[leaf, ply, s]] -= 1


@lean_kernel
def _write_board(g, d, ring, rows, bits, cells, rules, bodies, snakes, games, board_cells):
    """Write ply d as game g of the world; who has left is out."""
    last, food, alive = bodies.shape[2] - 1, 0, 0
    for cell in range(cells.shape[0]):
        meal = at.is_set(d, at.FOOD, cell, bits)
        food += meal
        board_cells[g, col.OWNER, cell], board_cells[g, col.MEAL, cell] = 0, meal
        board_cells[g, col.HAZARD, cell] = cells[cell, at.HAZARDS]
    for s in range(rows.shape[1]):
        snakes[g, s, col.CAUSE] = rows[d, s, at.OUT] != 0
        if rows[d, s, at.OUT]:
            continue
        alive += 1
        start, count = rows[d, s, at.START], rows[d, s, at.COUNT]
        length = min(count + rows[d, s, at.STACK], last + 1)
        for place in range(length):
            cell = ring[s, (start + min(place, count - 1)) & (ring.shape[1] - 1)]
            bodies[g, s, place] = cell
            board_cells[g, col.OWNER, cell] = s + 1
        head = rows[d, s, at.HEAD]
        snakes[g, s, col.X], snakes[g, s, col.Y] = head % rules[at.WIDTH], head // rules[at.WIDTH]
        snakes[g, s, col.START], snakes[g, s, col.LENGTH] = 0, length
        snakes[g, s, col.HEALTH] = rows[d, s, at.HEALTH]
    games[g, col.TURN], games[g, col.FOOD], games[g, col.ALIVE] = rules[at.TURN] + d, food, alive


@lean_kernel
def descend_all(left, eager, each, ring, rows, bits, cells, edges, rules, pools, found, worths, ways,
                links, joints, visits, sums, priors, first_worths, size,
                asked, paths, tracks, opinions, bodies, snakes, games, board_cells, which, counts):  # fmt: skip
    """Let G trees walk side by side, up to `left` int64 (G,) walks and `each` leaves a tree; all arrays begin with G.

    Leaves g * `each` … are those of tree g: `which` bool (G * each,) says which are to be asked about, `counts` int64
    (G,) how many of each tree. Returns how many they are altogether.
    """
    total = 0
    for g in range(left.shape[0]):
        counts[g] = 0
        for leaf in range(g * each, (g + 1) * each):
            which[leaf] = False
        if left[g] <= 0:
            continue
        waiting, ended = select_leaves(
            left[g], -1, eager, g * each, (g + 1) * each, ring[g], rows[g], bits[g], cells[g], edges, rules[g], pools,
            found, worths, ways, links[g], joints[g], visits[g], sums[g], priors[g], first_worths[g], size[g],
            asked, paths, tracks, opinions, bodies, snakes, games, board_cells,
        )  # fmt: skip
        left[g] -= waiting + ended
        if waiting + ended == 0:
            left[g] = 0
        for leaf in range(g * each, g * each + waiting):
            which[leaf] = True
        counts[g] = waiting
        total += waiting
    return total


@lean_kernel
def backup(counts, each, network_share, prior_share, asked, paths, tracks, opinions, snakes, chances, values,
             links, sums, priors, first_worths):  # fmt: skip
    """Take what a network made of the leaves of G trees into them; see `descend_all` and `add_opinions`."""
    for g in range(counts.shape[0]):
        add_opinions(
            g * each, g * each + counts[g], network_share, prior_share, asked, paths, tracks, opinions, snakes,
            chances, values, links[g], sums[g], priors[g], first_worths[g],
        )  # fmt: skip
