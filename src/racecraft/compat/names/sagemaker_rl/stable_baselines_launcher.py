"""`sagemaker_rl.stable_baselines_launcher`: a script says which environment and PPO1's figures; we train it."""

from __future__ import annotations

from typing import Any

from racecraft.compat.baselines_training import MadeEnv, train_ppo1
from racecraft.compat.names.gym import RewardWrapper
from racecraft.compat.names.sagemaker_rl import mpi_launcher


class RewScale(RewardWrapper):
    """An environment whose rewards are scaled."""

    def __init__(self, env: Any, scale: float) -> None:
        super().__init__(env)
        self.scale = scale

    def reward(self, reward: float) -> float:
        """Scale a reward."""
        return reward * self.scale


class SagemakerStableBaselinesPPO1Launcher:
    """Trains PPO1's way.

    Args:
        env: The environment.
        output_path: Where the film and the monitor's file go.
        words: PPO1's own, by name, and num_timesteps.
    """

    def __init__(
        self,
        env: Any,
        output_path: str,
        timesteps_per_actorbatch: int,
        clip_param: float,
        entcoeff: float,
        optim_epochs: int,
        optim_stepsize: float,
        optim_batchsize: int,
        gamma: float,
        lam: float,
        schedule: str,
        verbose: int,
        num_timesteps: float,
    ) -> None:
        self._env, self._output_path = env, output_path
        self._words = {
            "timesteps_per_actorbatch": timesteps_per_actorbatch, "clip_param": clip_param, "entcoeff": entcoeff,
            "optim_epochs": optim_epochs, "optim_stepsize": optim_stepsize, "optim_batchsize": optim_batchsize,
            "gamma": gamma, "lam": lam, "schedule": schedule, "verbose": verbose, "num_timesteps": num_timesteps,
        }  # fmt: skip
        print(f"Initializing PPO with output_path: {output_path} and Hyper Params {self._words}")

    def run(self) -> None:
        """Train, then film what was trained."""
        train_ppo1(self._env, self._output_path, self._words, mpi_launcher.tag())


def create_env(env_id: str, output_path: str, seed: int = 0) -> MadeEnv:
    """Make an environment by its id; each of its episodes is written to 0.monitor.csv once it is trained in."""
    return MadeEnv(env_id, seed)


__all__ = ["RewScale", "SagemakerStableBaselinesPPO1Launcher", "create_env"]
