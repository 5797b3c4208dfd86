"""A world as a Stable-Baselines3 `VecEnv`, every agent of every world a row."""

from __future__ import annotations

from typing import Any

import numpy as np

from racecraft.adapters.spaces import action_space, flat_rows, observation_space, row_of
from racecraft.contract.errors import MissingExtraError
from racecraft.contract.world import World, allocate


def sb3_vec_env(world: World, seed: int = 0) -> Any:
    """Return a `stable_baselines3.common.vec_env.VecEnv` over N worlds of M agents.

    Ended rows carry `terminal_observation`, and `TimeLimit.truncated` where the episode was only cut. Masks are asked
    for by sb3-contrib through `env_method("action_masks")`.

    Args:
        world: Any world.
        seed: Of the worlds, until `VecEnv.seed` is called.

    Raises:
        MissingExtraError: Stable-Baselines3 is not installed.
    """
    try:
        from stable_baselines3.common.vec_env import VecEnv
    except ImportError as error:
        raise MissingExtraError(
            "Stable-Baselines3 is not installed; expected it for sb3_vec_env. Run: pip install 'racecraft[sb3]'"
        ) from error

    class WorldVecEnv(VecEnv):
        """N * M rows, world by world."""

        def __init__(self) -> None:
            spec = world.spec
            self.world, self.world_seed, self.resets = world, seed, 0
            self.buffers = allocate(spec)
            self.told: Any = None
            super().__init__(spec.num_worlds * spec.num_agents, observation_space(spec), action_space(spec.actions))

        def reset(self) -> Any:
            if self._seeds and self._seeds[0] is not None:
                self.world_seed, self.resets = self._seeds[0], 0
            world.reset(self.buffers, self.world_seed + 1_000_003 * self.resets)
            self.resets += 1
            self._reset_seeds()
            self._reset_options()
            self.reset_infos = [{} for _ in range(self.num_envs)]
            return flat_rows(world.spec, self.buffers.observations)

        def step_async(self, actions: Any) -> None:
            spec = world.spec
            kind = spec.actions.dtype
            self.told = np.asarray(actions, kind).reshape(spec.num_worlds, spec.num_agents, *spec.actions.shape)

        def step_wait(self) -> Any:
            buffers = self.buffers
            world.step(self.told, buffers)
            terminated, truncated = buffers.terminated.reshape(-1), buffers.truncated.reshape(-1)
            ended = terminated | truncated
            infos: list[dict[str, Any]] = [{} for _ in range(self.num_envs)]
            if ended.any():
                final = flat_rows(world.spec, buffers.final_observations)
                for row in np.flatnonzero(ended).tolist():
                    infos[row]["terminal_observation"] = row_of(final, row)
                    infos[row]["TimeLimit.truncated"] = bool(truncated[row] and not terminated[row])
            seen = flat_rows(world.spec, buffers.observations)
            return seen, buffers.reward.reshape(-1).copy(), ended, infos

        def close(self) -> None:
            world.close()

        def get_attr(self, attr_name: str, indices: Any = None) -> list[Any]:
            value = {"render_mode": None, "spec": None}.get(attr_name, getattr(world, attr_name, None))
            return [value for _ in self._get_indices(indices)]

        def set_attr(self, attr_name: str, value: Any, indices: Any = None) -> None:
            raise AttributeError(f"{world.spec.name}: '{attr_name}' cannot be set row by row; set it on the world.")

        def env_method(self, method_name: str, *args: Any, indices: Any = None, **kwargs: Any) -> list[Any]:
            mask = self.buffers.action_mask
            if method_name == "action_masks" and mask is not None:
                rows = mask.reshape(self.num_envs, -1).copy()
                return [rows[row] for row in self._get_indices(indices)]
            raise AttributeError(f"{world.spec.name} has no method '{method_name}' for single rows.")

        def env_is_wrapped(self, wrapper_class: Any, indices: Any = None) -> list[bool]:
            return [False for _ in self._get_indices(indices)]

    return WorldVecEnv()
