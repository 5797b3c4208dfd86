"""`ray.tune`."""

from __future__ import annotations

from typing import Any

from racecraft.compat.names.ray.tune import registry
from racecraft.compat.rllib_training import train_experiment


def run_experiments(experiments: dict[str, dict[str, Any]], *args: Any, **words: Any) -> None:
    """Train each experiment, one after the other."""
    for experiment in experiments.values():
        train_experiment(experiment)


register_env = registry.register_env

__all__ = ["register_env", "registry", "run_experiments"]
