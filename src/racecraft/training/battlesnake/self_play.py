"""Self-play as a world: what the learner sees of it are its own seats, one row each. Begin with `SelfPlayWorld.step`.

Games are dealt once: a share against anchors (built-in players), a share against a past self, the rest against itself.
In the first two the learner holds seat 0 (start squares are drawn, so that no seat is better), in the last all of them.
Opponents' seats are no rows here, so nothing of theirs is ever learned from.

A past self is drawn from the pool for each iteration; every few iterations the learner's weights enter the pool, and
the oldest leave it.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import torch

from racecraft.algorithms.ppo import PpoLearner
from racecraft.algorithms.weights import to_arrays, to_tensors
from racecraft.contract.random_streams import generator
from racecraft.contract.world import Array, EpisodeRecord, StepBuffers, WorldSpec, allocate
from racecraft.envs.battlesnake.world import BattlesnakeWorld, Prizes, WorldSettings
from racecraft.players.battlesnake.anchors import AnchorSeats
from racecraft.settings.groups import SelfPlayConfig, TrainSettings

ANCHOR, PAST, SELF = "anchor", "past", "self"
"""Whom a game is played against."""


class SelfPlayWorld:
    """Learner's seats of N games, as R worlds of one agent.

    Args:
        game: What is played, by at least two.
        settings: Of the whole training: `selfplay`, `rollout.num_worlds` (N), and the network of past selves.
        seed: Of the untrained self that the pool begins with, and of the draws from the pool.
    """

    def __init__(self, game: WorldSettings, settings: TrainSettings, seed: int) -> None:
        self.config, self._seed = settings.selfplay, seed
        self.inner = BattlesnakeWorld(game)
        num_games, seats = self.inner.spec.num_worlds, self.inner.spec.num_agents
        self.dealt = deal(num_games, self.config)
        mine = np.zeros((num_games, seats), bool)
        mine[:, 0] = True
        mine[[kind == SELF for kind in self.dealt]] = True
        self._mine, self._row_of = mine, np.cumsum(mine.reshape(-1)).reshape(mine.shape) - 1
        self._past = np.zeros_like(mine)
        self._past[[kind == PAST for kind in self.dealt], 1:] = True
        self.inner.looks[...] = mine | self._past
        self._anchors = AnchorSeats(self._seating(seats), self.inner)
        self._spec = replace(self.inner.spec, num_worlds=int(mine.sum()), num_agents=1)
        self._buffers = allocate(self.inner.spec)
        self._moves = np.zeros((num_games, seats), np.int64)
        self._rival = PpoLearner(self._spec, settings.network, settings.ppo, seed, settings.runtime.device)
        self._chance = torch.Generator(self._rival.device)
        self.pool: deque[dict[str, Array]] = deque(maxlen=self.config.pool_size)
        self.pool.append(to_arrays(self._rival.state_dict())["network"])
        self.updates = 0
        """Updates of the learner so far."""

    @property
    def spec(self) -> WorldSpec:
        """R rows of one agent."""
        return self._spec

    def reset(self, buffers: StepBuffers, seed: int) -> None:
        """Begin every game anew; the seed decides the opponents' dice, too. The pool stays as it is."""
        self._anchors.begin(seed)
        self._chance.manual_seed(seed + 2)
        self.inner.reset(self._buffers, seed)
        self._show(buffers)

    def step(self, actions: Array, buffers: StepBuffers) -> None:
        """Play one turn of every game: the learner's moves as given, everybody else's as they choose."""
        self._moves[self._mine] = actions[:, 0]
        self._anchors.choose(self._moves)
        self._ask_past_self()
        self.inner.step(self._moves, self._buffers)
        for name in ("reward", "terminated", "truncated"):
            getattr(buffers, name)[:, 0] = getattr(self._buffers, name)[self._mine]
        ended = buffers.ended[:, 0]
        if ended.any():
            for name, array in self._buffers.final_observations.items():
                buffers.final_observations[name][ended, 0] = array[self._mine][ended]
        self._show(buffers)

    def learned(self, learner: PpoLearner) -> None:
        """Hear of an update: now and then the learner enters the pool, and a past self is drawn to play against."""
        self.updates += 1
        if self.updates % self.config.pool_every == 0:
            self.pool.append(to_arrays(learner.state_dict())["network"])
        self._draw_rival()

    def take_episodes(self) -> list[EpisodeRecord]:
        """Return the finished episodes of the learner's seats; the agent is always 0, the world the row."""
        told = [one for one in self.inner.take_episodes() if self._mine[one.world, one.agent]]
        return [replace(one, world=int(self._row_of[one.world, one.agent]), agent=0) for one in told]

    def save_state(self) -> dict[str, Array]:
        """Return copies of everything: games, dice, and the pool's weights."""
        state = {f"game.{name}": array for name, array in self.inner.save_state().items()}
        state["anchors"] = self._anchors.chance.copy()
        state["chance"] = self._chance.get_state().numpy().copy()
        state["updates"], state["pool"] = np.array(self.updates), np.array(len(self.pool))
        for number, weights in enumerate(self.pool):
            state |= {f"pool.{number}.{name}": array for name, array in weights.items()}
        return state

    def load_state(self, state: Mapping[str, Array], buffers: StepBuffers) -> None:
        """Go on from a saved state."""
        self.inner.load_state(_under("game.", state), self._buffers)
        self._anchors.chance[...] = state["anchors"]
        self._chance.set_state(torch.from_numpy(np.asarray(state["chance"])))
        self.updates = int(state["updates"])
        self.pool.clear()
        self.pool.extend(_under(f"pool.{number}.", state) for number in range(int(state["pool"])))
        self._draw_rival()
        self._show(buffers)

    def close(self) -> None:
        """Let go of the threads."""
        self.inner.close()

    def _seating(self, seats: int) -> list[list[str]]:
        """Return which anchor sits where; in the games against anchors they take turns."""
        names, against = self.config.anchors, [kind == ANCHOR for kind in self.dealt]
        return [
            ["", *(names[(game + seat) % len(names)] for seat in range(seats - 1))] if anchored else [""] * seats
            for game, anchored in enumerate(against)
        ]

    def _ask_past_self(self) -> None:
        asked = self._past & self._buffers.active
        if asked.any():
            seen = {name: array[asked] for name, array in self._buffers.observations.items()}
            assert self._buffers.action_mask is not None
            decision = self._rival.act(seen, self._buffers.action_mask[asked], generator=self._chance)
            self._moves[asked] = decision.actions

    def _draw_rival(self) -> None:
        chosen = int(generator(self._seed + self.updates, "past self").integers(len(self.pool)))
        self._rival.load_state_dict({"network": to_tensors(self.pool[chosen])})

    def _show(self, buffers: StepBuffers) -> None:
        for name, array in self._buffers.observations.items():
            buffers.observations[name][:, 0] = array[self._mine]
        buffers.active[:, 0] = self._buffers.active[self._mine]
        if buffers.action_mask is not None and self._buffers.action_mask is not None:
            buffers.action_mask[:, 0] = self._buffers.action_mask[self._mine]


def deal(num_games: int, config: SelfPlayConfig) -> list[str]:
    """Return whom each game is played against, anchors first.

    >>> deal(4, SelfPlayConfig(anchor_share=0.5, pool_share=0.25))
    ['anchor', 'anchor', 'past', 'self']
    """
    anchors = round(num_games * config.anchor_share)
    past = min(num_games - anchors, round(num_games * config.pool_share))
    return [ANCHOR] * anchors + [PAST] * past + [SELF] * (num_games - anchors - past)


def world_settings(game: WorldSettings, config: SelfPlayConfig, num_games: int) -> WorldSettings:
    """Return how a world of training (or judging) is set up: what is seen and paid comes from the settings."""
    prizes = Prizes(food=config.food_prize)
    return replace(
        game, num_games=num_games, max_turns=config.max_turns, view=config.view, outlook=config.outlook, prizes=prizes
    )


def _under(prefix: str, state: Mapping[str, Array]) -> dict[str, Array]:
    return {name.removeprefix(prefix): array for name, array in state.items() if name.startswith(prefix)}
