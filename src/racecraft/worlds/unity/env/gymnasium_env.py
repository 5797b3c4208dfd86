"""A Unity scene with one agent as a Gymnasium environment, for `gymnasium.make("racecraft/Unity-v0", build=…)`.

`racecraft.adapters` registers the id.

Several agents of one behavior are a batch: `unity_vector_env`. Several behaviors: `parallel.py`. Masks stand in
`info["action_mask"]`, terminated and truncated are told apart.
"""

from __future__ import annotations

from typing import Any

from racecraft.adapters.gymnasium_env import WorldEnv
from racecraft.adapters.gymnasium_vector import WorldVectorEnv
from racecraft.contract.errors import ContractError
from racecraft.worlds.unity.env.errors import BuildError
from racecraft.worlds.unity.env.world import UnityWorld


def unity_env(build: str, **words: Any) -> WorldEnv:
    """Return a scene of one agent as a `gymnasium.Env`.

    Args:
        build: What `find_build` understands.
        words: Further words of `UnityWorld`. A reset in the middle of an episode starts the player anew;
            `restart_on_reset=False` is quicker and lets the scene decide where it goes on.

    Raises:
        BuildError: There is no such build, or more than one agent asks in it.
    """
    world = UnityWorld(build, **words)
    try:
        return WorldEnv(world)
    except ContractError as cause:
        world.close()
        raise BuildError(
            "{build}: {num_worlds} agents of '{name}' ask for "
            "decisions; a gymnasium.Env is for one. Use unity_vector_env, or racecraft.worlds.unity.env.parallel.",
            build=build,
            num_worlds=world.spec.num_worlds * world.spec.num_agents,
            name=world.behavior.name,
        ) from cause


def unity_vector_env(build: str, **words: Any) -> WorldVectorEnv:
    """Return all agents of one behavior, of one or more processes, as a `gymnasium.vector.VectorEnv`."""
    return WorldVectorEnv(UnityWorld(build, **words))
