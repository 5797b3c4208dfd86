"""Self-play as a world: what the learner sees of it are its own seats, one row each. Begin with `SelfPlayWorld.step`.

Games are dealt once: a share against anchors (built-in players), one against foreign snakes where there are any, one
against a past self, the rest against itself. In the last the learner holds all seats, in the others seat 0 (start
squares are drawn, so that no seat is better). Opponents' seats are no rows here, so nothing of theirs is ever learned
from. Who the past self is, the world does not know: to it that is a policy like another (`opponent_pool.py`).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Protocol

import numpy as np

from racecraft.contract.policy import Policy
from racecraft.contract.world import Array, EpisodeRecord, StepBuffers, WorldSpec, allocate
from racecraft.training.learner_rows import LearnerRows
from racecraft.worlds.battlesnake.env.settings import SnakeConfig
from racecraft.worlds.battlesnake.env.world import BattlesnakeWorld, RewardWeights, WorldSettings
from racecraft.worlds.battlesnake.players.anchors import AnchorSeats
from racecraft.worlds.battlesnake.training.foreign_seats import ForeignSeats
from racecraft.worlds.battlesnake.training.settings import SelfPlayConfig

ANCHOR, FOREIGN, PAST, SELF = "anchor", "foreign", "past", "self"
"""Whom a game is played against."""


class Opponent(Policy, Protocol):
    """A policy that plays the seats of past selves."""

    def begin(self, seed: int) -> None:
        """Take up new dice."""
        ...


class SelfPlayWorld:
    """Learner's seats of N games, as R worlds of one agent.

    Args:
        game: What is played, by at least two.
        config: Whom the learner meets.
        opponent: Who plays the seats of past selves; `None` until `meet` brings one.
    """

    def __init__(self, game: WorldSettings, config: SelfPlayConfig, opponent: Opponent | None = None) -> None:
        self.config, self._opponent = config, opponent
        self.inner = BattlesnakeWorld(game)
        num_games, seats = self.inner.spec.num_worlds, self.inner.spec.num_agents
        self.dealt = deal(num_games, self.config)
        mine = np.zeros((num_games, seats), bool)
        mine[:, 0] = True
        mine[[kind == SELF for kind in self.dealt]] = True
        self._own = LearnerRows(mine)
        self._past = np.zeros_like(mine)
        self._past[[kind == PAST for kind in self.dealt], 1:] = True
        self.inner.looks[...] = mine | self._past
        self._anchors = AnchorSeats(self._seating(seats), self.inner)
        self._foreign = ForeignSeats(self._foreign_seating(seats), self.inner, config.foreign_ms)
        self._spec = replace(self.inner.spec, num_worlds=len(self._own), num_agents=1)
        self._buffers = allocate(self.inner.spec)
        self._moves = np.zeros((num_games, seats), np.int64)

    def meet(self, opponent: Opponent) -> None:
        """Let somebody play the seats of past selves from now on."""
        self._opponent = opponent

    @property
    def spec(self) -> WorldSpec:
        """R rows of one agent."""
        return self._spec

    @property
    def mine(self) -> Array:
        """Which seats are the learner's, bool (N, M); its rows are these, game by game."""
        return self._own.mine

    def reset(self, buffers: StepBuffers, seed: int) -> None:
        """Begin every game anew; the seed decides the opponents' dice, too."""
        self._anchors.begin(seed)
        if self._opponent is not None:
            self._opponent.begin(seed + 2)
        self.inner.reset(self._buffers, seed)
        self._show(buffers)

    def step(self, actions: Array, buffers: StepBuffers) -> None:
        """Play one turn of every game: the learner's moves as given, everybody else's as they choose."""
        self._moves[self._own.mine] = actions[:, 0]
        self._anchors.choose(self._moves)
        self._ask_opponent()
        self._foreign.choose(self._moves)
        self.inner.step(self._moves, self._buffers)
        self._own.hand_on(self._buffers, buffers)
        self._show(buffers)

    def pop_episodes(self) -> list[EpisodeRecord]:
        """Return the finished episodes of the learner's seats; the agent is always 0, the world the row."""
        return self._own.episodes(self.inner.pop_episodes())

    def save_state(self) -> dict[str, Array]:
        """Return copies of everything: games and the anchors' dice. The opponent keeps its own state."""
        state = {f"game.{name}": array for name, array in self.inner.save_state().items()}
        state["anchors"] = self._anchors.chance.copy()
        return state

    def load_state(self, state: Mapping[str, Array], buffers: StepBuffers) -> None:
        """Go on from a saved state."""
        self.inner.load_state(_under("game.", state), self._buffers)
        self._anchors.chance[...] = state["anchors"]
        self._show(buffers)

    def close(self) -> None:
        """Let go of the threads, and of foreign snakes."""
        self._foreign.close()
        self.inner.close()

    def _seating(self, seats: int) -> list[list[str]]:
        """Return which anchor sits where; in the games against anchors they take turns."""
        names, against = self.config.anchors, [kind == ANCHOR for kind in self.dealt]
        return [
            ["", *(names[(game + seat) % len(names)] for seat in range(seats - 1))] if anchored else [""] * seats
            for game, anchored in enumerate(against)
        ]

    def _foreign_seating(self, seats: int) -> dict[tuple[int, int], str]:
        """Return which foreign snake sits where; they take turns."""
        names = self.config.foreign
        games = [game for game, kind in enumerate(self.dealt) if kind == FOREIGN]
        return {
            (game, seat): names[(place + seat - 1) % len(names)]
            for place, game in enumerate(games)
            for seat in range(1, seats)
        }

    def _ask_opponent(self) -> None:
        rows = self._past & self._buffers.active
        if rows.any():
            assert self._opponent is not None, "games against a past self need one: meet(opponent)"
            seen = {name: array[rows] for name, array in self._buffers.observations.items()}
            mask = self._buffers.action_mask
            self._moves[rows] = self._opponent.act(seen, None if mask is None else mask[rows])

    def _show(self, buffers: StepBuffers) -> None:
        self._own.show(self._buffers, buffers)


def deal(num_games: int, config: SelfPlayConfig) -> list[str]:
    """Return whom each game is played against, anchors first; foreign snakes have a game at least, if there are any.

    >>> deal(4, SelfPlayConfig(anchor_share=0.5, pool_share=0.25))
    ['anchor', 'anchor', 'past', 'self']
    """
    foreign = max(1, round(num_games * config.foreign_share)) if config.foreign else 0
    anchors = min(num_games - foreign, round(num_games * config.anchor_share))
    past = min(num_games - anchors - foreign, round(num_games * config.pool_share))
    rest = num_games - anchors - foreign - past
    return [ANCHOR] * anchors + [FOREIGN] * foreign + [PAST] * past + [SELF] * rest


def world_settings(game: WorldSettings, config: SnakeConfig, num_games: int) -> WorldSettings:
    """Return how a world of training (or judging) is set up: what is seen and paid comes from the settings."""
    prizes = RewardWeights(food=config.food_prize)
    return replace(
        game, num_games=num_games, max_turns=config.max_turns, view=config.view, outlook=config.outlook, prizes=prizes
    )


def _under(prefix: str, state: Mapping[str, Array]) -> dict[str, Array]:
    return {name.removeprefix(prefix): array for name, array in state.items() if name.startswith(prefix)}
