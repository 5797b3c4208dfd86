"""`sagemaker_rl.ray_launcher`: a script says which environment and which experiment; we train it."""

from __future__ import annotations

import contextlib
import json
import os
import sys
from typing import Any

from racecraft.compat.rllib_training import train_experiment
from racecraft.compat.secondary_jobs import PRIMARY, SECONDARY, primary_lock, role_of, wait_for_primary
from racecraft.compat.stored_models import refuse_to_train
from racecraft.contract.errors import SettingError
from racecraft.jobs.capacity import Capacity
from racecraft.jobs.hyperparameters import PREFIX, check_overrides


class SageMakerRayLauncher:
    """Trains what a script describes; a script derives its own from it."""

    def __init__(self) -> None:
        self.num_cpus = int(os.environ.get("SM_NUM_CPUS") or Capacity.of_machine().cores)
        self.num_gpus = int(os.environ.get("SM_NUM_GPUS", 0))
        self.hosts_info = {os.environ.get("SM_CURRENT_HOST", "algo-1"): True}
        self.num_total_gpus = self.num_gpus

    def register_env_creator(self) -> None:
        """Register the environment; a script's own."""
        raise NotImplementedError("Subclass should implement this to call ray.tune.registry.register_env")

    def get_experiment_config(self) -> dict[str, Any]:
        """Return {"training": {"run", "stop", "config"}}; a script's own."""
        raise NotImplementedError("Subclass must define the experiment config to pass to ray.tune.run_experiments")

    def customize_experiment_config(self, config: dict[str, Any]) -> dict[str, Any]:
        """Return the experiment as it is to be; the overrides are laid over it afterwards."""
        return config

    def launch(self) -> None:
        """Train."""
        refuse_to_train()
        words = _hyperparameters(sys.argv[1:])
        role = role_of(words)
        if role == SECONDARY:
            wait_for_primary(words)
            return
        self.register_env_creator()
        config = self.customize_experiment_config(self.get_experiment_config())
        if "training" not in config:
            raise SettingError(f"get_experiment_config gives {sorted(config)}; expected 'training'.")
        for sentence in check_overrides(words):
            print(f"- {sentence}")
        for name, value in words.items():
            if name.startswith(PREFIX):
                _apply_override(config, name.removeprefix(PREFIX).split("."), value)
        with primary_lock(words) if role == PRIMARY else contextlib.nullcontext():
            train_experiment(config["training"])

    @classmethod
    def train_main(cls) -> None:
        """Train what the script describes."""
        cls().launch()


def _hyperparameters(words: list[str]) -> dict[str, Any]:
    """Return `--name value` pairs; a value that is JSON is read as such."""
    found: dict[str, Any] = {}
    for name, value in zip(words, words[1:], strict=False):
        if name.startswith("--"):
            try:
                found[name[2:]] = json.loads(value)
            except ValueError:
                found[name[2:]] = value
    return found


def _apply_override(config: dict[str, Any], steps: list[str], value: Any) -> None:
    """Lay one override over an experiment."""
    if steps == ["training", "config", "num_cpus"]:
        steps = ["training", "config", "num_workers"]
    place = config
    for step in steps[:-1]:
        place = place.setdefault(step, {})
    place[steps[-1]] = value
