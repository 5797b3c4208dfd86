"""The three built-in players that never change, at the speed of training: opponents, and yardsticks for ratings.

`kernels/anchors.py` is the same wits compiled; they see the board of the world itself.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from racecraft.contract.errors import SettingError, nearest
from racecraft.contract.random_streams import stream_keys
from racecraft.contract.world import Array
from racecraft.worlds.battlesnake.env.observation import allocate_scratch
from racecraft.worlds.battlesnake.env.world import BattlesnakeWorld
from racecraft.worlds.battlesnake.players.kernels.anchors import FLOOD_FILL, HUNGRY, NOT_HERE, RANDOM_SAFE, anchor_moves

ANCHORS = {"random_safe": RANDOM_SAFE, "hungry": HUNGRY, "flood_fill": FLOOD_FILL}
"""Name and number of each, weakest first."""


def anchor_number(name: str) -> int:
    """Return an anchor's number.

    Raises:
        SettingError: There is no such anchor.
    """
    if name not in ANCHORS:
        raise SettingError("There is no anchor '{name}'. {hint}", name=name, hint=nearest(name, ANCHORS))
    return ANCHORS[name]


class AnchorSeats:
    """Anchors at some seats of N games.

    Args:
        names: For every game the names at its M seats; "" where somebody else sits.
        world: The games.

    Raises:
        SettingError: There is no such anchor.
    """

    def __init__(self, names: Sequence[Sequence[str]], world: BattlesnakeWorld) -> None:
        numbers = [[anchor_number(name) if name else NOT_HERE for name in game] for game in names]
        self.who = np.array(numbers, np.int8)
        self.chance = np.zeros((len(numbers), 2), np.uint64)
        self._world, self._scratch = world, allocate_scratch(world.game_settings, len(numbers))

    def begin(self, seed: int) -> None:
        """Take up new dice for random_safe."""
        self.chance[:, 0] = stream_keys(seed, "snake anchors", len(self.who))
        self.chance[:, 1] = 0

    def choose(self, moves: Array) -> None:
        """Write the moves of all anchors into `moves` int64 (N, M)."""
        games = self._world.games
        anchor_moves(
            0, len(self.who), self.who, games.bodies, games.snakes, games.games, games.cells, self._world.params,
            self.chance, self._scratch, moves,
        )  # fmt: skip
