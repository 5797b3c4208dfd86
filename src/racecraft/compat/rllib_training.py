"""Train what a script describes in RLlib's words. Begin with `train_experiment`; `rllib_words.py` translates."""

from __future__ import annotations

import itertools
import os
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import gymnasium

from racecraft.compat.old_gym import FromOldGym
from racecraft.compat.rllib_words import translated
from racecraft.formats.run_folder import JOB
from racecraft.training import worlds
from racecraft.training.callbacks import IterationReport, Silent
from racecraft.training.gathering import Spread
from racecraft.training.gymnasium.trainer import GymRequest
from racecraft.training.trainer import Trained

NAMESPACE = "from_script"
_creators: dict[str, Callable[[Any], Any]] = {}


class EnvContext(dict[str, Any]):
    """What RLlib tells an environment's creator: its env_config, and which worker it is of."""

    def __init__(self, env_config: Mapping[str, Any], worker_index: int) -> None:
        super().__init__(env_config)
        self.worker_index, self.vector_index, self.remote = worker_index, 0, False


class RllibLines(Silent):
    """Says after each iteration what RLlib said, in its names, so that metric definitions go on finding it."""

    def __init__(self) -> None:
        self._told = 0

    def iteration(self, report: IterationReport) -> None:
        """Print an iteration; one that is judged afterwards is not said twice."""
        if report.iteration == self._told:
            return
        self._told = report.iteration
        if report.mean_reward is not None:
            print(f"  episode_reward_mean: {report.mean_reward:.6g}")
        print(f"  episodes_this_iter: {report.episodes}")
        print(f"  time_total_s: {report.seconds:.3f}")
        print(f"  timesteps_total: {report.steps}")
        print(f"  training_iteration: {report.iteration}", flush=True)


def register_env(name: str, creator: Callable[[Any], Any]) -> None:
    """Keep how an environment of a name is made."""
    _creators[name] = creator


def train_experiment(experiment: Mapping[str, Any], spread: Spread | None = None) -> Trained:
    """Train; inside a job the run folder stands in its model, and a job that was interrupted goes on there.

    Args:
        experiment: What the script describes.
        spread: Carries its worlds elsewhere; None: they are carried here.

    Raises:
        SettingError: Something is not understood; the nearest known word is told.
    """
    told = translated(experiment)
    for sentence in told.said:
        print(f"- {sentence}")
    environment = registered(told.environment, told.env_config, told.horizon)
    model = os.environ.get("SM_MODEL_DIR")
    run = Path(model, "run") if model else None
    if run is not None and (run / JOB).exists():
        return worlds.resume(run, told.stops, RllibLines(), print, "gymnasium", spread)
    request = GymRequest(environment, stops=told.stops, run=run, seed=told.seed, overrides=told.settings)
    return worlds.train(request, RllibLines(), print, spread)


def prepare_worlds(experiment: Mapping[str, Any]) -> None:
    """Have the environment of an experiment be found, for a training elsewhere whose worlds are carried here.

    Raises:
        SettingError: Something is not understood; the nearest known word is told.
    """
    told = translated(experiment)
    registered(told.environment, told.env_config, told.horizon)


def registered(name: str, env_config: Mapping[str, Any], horizon: int) -> str:
    """Return the id under which Gymnasium finds an environment of the script; any other name is Gymnasium's own."""
    if name not in _creators:
        return name
    number, creator = itertools.count(1), _creators[name]
    known = f"{NAMESPACE}/{name}-v0"
    gymnasium.registry.pop(known, None)
    gymnasium.register(
        known,
        entry_point=lambda **words: FromOldGym(creator(EnvContext(env_config, next(number)))),
        disable_env_checker=True,
        max_episode_steps=horizon,
        order_enforce=False,
    )
    return known
