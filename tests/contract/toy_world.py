"""Small worlds whose every number is known, for the exam, the faces and the collector."""

import numpy as np

from racecraft.contract.random_streams import stream_keys
from racecraft.contract.world import ArraySpec, ContinuousActions, DiscreteActions, WorldSpec

LIMIT = 12
"""Ticks after which an episode is cut."""


class Walk:
    """A walker on squares 0 to 8: choice 0 goes down, 1 stays, 2 goes up. Square 0 terminates, `LIMIT` ticks truncate.

    It starts on a square of 2 to 6 drawn for (seed, world, episode); each tick brings a reward equal to the new square.
    Going down is forbidden on square 1 where `masked`. Each agent walks by itself.
    """

    def __init__(self, num_worlds, num_agents=1, masked=False, continuous=False):
        seen = {
            "square": ArraySpec((9,), np.float32, 0, 1, doc="one-hot"),
            "clock": ArraySpec((1,), np.uint8, 0, LIMIT, doc="ticks since the start"),
        }
        actions = ContinuousActions((-1.0,), (1.0,)) if continuous else DiscreteActions(3)
        self.spec = WorldSpec("walk", num_worlds, num_agents, seen, actions, has_action_mask=masked)
        self.square = np.zeros((num_worlds, num_agents), np.int64)
        self.clock, self.episode = np.zeros_like(self.square), np.zeros_like(self.square)
        self.seed, self.closed = 0, 0

    def reset(self, buffers, seed):
        self.seed = seed
        self.episode[:] = 0
        self._begin(np.ones_like(self.square, bool))
        self._show(buffers.observations)
        self._allow(buffers)

    def step(self, actions, buffers):
        if isinstance(self.spec.actions, ContinuousActions):
            move = np.rint(actions[..., 0]).astype(np.int64)
        else:
            move = actions - 1
        self.square = np.clip(self.square + move, 0, 8)
        self.clock = self.clock + 1
        buffers.reward[:] = self.square
        buffers.terminated[:] = self.square == 0
        buffers.truncated[:] = (self.clock == LIMIT) & (self.square != 0)
        ended = buffers.ended
        if ended.any():
            self._show(buffers.final_observations, ended)
            self.episode[ended] += 1
            self._begin(ended)
        self._show(buffers.observations)
        self._allow(buffers)

    def save_state(self):
        parts = {"square": self.square, "clock": self.clock, "episode": self.episode}
        return {name: array.copy() for name, array in parts.items()} | {"seed": np.array(self.seed)}

    def load_state(self, state, buffers):
        self.square, self.clock, self.episode = (state[name].copy() for name in ("square", "clock", "episode"))
        self.seed = int(state["seed"])
        self._show(buffers.observations)
        self._allow(buffers)

    def close(self):
        self.closed += 1

    def _begin(self, rows):
        keys = stream_keys(self.seed, "walk", self.spec.num_worlds)
        for n, m in np.argwhere(rows):
            self.square[n, m] = 2 + (int(keys[n]) // 7 + 3 * int(self.episode[n, m]) + int(m)) % 5
            self.clock[n, m] = 0

    def _show(self, named, rows=True):
        rows = np.broadcast_to(rows, self.square.shape)
        named["square"][rows] = np.eye(9, dtype=np.float32)[self.square[rows]]
        named["clock"][rows] = self.clock[rows][:, None]

    def _allow(self, buffers):
        buffers.active[:] = True
        if buffers.action_mask is not None:
            buffers.action_mask[:] = True
            buffers.action_mask[..., 0] = self.square > 1


class CopyTheNumber:
    """Shows one of `count` numbers as one-hot; saying it brings 1, anything else 0. An episode is 8 numbers long."""

    def __init__(self, num_worlds, count=4):
        seen = {"number": ArraySpec((count,), np.float32, 0, 1)}
        self.spec = WorldSpec("copy the number", num_worlds, 1, seen, DiscreteActions(count))
        self.count, self.tick = count, 0

    def reset(self, buffers, seed):
        self.rng, self.tick = np.random.default_rng(seed), 0
        self._show(buffers)

    def step(self, actions, buffers):
        buffers.reward[:] = actions == self.number
        self.tick += 1
        buffers.terminated[:] = self.tick % 8 == 0
        buffers.truncated[:] = False
        np.copyto(buffers.final_observations["number"], np.eye(self.count, dtype=np.float32)[self.number])
        self._show(buffers)

    def save_state(self):
        raise NotImplementedError

    def load_state(self, state, buffers):
        raise NotImplementedError

    def close(self):
        pass

    def _show(self, buffers):
        self.number = self.rng.integers(0, self.count, (self.spec.num_worlds, 1))
        np.copyto(buffers.observations["number"], np.eye(self.count, dtype=np.float32)[self.number])
        buffers.active[:] = True


class Unpaid(CopyTheNumber):
    """The same world, and nobody pays."""

    def step(self, actions, buffers):
        super().step(actions, buffers)
        buffers.reward[:] = 0.0


class Expert:
    """Says the number it sees, as one-hot or as it is."""

    def act(self, observations, action_mask=None):
        number = observations["number"]
        return number.argmax(axis=1) if number.ndim > 1 else number

    def reset_state(self, rows):
        pass
