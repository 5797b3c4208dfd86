"""Faces of a scene: `unity_gym_env`, `unity_parallel_env`, `unity_aec_env`; `envs.Basic.env()` opens a scene."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from racecraft.compat.names.mlagents_envs.envs.pettingzoo_env_factory import PettingZooEnvFactory


def __getattr__(name: str) -> PettingZooEnvFactory:
    """Return the factory of a registered scene; `ThreeDBall` is 3DBall. The registry is asked only then."""
    if name[0].isupper():  # anything else is a module of ours, and asks for no manifest
        from racecraft.compat.names.mlagents_envs.registry import default_registry

        scene = name.replace("Three", "3", 1)
        if scene in default_registry:
            from racecraft.compat.names.mlagents_envs.envs.pettingzoo_env_factory import PettingZooEnvFactory

            return PettingZooEnvFactory(scene)
    raise AttributeError(f"module '{__name__}' has no attribute '{name}'", name=name)
