"""Battlesnake as a PettingZoo environment, all seats open, in PettingZoo's way of naming.

::

    from racecraft.worlds.battlesnake import adapter as battlesnake_v0

    env = battlesnake_v0.parallel_env(width=11, height=11, snakes=4)

Observations, actions and rewards are those of `racecraft/Battlesnake-v0`; agents are `agent_0`, `agent_1` and so on.
`env()` gives the same game in turns (PettingZoo's AEC form).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict
from typing import Any

from racecraft.adapters.pettingzoo_parallel import pettingzoo_parallel
from racecraft.contract.errors import SettingError, nearest
from racecraft.worlds.battlesnake.env.settings import GameSettings
from racecraft.worlds.battlesnake.env.world import BattlesnakeWorld, RewardWeights, WorldSettings


def parallel_env(
    width: int = 11,
    height: int = 11,
    snakes: int = 4,
    ruleset: str = "standard",
    map: str = "standard",
    max_turns: int = 500,
    view: int | None = None,
    outlook: bool = False,
    prizes: Mapping[str, float] | None = None,
) -> Any:
    """Return one game as a `pettingzoo.ParallelEnv`.

    Args:
        width: Squares from left to right, 3 to 25.
        height: Squares from bottom to top, 3 to 25.
        snakes: Seats, 1 to 16.
        ruleset: standard, solo, royale, constrictor, wrapped, wrapped_constrictor.
        map: Name of a map.
        max_turns: A game that lasts longer is cut.
        view: Side of the window about the head in squares, odd; None: the whole board from anywhere, at most 21.
        outlook: Whether a snake is told what lies behind each of its moves, too.
        prizes: What is paid: `turn`, `food`, `kill`, `win`, `loss`; 1 for a win and -1 for a death unless told.

    Raises:
        MissingExtraError: PettingZoo is not installed.
        BoardError: A size, ruleset, map or number that cannot be played.
    """
    known = asdict(RewardWeights())
    for name in prizes or {}:
        if name not in known:
            raise SettingError("There is no prize '{name}'. {hint}", name=name, hint=nearest(name, known))
    game = GameSettings(width, height, snakes, ruleset, map)
    settings = WorldSettings(game, 1, max_turns, view, outlook, RewardWeights(**{**known, **(prizes or {})}))
    return pettingzoo_parallel(BattlesnakeWorld(settings))


def env(**options: Any) -> Any:
    """Return the same game as a `pettingzoo.AECEnv`, agent after agent; options as for `parallel_env`."""
    game = parallel_env(**options)
    from pettingzoo.utils.conversions import parallel_to_aec

    return parallel_to_aec(game)
