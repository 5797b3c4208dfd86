"""Many games at once between a policy and anchors: how a network is judged in seconds. Begin with `play_batch`.

Seats are dealt so that everyone sits everywhere equally often; each of the N games is played once, to its end or to
the most turns. (`match.py` plays one game between any players, and `tournament.py` many such.)
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from racecraft.contract.policy import Policy
from racecraft.contract.world import Array
from racecraft.evaluation.rating import Result
from racecraft.rollout.episodes import play_episodes
from racecraft.worlds.battlesnake.env.world import BattlesnakeWorld, WorldSettings
from racecraft.worlds.battlesnake.players.anchors import AnchorSeats

MAX_TURNS = 1000
"""A longer game is a draw of all who live, as in a tournament."""
OUTLIVED = 1 << 30
"""Turns of whoever was still there at the end: more than anybody's who was not."""
STAYED = ("won", "truncated")
"""Statuses of episodes at whose end the snake lived."""
NOBODY_LOOKS = 3
"""Side of the window where only anchors play, who see the board itself."""
Player = str | Policy
"""An anchor's name, or a policy that sees what the world shows."""


def play_batch(
    players: Sequence[Player], settings: WorldSettings, games: int, seed: int, most_turns: int = MAX_TURNS
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
    sitting = (np.arange(seats) + np.arange(games)[:, None]) % seats
    world = BattlesnakeWorld(played)
    try:
        records = play_episodes(SeatedPlayers(players, sitting, world, seed), world, seed=seed)
    finally:
        world.close()
    steps = np.array([one.steps for one in records]).reshape(sitting.shape).sum(axis=1).tolist()
    lasted = np.array([OUTLIVED if one.status in STAYED else one.steps for one in records]).reshape(sitting.shape)
    at = np.zeros_like(lasted)
    np.put_along_axis(at, sitting, lasted, axis=1)
    places = [tuple(int((row > own).sum()) for own in row) for row in at]
    return [Result(tuple(range(seats)), *each) for each in zip(places, steps, strict=True)]


class SeatedPlayers:
    """Several players as one policy over all seats of N games; whose game is over is asked, and shown, no more.

    Args:
        players: Who meets.
        sitting: Who sits where: numbers of `players`, (N, M).
        world: The games; not yet begun.
        seed: Chance of the anchors.
    """

    def __init__(self, players: Sequence[Player], sitting: Array, world: BattlesnakeWorld, seed: int) -> None:
        names = [[player if isinstance(player := players[one], str) else "" for one in row] for row in sitting]
        self._policies = {number: player for number, player in enumerate(players) if not isinstance(player, str)}
        self._sitting, self._world = sitting, world
        self._anchors = AnchorSeats(names, world)
        self._anchors.begin(seed)
        self._sees = ~(self._anchors.who > 0)
        self._moves = np.zeros(sitting.shape, np.int64)
        self._playing = np.zeros(sitting.shape, bool)
        world.looks[...] = self._sees

    def reset_state(self, rows: Array) -> None:
        """Begin, when nobody plays yet; then tell whose episode has ended."""
        if not self._playing.any():
            self._playing[...] = True
            return
        self._playing &= ~rows.reshape(self._playing.shape)
        self._world.looks[...] = self._sees & self._playing.any(axis=1, keepdims=True)

    def act(self, observations: Mapping[str, Array], action_mask: Array | None = None) -> Array:
        """Return a move for every seat, int64 (N * M,)."""
        self._anchors.choose(self._moves)
        moves = self._moves.reshape(-1)
        for number, policy in self._policies.items():
            rows = ((self._sitting == number) & self._playing).reshape(-1)
            if rows.any():
                seen = {name: part[rows] for name, part in observations.items()}
                moves[rows] = policy.act(seen, None if action_mask is None else action_mask[rows])
        return moves
