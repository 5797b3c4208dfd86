"""A world as a `gymnasium.vector.VectorEnv`, every agent of every world a row; autoreset in the same step."""

from __future__ import annotations

from typing import Any

import numpy as np
from gymnasium.vector import AutoresetMode, VectorEnv
from gymnasium.vector.utils import batch_space

from racecraft.adapters.spaces import action_space, flat_rows, observation_space, row_of
from racecraft.contract.random_streams import generator
from racecraft.contract.world import Array, World, allocate


class WorldVectorEnv(VectorEnv[Any, Any, Any]):
    """N worlds of M agents as N * M rows, world by world.

    Ended rows are told as Gymnasium's same-step mode tells them: `info["final_obs"]` is an array of objects with the
    last observation of each ended row, `info["_final_obs"]` says which rows these are. `info["active"]` and, where the
    world has one, `info["action_mask"]` speak of the coming action.
    """

    metadata = {"autoreset_mode": AutoresetMode.SAME_STEP, "render_modes": []}  # noqa: RUF012

    def __init__(self, world: World) -> None:
        spec = world.spec
        self.world = world
        self.num_envs = spec.num_worlds * spec.num_agents
        self.single_observation_space = observation_space(spec)
        self.single_action_space = action_space(spec.actions)
        self.observation_space = batch_space(self.single_observation_space, self.num_envs)
        self.action_space = batch_space(self.single_action_space, self.num_envs)
        self._buffers = allocate(spec)
        self._unseeded = generator(0, "gymnasium vector resets")

    def reset(self, *, seed: int | list[int | None] | None = None, options: dict[str, Any] | None = None) -> Any:
        """Begin every world anew; without a seed, with the next of a fixed series."""
        if isinstance(seed, list):
            seed = seed[0]
        if seed is None:
            seed = int(self._unseeded.integers(2**31))
        self.world.reset(self._buffers, seed)
        return flat_rows(self.world.spec, self._buffers.observations), self._info()

    def step(self, actions: Any) -> Any:
        """Take one tick in every world."""
        spec, buffers = self.world.spec, self._buffers
        kind = spec.actions.dtype
        joint_actions = np.asarray(actions, kind).reshape(spec.num_worlds, spec.num_agents, *spec.actions.shape)
        self.world.step(joint_actions, buffers)
        terminated, truncated = buffers.terminated.reshape(-1).copy(), buffers.truncated.reshape(-1).copy()
        info = self._info() | self._final(terminated | truncated)
        reward = buffers.reward.reshape(-1).astype(np.float64)
        return flat_rows(spec, buffers.observations), reward, terminated, truncated, info

    def close_extras(self, **kwargs: Any) -> None:
        """Close the world."""
        self.world.close()

    def _final(self, ended: Array) -> dict[str, Any]:
        if not ended.any():
            return {}
        observations = flat_rows(self.world.spec, self._buffers.final_observations)
        final = np.full(self.num_envs, None, object)
        for row in np.flatnonzero(ended).tolist():
            final[row] = row_of(observations, row)
        return {"final_obs": final, "_final_obs": ended}

    def _info(self) -> dict[str, Any]:
        every = np.ones(self.num_envs, bool)
        info: dict[str, Any] = {"active": self._buffers.active.reshape(-1).copy(), "_active": every}
        if (mask := self._buffers.action_mask) is not None:
            info |= {"action_mask": mask.reshape(-1, mask.shape[-1]).copy(), "_action_mask": every}
        return info
