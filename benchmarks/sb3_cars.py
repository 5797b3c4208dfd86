"""Stable-Baselines3's PPO on our world against our own, in one run: seconds to stable laps, and steps a second.

Both see the same cars, frames, rewards and starts, learn with the same minibatches, epochs, step size, discount and
network for the policy, and are judged by the same five greedy starts after every update. What differs is each one's
own: Stable-Baselines3 has a critic on the shared trunk, ours a small one on the true state.
"""

from __future__ import annotations

import argparse
import contextlib
import json
import statistics
import time
from pathlib import Path

import torch
from stable_baselines3 import PPO
from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.torch_layers import BaseFeaturesExtractor
from torch import nn

from racecraft.envs.faces.sb3_vec_env import sb3_vec_env
from racecraft.evaluation.laps import judge_starts
from racecraft.training.bench_laps import bench_laps
from racecraft.training.car_plan import RaceRequest, plan_car
from racecraft.training.racing import load_reward, race_world, use_threads, warm_up

LIMIT_SECONDS = 120.0


class Eyes(BaseFeaturesExtractor):
    """The same convolutions and dense layer as the preset `fast`."""

    def __init__(self, space, settings):
        super().__init__(space, settings.hidden_units[-1])
        layers, channels, (height, width) = [], 1, space.shape
        rows = zip(settings.conv_filters, settings.conv_kernels, settings.conv_strides, strict=True)
        for filters, kernel, stride in rows:
            layers += [nn.Conv2d(channels, filters, kernel, stride), nn.ReLU()]
            height, width, channels = (height - kernel) // stride + 1, (width - kernel) // stride + 1, filters
        self.net = nn.Sequential(
            *layers, nn.Flatten(), nn.Linear(channels * height * width, settings.hidden_units[-1]), nn.ReLU()
        )

    def forward(self, frames):
        return self.net(frames.float().unsqueeze(1) / 255.0)


class Stable(BaseCallback):
    """Judges after every update and stops when two judgements in a row are perfect."""

    def __init__(self, world, settings):
        super().__init__()
        self.world, self.settings = world, settings
        self.in_a_row, self.seconds, self.began = 0, None, None

    def _on_step(self):
        return True

    def _on_rollout_start(self):
        if self.began is None:
            self.began = time.perf_counter()
            return
        report = judge_starts(self, self.world)
        self.in_a_row = self.in_a_row + 1 if report.all_full else 0
        spent = time.perf_counter() - self.began
        if self.in_a_row >= self.settings.stable_after:
            self.seconds = spent
        if self.seconds is not None or spent > LIMIT_SECONDS:
            raise StopIteration

    def act(self, observations, action_mask=None):
        return self.model.predict(observations["FRONT_FACING_CAMERA"], deterministic=True)[0]

    def forget(self, rows):
        pass


def theirs(seed: int) -> tuple[float | None, float]:
    """Return seconds to stable laps (None: not reached) and environment steps a second."""
    plan = plan_car(RaceRequest(seed=seed))
    settings = plan.settings
    world = race_world(plan, settings.rollout.num_worlds, load_reward(None).call)
    judged = race_world(plan, settings.evaluation.episodes)
    warm_up(world, judged, print)
    ppo = settings.ppo
    model = PPO(
        "MlpPolicy", sb3_vec_env(world, seed), seed=seed, device="cpu",
        n_steps=settings.rollout.horizon, batch_size=ppo.batch_size, n_epochs=ppo.epochs,
        learning_rate=ppo.learning_rate, gamma=ppo.discount, gae_lambda=ppo.gae_lambda, clip_range=ppo.clip,
        ent_coef=ppo.entropy_weight, vf_coef=ppo.value_weight, max_grad_norm=ppo.max_grad_norm,
        policy_kwargs={
            "features_extractor_class": Eyes, "features_extractor_kwargs": {"settings": settings.network},
            "net_arch": [], "normalize_images": False,
        },
    )  # fmt: skip
    watcher = Stable(judged, settings.evaluation)
    with contextlib.suppress(StopIteration):
        model.learn(10_000_000, callback=watcher)
    return watcher.seconds, model.num_timesteps / (time.perf_counter() - watcher.began)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=31)
    parser.add_argument("--json", type=Path, help="write the figures here")
    arguments = parser.parse_args()
    use_threads(None)
    ours, others, speeds, our_speeds = [], [], [], []
    for seed in range(1, arguments.seeds + 1):  # interleaved: what else the machine does hits both
        mine = bench_laps([seed], lambda text: None)
        ours.append(mine["seconds_to_stable_laps"][0] or float("inf"))
        our_speeds.append(mine["median_env_steps"] / ours[-1])
        seconds, speed = theirs(seed)
        others.append(float("inf") if seconds is None else seconds)
        speeds.append(speed)
        print(f"seed {seed}: ours {ours[-1]:.2f} s, Stable-Baselines3 {others[-1]:.2f} s", flush=True)
    figures = {
        "ours_seconds": [round(value, 2) for value in ours],
        "sb3_seconds": [round(value, 2) for value in others],
        "median_ours_seconds": round(statistics.median(ours), 2),
        "median_sb3_seconds": round(statistics.median(others), 2),
        "mean_ours_seconds": round(statistics.mean(ours), 2),
        "mean_sb3_seconds": round(statistics.mean(others), 2),
        "median_ours_steps_per_second": round(statistics.median(our_speeds)),
        "median_sb3_steps_per_second": round(statistics.median(speeds)),
        "threads": torch.get_num_threads(),
    }
    print(json.dumps(figures))
    if arguments.json:
        arguments.json.write_text(json.dumps(figures, indent=2) + "\n")


if __name__ == "__main__":
    main()
