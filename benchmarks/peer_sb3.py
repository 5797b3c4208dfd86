"""Stable-Baselines3 on one world until it is solved: `peer_sb3.py WORLD SEED --goal 475 --minutes 10`; for `peers.py`.

The settings are those that RL Baselines3 Zoo calls tuned for each world (`hyperparams/ppo.yml` and `sac.yml`).
"""

from __future__ import annotations

import argparse
import json
import time
from collections.abc import Callable
from typing import Any

import gymnasium
import torch
from stable_baselines3 import PPO, SAC
from stable_baselines3.common.base_class import BaseAlgorithm
from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.env_util import make_vec_env
from stable_baselines3.common.evaluation import evaluate_policy
from stable_baselines3.common.vec_env import VecEnv, VecNormalize, sync_envs_normalization

JUDGED, CONFIRMED = 20, 100
"""Greedy episodes of a judgement, and of the one that confirms it."""


def falling(start: float) -> Callable[[float], float]:
    """Return a schedule that falls in a straight line to nothing at the end of the training."""
    return lambda left: left * start


ZOO: dict[str, dict[str, Any]] = {
    "CartPole-v1": {
        "learner": PPO, "worlds": 8, "steps": 100_000, "every": 2048,
        "settings": {
            "n_steps": 32, "batch_size": 256, "gae_lambda": 0.8, "gamma": 0.98, "n_epochs": 20, "ent_coef": 0.0,
            "learning_rate": falling(0.001), "clip_range": falling(0.2),
        },
    },
    "Acrobot-v1": {
        "learner": PPO, "worlds": 16, "steps": 1_000_000, "every": 2048, "normalised": True,
        "settings": {"n_steps": 256, "gae_lambda": 0.94, "gamma": 0.99, "n_epochs": 4, "ent_coef": 0.0},
    },
    "Pendulum-v1": {
        "learner": SAC, "worlds": 1, "steps": 20_000, "every": 1024, "settings": {"learning_rate": 1e-3},
    },
    "MountainCarContinuous-v0": {
        "learner": SAC, "worlds": 1, "steps": 50_000, "every": 1024,
        "settings": {
            "learning_rate": 3e-4, "buffer_size": 50_000, "batch_size": 512, "ent_coef": 0.1, "train_freq": 32,
            "gradient_steps": 32, "gamma": 0.9999, "tau": 0.01, "learning_starts": 0, "use_sde": True,
            "policy_kwargs": {"log_std_init": -3.67, "net_arch": [64, 64]},
        },
    },
}  # fmt: skip
"""By world: who learns, in how many worlds, how many steps at most, and after how many it is judged."""


class Judge(BaseCallback):
    """Judges every so many steps, and ends the training once the goal is met."""

    def __init__(self, world: VecEnv, goal: float, every: int, confirms: bool, until: float) -> None:
        super().__init__()
        self.world, self.goal, self.every, self.confirms, self.until = world, goal, every, confirms, until
        self.judged_at, self.solved = 0, False

    def _on_step(self) -> bool:
        if self.num_timesteps - self.judged_at < self.every:
            return True
        self.judged_at = self.num_timesteps
        if isinstance(self.world, VecNormalize):
            sync_envs_normalization(self.model.get_env(), self.world)
        self.solved = self._meets(JUDGED) and (not self.confirms or self._meets(CONFIRMED))
        return not self.solved and time.perf_counter() < self.until

    def _meets(self, episodes: int) -> bool:
        mean, _ = evaluate_policy(self.model, self.world, episodes, deterministic=True, warn=False)
        return bool(mean >= self.goal)


def main() -> None:
    """Train once and print what came of it as one JSON object."""
    options = argparse.ArgumentParser(description=__doc__.split("\n")[0] if __doc__ else "")
    options.add_argument("world", choices=ZOO)
    options.add_argument("seed", type=int)
    options.add_argument("--goal", type=float, required=True)
    options.add_argument("--minutes", type=float, default=10.0)
    asked = options.parse_args()
    torch.set_num_threads(1)
    zoo, until = ZOO[asked.world], time.perf_counter() + 60.0 * asked.minutes
    taught: VecEnv = make_vec_env(asked.world, zoo["worlds"], seed=asked.seed)
    judged: VecEnv = make_vec_env(asked.world, JUDGED, seed=asked.seed + 10_000)
    if zoo.get("normalised"):
        taught = VecNormalize(taught, gamma=zoo["settings"]["gamma"])
        judged = VecNormalize(judged, training=False, norm_reward=False)
    learner: BaseAlgorithm = zoo["learner"]("MlpPolicy", taught, seed=asked.seed, device="cpu", **zoo["settings"])
    confirms = gymnasium.spec(asked.world).reward_threshold is not None
    judge = Judge(judged, asked.goal, zoo["every"], confirms, until)
    learner.learn(zoo["steps"], callback=judge)
    print(json.dumps({"solved": judge.solved, "steps": learner.num_timesteps}))


if __name__ == "__main__":
    main()
