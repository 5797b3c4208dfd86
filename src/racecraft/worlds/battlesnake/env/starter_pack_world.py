"""N games of the starter pack's gym under the `World` contract: what its experiment was trained in. Begin with `step`.

Rules, prices and chance of food are those of `starter_pack.py`, compiled (`kernels/starter_pack.py`) and held equal to
it turn by turn. What a snake sees is the pack's own trainer's: max-bordered-51s in three planes (food, itself, the sum
of the others), 21 x 21 whatever the board; the two frames of the source are `network.stack_size=2`.

Two things are told otherwise than the pack tells them. A snake that died is paid for it at once and its episode ends;
the pack pays it when the game ends, and goes on asking it meanwhile. And a game that lasts `max_turns` is cut
(`truncated`). The sum of what a game pays is the same unless it is cut.

It shows no mask unless it is asked to, as its experiment had none.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from racecraft.contract.random_streams import stream_keys
from racecraft.contract.world import Array, ArraySpec, DiscreteActions, EpisodeRecord, StepBuffers, WorldSpec
from racecraft.worlds.battlesnake.env.board import BoardError
from racecraft.worlds.battlesnake.env.kernels import starter_pack as pack
from racecraft.worlds.battlesnake.env.starter_pack import LARGEST_BOARD, REWARDS_APRIL_2020, Rewards

FATES = (
    "won", "hit_wall", "was_eaten", "hit_self", "hit_other_snake", "other_snake_hit_body", "ate_another_snake",
    "starved", "forbidden_move",
)  # fmt: skip
"""How an episode ended, by the kernel's fate; who lives at the end has won."""
MAX_TURNS = 1000
"""The pack's own trainer cut its games there (facts: B.3)."""
MOVES = ("up", "down", "left", "right")
SOURCE_SIDE, SOURCE_SNAKES = 11, 5
"""Of the published experiment: five snakes are certain, the board is the pack's later default (facts: D.2)."""


class StarterPackWorld:
    """N games of M snakes; actions are 0 up (row - 1), 1 down, 2 left, 3 right.

    Args:
        num_worlds: N, games side by side.
        side: Squares of each side of the board, 3 to 21.
        snakes: M, 2 to 16.
        rewards: What is paid.
        max_turns: A game that lasts so long is cut; 0 never.
        is_masked: Whether there is an action mask.
        is_centred: Whether a snake's head is the middle of what it sees; else the board is.

    Raises:
        BoardError: An impossible number.
    """

    def __init__(
        self,
        num_worlds: int,
        side: int = SOURCE_SIDE,
        snakes: int = SOURCE_SNAKES,
        rewards: Rewards = REWARDS_APRIL_2020,
        max_turns: int = MAX_TURNS,
        is_masked: bool = False,
        is_centred: bool = False,
    ) -> None:
        if num_worlds < 1 or not 3 <= side <= LARGEST_BOARD or not 2 <= snakes <= 16 or max_turns < 0:
            raise BoardError(
                "{num_worlds} games of {snakes} snakes on {side}x{side}, cut after {max_turns}; expected at least 1 "
                "game, 2 to 16 snakes, 3 to {largest_board} squares and 0 or more turns.",
                num_worlds=num_worlds,
                snakes=snakes,
                side=side,
                max_turns=max_turns,
                largest_board=LARGEST_BOARD,
            )
        self._max_turns, self._is_centred = max_turns, is_centred
        self._prices = rewards_of(rewards)
        rows = (num_worlds, snakes)
        self.bodies = np.zeros((*rows, side * side + 2, 2), np.int16)
        self.snakes = np.zeros((*rows, pack.COLUMNS), np.int64)
        self.food = np.zeros((num_worlds, side, side), bool)
        self.turns = np.zeros(num_worlds, np.int64)
        self.chance = np.zeros((num_worlds, 2), np.uint64)
        self._tally = np.zeros(rows)
        self._all, self._over = np.ones(num_worlds, bool), np.zeros(num_worlds, bool)
        self._no_active, self._no_mask = np.zeros(rows, bool), np.zeros((*rows, 4), bool)
        self._finished: list[EpisodeRecord] = []
        planes = ArraySpec(
            (pack.WINDOW, pack.WINDOW, 3), np.int8, float(pack.OUTSIDE * (snakes - 1)), 127.0,
            doc="food 1; itself and the others, head 5, body 1; outside the board -1 a snake",
        )  # fmt: skip
        self._spec = WorldSpec(
            name=f"starter-pack-{side}x{side}",
            num_worlds=num_worlds,
            num_agents=snakes,
            observations={"planes": planes},
            actions=DiscreteActions(4, MOVES),
            has_action_mask=is_masked,
        )

    @property
    def spec(self) -> WorldSpec:
        """The shape of this world's promise."""
        return self._spec

    def reset(self, buffers: StepBuffers, seed: int) -> None:
        """Begin every game anew; the seed decides every start and food from here on."""
        self.chance[:, 0] = stream_keys(seed, "starter pack", self._spec.num_worlds)
        self.chance[:, 1] = 0
        self._finished.clear()
        self._begin(self._all)
        self._observe(buffers)

    def step(self, actions: Array, buffers: StepBuffers) -> None:
        """Play one turn of every game; games that are over begin anew in the same step."""
        pack.play_turns(
            np.ascontiguousarray(actions, np.int64), self.bodies, self.snakes, self.food, self.turns, self.chance,
            self._prices, self._max_turns, buffers.reward, buffers.terminated, buffers.truncated, self._over,
            self._tally,
        )  # fmt: skip
        self._remember(buffers)
        if self._over.any():
            self._look(self._over, buffers.final_observations["planes"], self._no_active, self._no_mask)
            self._begin(self._over)
        self._observe(buffers)

    def pop_episodes(self) -> list[EpisodeRecord]:
        """Return the episodes that ended since the last call; `status` is one of FATES, or "truncated"."""
        finished, self._finished = self._finished, []
        return finished

    def save_state(self) -> dict[str, Array]:
        """Return copies of everything the games need to go on."""
        return {name: array.copy() for name, array in self._arrays().items()}

    def load_state(self, state: Mapping[str, Array], buffers: StepBuffers) -> None:
        """Go on from a saved state."""
        for name, array in self._arrays().items():
            array[...] = state[name]
        self._finished.clear()
        self._observe(buffers)

    def close(self) -> None:
        """Nothing to let go of."""

    def _arrays(self) -> dict[str, Array]:
        return {
            "bodies": self.bodies, "snakes": self.snakes, "food": self.food, "turns": self.turns,
            "chance": self.chance, "tally": self._tally,
        }  # fmt: skip

    def _begin(self, which: Array) -> None:
        pack.begin_games(which, self.bodies, self.snakes, self.food, self.turns, self.chance)
        self._tally[which] = 0.0

    def _observe(self, buffers: StepBuffers) -> None:
        mask = self._no_mask if buffers.action_mask is None else buffers.action_mask
        self._look(self._all, buffers.observations["planes"], buffers.active, mask)

    def _look(self, which: Array, planes: Array, active: Array, mask: Array) -> None:
        pack.observe_games(which, self.bodies, self.snakes, self.food, self._is_centred, planes, active, mask)

    def _remember(self, buffers: StepBuffers) -> None:
        """Keep what came of the episodes that ended in this turn."""
        for game, agent in np.argwhere(buffers.ended).tolist():
            cut = bool(buffers.truncated[game, agent])
            alive = bool(self.snakes[game, agent, pack.ALIVE])
            status = "truncated" if cut else FATES[0 if alive else self.snakes[game, agent, pack.FATE]]
            steps, reward = int(self.turns[game]), float(self._tally[game, agent])
            self._finished.append(EpisodeRecord(game, agent, steps, reward, status))


def rewards_of(rewards: Rewards) -> Array:
    """Return the prices as the kernel reads them, float32 (PRICES,)."""
    named = (*FATES[1:], "ate_food", "another_turn", "won", "died")
    return np.array([0.0, *(getattr(rewards, name) for name in named)], np.float32)
