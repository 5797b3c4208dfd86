"""Many games at once between a policy and anchors: how a network is judged in seconds. Begin with `play_batch`.

Seats are dealt so that everyone sits everywhere equally often; each of the N games is played once, to its end or to
the most turns. (`match.py` plays one game between any players, and `tournament.py` many such.)
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from racecraft.contract.policy import Policy
from racecraft.contract.world import Array, allocate
from racecraft.envs.battlesnake.world import BattlesnakeWorld, WorldSettings
from racecraft.evaluation.battlesnake.rating import Result
from racecraft.players.battlesnake.anchors import AnchorSeats

MOST_TURNS = 1000
"""A longer game is a draw of all who live, as in a tournament."""
NOBODY_LOOKS = 3
"""Side of the window where only anchors play, who see the board itself."""
Player = str | Policy
"""An anchor's name, or a policy that sees what the world shows."""


def play_batch(
    players: Sequence[Player], settings: WorldSettings, games: int, seed: int, most_turns: int = MOST_TURNS
) -> list[Result]:
    """Play games of M snakes between `players` (M of them), seats swapped from game to game.

    Args:
        players: Who meets; the same one may stand several times. Policies are asked for all their seats together.
        settings: What is played and seen; the numbers of snakes, games and turns are set here.
        games: How many.
        seed: Chance of the games.
        most_turns: A longer game is a draw of all who live.

    Returns:
        For each game who met (numbers of `players`, in their order) and at which places they ended.

    Raises:
        SettingError: There is no such anchor.
    """
    seats = len(players)
    game = replace(settings.game, players=seats)
    played = replace(settings, game=game, num_games=games, max_turns=most_turns)
    if all(isinstance(player, str) for player in players):
        played = replace(played, view=NOBODY_LOOKS, outlook=False)
    world = BattlesnakeWorld(played)
    try:
        sitting = (np.arange(seats) + np.arange(games)[:, None]) % seats
        lasted = _last(world, players, sitting, seed)
    finally:
        world.close()
    at = np.zeros_like(lasted)
    np.put_along_axis(at, sitting, lasted, axis=1)
    return [Result(tuple(range(seats)), tuple(int((row > own).sum()) for own in row)) for row in at]


def _last(world: BattlesnakeWorld, players: Sequence[Player], sitting: Array, seed: int) -> Array:
    """Play the first game in each place and return how many turns each seat lasted (N, M); beyond all for the last."""
    names = [[player if isinstance(player := players[one], str) else "" for one in row] for row in sitting]
    anchors = AnchorSeats(names, world)
    anchors.begin(seed)
    buffers, moves = allocate(world.spec), np.zeros(sitting.shape, np.int64)
    lasted = np.zeros(sitting.shape, np.int64)
    going = np.ones(len(sitting), bool)
    policies = ~(anchors.who > 0)
    world.looks[...] = policies
    world.reset(buffers, seed)
    while going.any():
        anchors.choose(moves)
        for number, player in enumerate(players):
            asked = (sitting == number) & going[:, None] & buffers.active
            if not isinstance(player, str) and asked.any():
                seen = {name: array[asked] for name, array in buffers.observations.items()}
                mask = None if buffers.action_mask is None else buffers.action_mask[asked]
                moves[asked] = player.act(seen, mask)
        world.step(moves, buffers)
        for one in world.take_episodes():
            if going[one.world]:
                outlived = one.status in ("won", "truncated")
                lasted[one.world, one.agent] = 1 << 30 if outlived else one.steps
        going &= ~((lasted > 0).all(axis=1))
        world.looks[...] = policies & going[:, None]
    return lasted
