"""Self-play in which every position is searched: the learner is shown what a search with its own policy would choose.

Begin with `SearchedWorld`. To an algorithm that learns by search this is a world like another, with one observation
more (`algorithms/alphazero.py`).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from racecraft.algorithms.alphazero import SEARCHED
from racecraft.contract.random_streams import stream_keys
from racecraft.contract.world import Array, ArraySpec, EpisodeRecord, StepBuffers, WorldSpec
from racecraft.worlds.battlesnake.players.batched_mcts import BatchedMcts
from racecraft.worlds.battlesnake.players.network_tree import Network
from racecraft.worlds.battlesnake.training.self_play import Opponent, SelfPlayWorld
from racecraft.worlds.battlesnake.training.settings import SearchConfig


class SearchedWorld:
    """Games of self-play, searched.

    Args:
        games: The games, and whom the learner meets there.
        config: How much is searched.
    """

    def __init__(self, games: SelfPlayWorld, config: SearchConfig) -> None:
        self.games, self._config = games, config
        self._forest: BatchedMcts | None = None
        self._roll(0, 0)
        self._shown = np.zeros((games.spec.num_worlds, 4), np.float32)
        """Shares of the walks, as they are shown now."""
        searched = ArraySpec((4,), np.float32, 0.0, 1.0, privileged=True, doc="Share of the walks each move had.")
        self._spec = replace(games.spec, observations={**games.spec.observations, SEARCHED: searched})

    def ask(self, network: Network) -> None:
        """Let the search ask a policy and its critic, which may learn on; to be called before the games begin."""
        config = self._config
        self._forest = BatchedMcts(network, self.games.inner.game_settings, config.walks, config.noise_share)

    def meet(self, opponent: Opponent) -> None:
        """Let somebody play the seats of past selves from now on."""
        self.games.meet(opponent)

    @property
    def spec(self) -> WorldSpec:
        """R rows of one agent, which are shown what was searched."""
        return self._spec

    def reset(self, buffers: StepBuffers, seed: int) -> None:
        """Begin every game anew; the seed decides the dice of the roots, too."""
        self._roll(seed, 0)
        self.games.reset(buffers, seed)
        self._search(buffers)

    def step(self, actions: Array, buffers: StepBuffers) -> None:
        """Play one turn of every game, and search where it led."""
        self._turns += 1
        self.games.step(actions, buffers)
        buffers.final_observations[SEARCHED][buffers.ended] = 0.0
        self._search(buffers)

    def pop_episodes(self) -> list[EpisodeRecord]:
        """Return the finished episodes of the learner's seats."""
        return self.games.pop_episodes()

    def save_state(self) -> dict[str, Array]:
        """Return copies of everything, the dice of the roots included."""
        dice = np.array([self._seed, self._turns])
        return {**self.games.save_state(), "search.dice": dice, "search.shown": self._shown.copy()}

    def load_state(self, state: Mapping[str, Array], buffers: StepBuffers) -> None:
        """Go on from a saved state; what was shown is shown again, for the policy may have learned since."""
        self._roll(*(int(number) for number in state["search.dice"]))
        self._shown[...] = state["search.shown"]
        self.games.load_state({name: array for name, array in state.items() if not name.startswith("search.")}, buffers)
        buffers.observations[SEARCHED][:, 0] = self._shown

    def close(self) -> None:
        """Let go of the threads."""
        self.games.close()

    def _roll(self, seed: int, turns: int) -> None:
        """Take up the dice of the roots, as they lie after so many turns."""
        self._seed, self._turns = seed, turns
        self._keys = stream_keys(seed, "roots of a search", len(self.games.mine))

    def _search(self, buffers: StepBuffers) -> None:
        """Show the shares of the walks of every seat of the learner's that is alive."""
        assert self._forest is not None, "a search asks a network: ask(network)"
        mine, world = self.games.mine, self.games.inner
        active = np.zeros(mine.shape, bool)
        active[mine] = buffers.active[:, 0]
        games = np.flatnonzero(active.any(axis=1))
        boards = [world.board(int(game)) for game in games]
        chances = [
            np.random.Generator(np.random.Philox(key=int(self._keys[game]), counter=[0, self._turns, 0, 0]))
            for game in games
        ]
        shares = np.zeros((*mine.shape, 4), np.float32)
        for game, board, visits in zip(games, boards, self._forest.search(boards, chances), strict=True):
            seats = [number for number, snake in enumerate(board.snakes) if snake.alive]
            shares[game, seats] = visits / np.maximum(visits.sum(axis=1, keepdims=True), 1)
        shares[~active] = 0.0
        self._shown[...] = shares[mine]
        buffers.observations[SEARCHED][:, 0] = self._shown
