"""A world of one car as a `gymnasium.Env`."""

from __future__ import annotations

from typing import Any

import gymnasium
import numpy as np

from racecraft.adapters.spaces import action_space, flat_rows, observation_space, row_of
from racecraft.contract.errors import ContractError
from racecraft.contract.world import World, allocate


class WorldEnv(gymnasium.Env[Any, Any]):
    """One agent in one world, as Gymnasium likes to see it.

    A world begins its next episode in the step that ends one; here that start is held back until `reset` asks for it,
    so nothing is skipped. `reset(seed=...)`, or a `reset` in the middle of an episode, begins the world anew.
    `info` holds `active` (the coming action will be obeyed) and, where the world has one, `action_mask` (int8,
    as `action_space.sample(mask=...)` wants it).

    Args:
        world: N = M = 1.

    Raises:
        ContractError: The world has more than one agent.
    """

    metadata = {"render_modes": []}  # noqa: RUF012

    def __init__(self, world: World) -> None:
        spec = world.spec
        if (spec.num_worlds, spec.num_agents) != (1, 1):
            raise ContractError(
                "{name} has {num_worlds} worlds of {num_agents} agents; gymnasium.Env is for one of "
                "one. Use WorldVectorEnv for many.",
                name=spec.name,
                num_worlds=spec.num_worlds,
                num_agents=spec.num_agents,
            )
        self.world = world
        self.observation_space = observation_space(spec)
        self.action_space = action_space(spec.actions)
        self._buffers = allocate(spec)
        self._next_is_begun = False

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Any, dict[str, Any]]:
        """Begin an episode; see the class for when the world itself is begun anew."""
        super().reset(seed=seed)
        if seed is not None or not self._next_is_begun:
            self.world.reset(self._buffers, int(self.np_random.integers(2**31)))
        self._next_is_begun = False
        return self._shown(self._buffers.observations), self._info()

    def step(self, action: Any) -> tuple[Any, float, bool, bool, dict[str, Any]]:
        """Take one tick; at an ending the observation is the ended episode's last one."""
        actions = self.world.spec.actions
        kind = actions.dtype
        self.world.step(np.asarray(action, kind).reshape(1, 1, *actions.shape), self._buffers)
        terminated, truncated = bool(self._buffers.terminated[0, 0]), bool(self._buffers.truncated[0, 0])
        self._next_is_begun = terminated or truncated
        named = self._buffers.final_observations if self._next_is_begun else self._buffers.observations
        return self._shown(named), float(self._buffers.reward[0, 0]), terminated, truncated, self._info()

    def close(self) -> None:
        """Close the world."""
        self.world.close()

    def _shown(self, named: dict[str, Any]) -> Any:
        return row_of(flat_rows(self.world.spec, named), 0)

    def _info(self) -> dict[str, Any]:
        info: dict[str, Any] = {"active": bool(self._buffers.active[0, 0])}
        if self._buffers.action_mask is not None:
            info["action_mask"] = self._buffers.action_mask[0, 0].astype(np.int8)
        return info
