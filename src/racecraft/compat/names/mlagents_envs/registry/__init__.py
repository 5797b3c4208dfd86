"""`default_registry`: ML-Agents' example scenes by name."""

from racecraft.compat.names.mlagents_envs.registry.unity_env_registry import UnityEnvRegistry, default_registry

__all__ = ["UnityEnvRegistry", "default_registry"]
