"""A search tree with a trained network in its leaves: where to look, and what a position is worth, as it was learned.

The network is asked about many leaves at once (`kernels/leaves.py`), for every snake on the board: its policy says how
likely each of them moves where, its critic what they may hope for. What is over is known, and no network is asked.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import NamedTuple, Protocol, runtime_checkable

import numpy as np

from racecraft.contract.world import Array
from racecraft.worlds.battlesnake.env.board import Board
from racecraft.worlds.battlesnake.env.kernels.outlook import outlook_games
from racecraft.worlds.battlesnake.env.kernels.steps import observe_games
from racecraft.worlds.battlesnake.env.observation import (
    allocate_marks,
    allocate_scratch,
    allocate_sheets,
    observation_specs,
    squares_of,
    wall_planes,
)
from racecraft.worlds.battlesnake.env.settings import GameSettings, SnakeConfig
from racecraft.worlds.battlesnake.env.state import allocate_games, params_of
from racecraft.worlds.battlesnake.players.kernels.leaves import add_opinions, select_leaves
from racecraft.worlds.battlesnake.players.kernels.puct import IS_OVER
from racecraft.worlds.battlesnake.players.mcts import EAGERNESS, Tree
from racecraft.worlds.battlesnake.players.search_position import DEEPEST
from racecraft.worlds.battlesnake.players.weights import DEFAULT_WEIGHTS

LEAVES_AT_A_TIME = 16
"""Leaves that the network is asked about at once, a millisecond or two: two looks at the clock lie so far apart."""
NETWORK_SHARE = 0.5
"""Share of the network in what a leaf is worth; the rest is area control's."""
PRIOR_SHARE = 0.9
"""How far the policy is believed; the rest goes to all moves alike that are not surely fatal."""


@runtime_checkable
class PolicyValueNetwork(Protocol):
    """A policy over single choices with a critic."""

    def evaluate(self, observations: Mapping[str, Array], action_mask: Array | None = None) -> tuple[Array, Array]:
        """Return how likely each choice is, float32 (R, A), and what is hoped for, float32 (R,), -1 to 1."""
        ...


class Network(NamedTuple):
    """A policy with its critic, and what it sees."""

    policy: PolicyValueNetwork
    seen: SnakeConfig


class Leaves:
    """Room for L leaves with M snakes each, and the network that is asked about them.

    Args:
        network: Who is asked.
        settings: What is played.
        num_snakes: M.
        most: L.
    """

    def __init__(self, network: Network, settings: GameSettings, num_snakes: int, most: int) -> None:
        self._network, settings = network, replace(settings, players=num_snakes)
        games = allocate_games(settings, most)
        self.found = (
            np.zeros((most, 2), np.int32), np.zeros((most, DEEPEST), np.int32),
            np.full((most, DEEPEST, num_snakes), -1, np.int8), np.zeros((most, num_snakes)),
        )  # fmt: skip
        """`asked`, `paths`, `tracks` and `opinions` of `kernels/leaves.py`."""
        self.games = games.bodies, games.snakes, games.games, games.cells
        """The leaves as games of the world."""
        self._params, self._squares = params_of(settings), squares_of(settings)
        self._marks = allocate_marks(settings, most, num_snakes)
        view, rows = network.seen.view, (most, num_snakes)
        self._sheets = allocate_sheets(settings, most, view)
        self._walls = wall_planes(settings.width, settings.height, view)
        specs = observation_specs(view, network.seen.outlook)
        self._shown = {name: np.zeros(rows + spec.shape, spec.dtype) for name, spec in specs.items()}
        self._active, self._mask = np.zeros(rows, bool), np.ones((*rows, 4), bool)
        self._scratch = allocate_scratch(settings, most) if network.seen.outlook else None
        self._chances, self._values = np.zeros((*rows, 4), np.float32), np.zeros(rows, np.float32)

    def evaluate(self, which: Array) -> tuple[Array, Array]:
        """Return what the network makes of the leaves marked in `which`, bool (L,): chances (L, M, 4), values (L, M).

        Rows of others, and of snakes that are out, mean nothing. The arrays are written over by the next call.
        """
        bodies, snakes, games, cells = self.games
        most = len(which)
        observe_games(
            0, most, which, bodies, snakes, games, cells, self._params, self._squares, self._marks, self._sheets,
            self._walls, self._shown["planes"], self._shown["numbers"], self._active, self._mask,
        )  # fmt: skip
        rows = self._active & which[:, None]
        if self._scratch is not None:
            outlook_games(
                0, most, which, rows, bodies, snakes, cells, self._params, self._mask, self._scratch,
                self._shown["outlook"],
            )  # fmt: skip
        inputs = {name: array[rows] for name, array in self._shown.items()}
        self._chances[rows], self._values[rows] = self._network.policy.evaluate(inputs, self._mask[rows])
        return self._chances, self._values


class NetworkTree(Tree):
    """A tree with a network in its leaves.

    Args:
        board: The position.
        settings: What is played.
        snake_id: Whose move is asked for; alive.
        network: Who is asked about the leaves.

    Raises:
        BoardError: Living snakes overlap or lie off the board.
    """

    def __init__(self, board: Board, settings: GameSettings, snake_id: str, network: Network) -> None:
        self._leaves = Leaves(network, settings, len(board.alive()), LEAVES_AT_A_TIME)
        super().__init__(board, settings, snake_id, DEFAULT_WEIGHTS)
        self.eagerness = EAGERNESS  # among several, too: as its networks were trained (`batched_mcts.py`)

    @property
    def walks_at_a_time(self) -> int:
        """Walks between two looks at the clock."""
        return LEAVES_AT_A_TIME

    def simulate(self, walks: int) -> None:
        """Add walks; the first of a new tree is about its root."""
        left = max(walks, 1 if self.size == 0 else 0)
        self.make_room(left)
        while left > 0 and not self._nodes[0][0, IS_OVER]:
            asked, ended = select_leaves(
                left, self._me, self.eagerness, 0, LEAVES_AT_A_TIME, *self.position, *self._room, self._ways,
                *self._nodes, self._size, *self._leaves.found, *self._leaves.games,
            )  # fmt: skip
            if asked + ended == 0:  # the tree is full
                return
            left -= asked + ended
            if asked:
                which = np.arange(LEAVES_AT_A_TIME) < asked
                links, _, _, sums, priors, first_worths = self._nodes
                add_opinions(
                    0, asked, NETWORK_SHARE, PRIOR_SHARE, *self._leaves.found, self._leaves.games[1],
                    *self._leaves.evaluate(which), links, sums, priors, first_worths,
                )  # fmt: skip
