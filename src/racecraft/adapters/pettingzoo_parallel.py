"""One world of M agents as a PettingZoo `ParallelEnv`."""

from __future__ import annotations

from typing import Any

import numpy as np

from racecraft.adapters.spaces import action_space, flat_rows, observation_space, row_of
from racecraft.contract.errors import ContractError, MissingExtraError
from racecraft.contract.random_streams import generator
from racecraft.contract.world import World, allocate


def pettingzoo_parallel(world: World) -> Any:
    """Return a `pettingzoo.ParallelEnv` over one world of M agents, named `agent_0`, `agent_1` and so on.

    An agent leaves when its row ends, and when none is left the game is over and `reset` is awaited; the world itself
    has then begun its next game, which is shown unless `reset` brings a seed.

    Args:
        world: N = 1.

    Raises:
        MissingExtraError: PettingZoo is not installed.
        ContractError: There is more than one world.
    """
    try:
        from pettingzoo import ParallelEnv
    except ImportError as error:
        raise MissingExtraError(
            "PettingZoo is not installed; expected it for pettingzoo_parallel. Run: pip install pettingzoo"
        ) from error
    spec = world.spec
    if spec.num_worlds != 1:
        raise ContractError(
            "{name} has {num_worlds} worlds; ParallelEnv is for one. Make it with one.",
            name=spec.name,
            num_worlds=spec.num_worlds,
        )
    names = [f"agent_{m}" for m in range(spec.num_agents)]
    observation_spaces = {name: observation_space(spec) for name in names}
    action_spaces = {name: action_space(spec.actions) for name in names}

    class WorldParallelEnv(ParallelEnv):
        """M agents moving at once."""

        metadata = {"name": spec.name, "render_modes": []}  # noqa: RUF012
        render_mode = None

        def __init__(self) -> None:
            self.world, self.buffers = world, allocate(spec)
            self.possible_agents = list(names)
            self.agents: list[str] = []
            self.unseeded = generator(0, "pettingzoo resets")
            self.over = False

        def observation_space(self, agent: str) -> Any:
            return observation_spaces[agent]

        def action_space(self, agent: str) -> Any:
            return action_spaces[agent]

        def reset(self, seed: int | None = None, options: dict[str, Any] | None = None) -> Any:
            if seed is not None or not self.over:
                world.reset(self.buffers, int(self.unseeded.integers(2**31)) if seed is None else seed)
            self.over = False
            self.agents = list(names)
            observations = flat_rows(spec, self.buffers.observations)
            return {name: row_of(observations, m) for m, name in enumerate(names)}, {
                name: self.info(name) for name in names
            }

        def step(self, actions: dict[str, Any]) -> Any:
            buffers, playing = self.buffers, self.agents
            joint_actions = np.zeros((1, len(names), *spec.actions.shape), spec.actions.dtype)
            for name, action in actions.items():
                joint_actions[0, names.index(name)] = action
            world.step(joint_actions, buffers)
            now = flat_rows(spec, buffers.observations)
            final = flat_rows(spec, buffers.final_observations)
            seen, reward, terminated, truncated = {}, {}, {}, {}
            for name in playing:
                m = names.index(name)
                seen[name] = row_of(final if buffers.ended[0, m] else now, m)
                reward[name] = float(buffers.reward[0, m])
                terminated[name], truncated[name] = bool(buffers.terminated[0, m]), bool(buffers.truncated[0, m])
            infos = {name: self.info(name) for name in playing}
            self.agents = [name for name in playing if not (terminated[name] or truncated[name])]
            self.over = not self.agents
            return seen, reward, terminated, truncated, infos

        def info(self, name: str) -> dict[str, Any]:
            m = names.index(name)
            found: dict[str, Any] = {"active": bool(self.buffers.active[0, m])}
            if self.buffers.action_mask is not None:
                found["action_mask"] = self.buffers.action_mask[0, m].astype(np.int8)
            return found

        def close(self) -> None:
            world.close()

    return WorldParallelEnv()
