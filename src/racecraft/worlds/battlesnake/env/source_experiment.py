"""The worlds of AWS's published comparison, each made with `num_worlds` alone, as `gym train module:Class` asks.

Five snakes on 11 x 11 that share one policy, the prices of April 2020: 0.05 a turn, 5 for the win, -1 for a death, and
-1 for a forbidden move where the rules know one. `Masked…` is what ours is trained in: the same games and prices with
an action mask, seen from the snake's own head.
"""

from __future__ import annotations

from dataclasses import replace

from racecraft.worlds.battlesnake.env.settings import GameSettings
from racecraft.worlds.battlesnake.env.starter_pack import REWARDS_APRIL_2020 as PAID
from racecraft.worlds.battlesnake.env.starter_pack_world import MAX_TURNS, SOURCE_SIDE, SOURCE_SNAKES, StarterPackWorld
from racecraft.worlds.battlesnake.env.world import BattlesnakeWorld, RewardWeights, WorldSettings

PRIZES = RewardWeights(turn=PAID.another_turn, win=PAID.won, loss=PAID.died)
GAME = GameSettings(SOURCE_SIDE, SOURCE_SIDE, SOURCE_SNAKES)


class StarterPackGames(StarterPackWorld):
    """The starter pack's rules, no mask."""

    def __init__(self, num_worlds: int) -> None:
        super().__init__(num_worlds)


class MaskedStarterPackGames(StarterPackWorld):
    """The starter pack's rules with an action mask, the head in the middle of what is seen."""

    def __init__(self, num_worlds: int) -> None:
        super().__init__(num_worlds, is_masked=True, is_centred=True)


class MaskedExactGames(BattlesnakeWorld):
    """The official rules with an action mask and the outlook behind each move."""

    def __init__(self, num_worlds: int) -> None:
        super().__init__(WorldSettings(GAME, num_worlds, MAX_TURNS, outlook=True, prizes=PRIZES))


class ExactGames(BattlesnakeWorld):
    """The official rules, no mask."""

    def __init__(self, num_worlds: int) -> None:
        super().__init__(WorldSettings(GAME, num_worlds, MAX_TURNS, prizes=PRIZES))
        self._spec = replace(self._spec, has_action_mask=False)
