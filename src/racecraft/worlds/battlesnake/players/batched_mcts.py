"""Search trees of many games, grown side by side: one question to the network for all of them.

It serves learning: every game is searched for all of its snakes at once, each of which is told how often its moves were
walked. Nothing is kept from turn to turn.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from racecraft.contract.world import Array
from racecraft.worlds.battlesnake.env.board import Board
from racecraft.worlds.battlesnake.env.settings import GameSettings
from racecraft.worlds.battlesnake.players.kernels.leaves import backup, descend_all
from racecraft.worlds.battlesnake.players.mcts import EAGERNESS, empty_nodes
from racecraft.worlds.battlesnake.players.network_tree import NETWORK_SHARE, PRIOR_SHARE, Leaves, Network
from racecraft.worlds.battlesnake.players.search_position import DEEPEST, fill_buffers, position_of

LEAVES_A_TREE = 4
"""Leaves of one tree that are asked about at once."""


class BatchedMcts:
    """Searches many games of one kind.

    Args:
        network: Who is asked about the leaves; it may learn on.
        settings: What is played.
        walks: Walks of each tree.
        noise_share: Share of chance in how likely moves are thought at the roots, so that all are tried now and then.
    """

    def __init__(self, network: Network, settings: GameSettings, walks: int, noise_share: float) -> None:
        self._network, self._settings, self._walks, self._noise_share = network, settings, walks, noise_share
        self._leaves: dict[tuple[int, int], Leaves] = {}

    def search(self, boards: Sequence[Board], chances: Sequence[np.random.Generator]) -> list[Array]:
        """Return for each board how often every living snake's moves were walked, int32 (M, 4), in their order.

        Each board has chance of its own, so that what is found there does not depend on the others.

        Raises:
            BoardError: Living snakes overlap or lie off the board.
        """
        found: list[Array] = [np.zeros((0, 4), np.int32)] * len(boards)
        numbers = [len(board.alive()) for board in boards]
        for num_snakes in sorted(set(numbers)):
            chosen = [place for place, number in enumerate(numbers) if number == num_snakes]
            for place, visits in zip(
                chosen, self._grow([boards[one] for one in chosen], [chances[one] for one in chosen]), strict=True
            ):
                found[place] = visits
        return found

    def _grow(self, boards: list[Board], chances: list[np.random.Generator]) -> Array:
        """Return visits at the roots of boards with the same number of living snakes, int32 (G, M, 4)."""
        positions = [position_of(board, self._settings) for board in boards]
        count, num_snakes = len(boards), positions[0].rows.shape[1]
        edges = positions[0].edges
        ring, rows, bits, cells, _, rules = (np.stack(arrays) for arrays in zip(*positions, strict=True))
        nodes = tuple(np.stack([array] * count) for array in empty_nodes(self._walks + 1, num_snakes))
        size, ways = np.zeros((count, 1), np.int64), np.zeros((DEEPEST, num_snakes), np.int64)
        buffers = (*fill_buffers(positions[0]), np.zeros(num_snakes))
        leaves, counts = self._leaves_for(count, num_snakes), np.zeros(count, np.int64)
        which = np.zeros(count * LEAVES_A_TREE, bool)
        everything = (ring, rows, bits, cells, edges, rules, *buffers, ways, *nodes, size)
        for number, walks in enumerate((1, self._walks)):
            left = np.full(count, walks, np.int64)
            while descend_all(
                left, EAGERNESS, LEAVES_A_TREE, *everything, *leaves.found, *leaves.games, which, counts
            ):  # fmt: skip
                backup(
                    counts, LEAVES_A_TREE, NETWORK_SHARE, PRIOR_SHARE, *leaves.found, leaves.games[1],
                    *leaves.evaluate(which), nodes[0], nodes[3], nodes[4], nodes[5],
                )  # fmt: skip
            if number == 0:
                self._stir(nodes[4][:, 0], chances)
        return nodes[2][:, 0].copy()

    def _stir(self, priors: Array, chances: list[np.random.Generator]) -> None:
        """Mix chance into the roots' priors (G, M, 4), in place; what is surely fatal stays out."""
        drawn = np.stack([chance.standard_exponential(priors.shape[1:]) for chance in chances])
        noise = np.where(priors > 0, drawn, 0.0)
        noise /= np.maximum(noise.sum(axis=-1, keepdims=True), 1e-12)
        priors[...] = (1 - self._noise_share) * priors + self._noise_share * noise

    def _leaves_for(self, count: int, num_snakes: int) -> Leaves:
        """Return room for the leaves of so many trees; rooms are kept, a few sizes of each."""
        key = count, num_snakes
        if key not in self._leaves:
            if len(self._leaves) >= 64:
                self._leaves.clear()
            self._leaves[key] = Leaves(self._network, self._settings, num_snakes, count * LEAVES_A_TREE)
        return self._leaves[key]
