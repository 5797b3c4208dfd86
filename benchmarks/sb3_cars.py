"""Stable-Baselines3's PPO on our world against our own, in one run: seconds to stable laps, and steps a second.

Both see the same cars, frames, rewards and starts, learn with the same minibatches, epochs, step size, discount and
network for the policy, and are judged, in compiled code, by the same five greedy starts after every update. What
differs is each one's own: Stable-Baselines3 has a critic on the shared trunk, ours a small one on the true state; and
each learns in a process of its own, Stable-Baselines3 with PyTorch as it comes.
"""

from __future__ import annotations

import argparse
import contextlib
import json
import multiprocessing
import os
import statistics
import time
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

import numpy as np
from stable_baselines3 import PPO
from stable_baselines3.common.callbacks import BaseCallback
from stable_baselines3.common.torch_layers import BaseFeaturesExtractor
from torch import nn

from racecraft.adapters.sb3_vec_env import sb3_vec_env
from racecraft.algorithms.compiled_policy import Layer, end_to_end
from racecraft.algorithms.kernels.greedy_action import NO_BEND, RELU
from racecraft.kernels import set_threads
from racecraft.worlds.deepracer.evaluation.laps import judge_starts
from racecraft.worlds.deepracer.training.bench_laps import bench_laps
from racecraft.worlds.deepracer.training.plan import RaceRequest, plan_car
from racecraft.worlds.deepracer.training.trainer import load_reward, race_world, warm_up

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

    def reset_state(self, rows):
        pass

    def compile_policy(self, name, frame):
        """Return the policy for compiled code, so that it is judged as quickly as ours."""
        net, head = self.model.policy.features_extractor.net, self.model.policy.action_net
        seen, dense = [one for one in net if isinstance(one, nn.Conv2d)], net[-2]
        layers = [Layer(numbers(one.weight, 2, 3, 1, 0), numbers(one.bias), one.stride[0], RELU) for one in seen]
        maps = dense.weight.view(dense.out_features, seen[-1].out_channels, -1)  # channel by channel
        in_order = numbers(maps, 2, 1, 0).reshape(1, 1, dense.in_features, dense.out_features)
        layers.append(Layer(in_order, numbers(dense.bias), 1, RELU))
        layers.append(Layer(numbers(head.weight, 1, 0)[None, None], numbers(head.bias), 1, NO_BEND))
        return end_to_end(layers, (*frame, 1))


def numbers(weights, *order):
    """Return weights as an array of float32, its axes in another order where one is given."""
    return np.ascontiguousarray(weights.detach().numpy().transpose(order or None), np.float32)


def ours(seed: int) -> tuple[float, float]:
    """Return seconds to stable laps (infinite: not reached) and environment steps a second."""
    told = bench_laps([seed], lambda text: None)
    seconds = told["seconds_to_stable_laps"][0] or float("inf")
    return seconds, told["median_env_steps"] / seconds


def theirs(seed: int) -> tuple[float, float]:
    """Return the same of Stable-Baselines3."""
    set_threads(os.cpu_count() or 1)  # of the world; PyTorch takes all cores by itself
    plan = plan_car(RaceRequest(preset="fast", seed=seed))
    settings = plan.settings
    world = race_world(plan, settings.rollout.num_worlds, load_reward(None).call)
    judged = race_world(plan, settings.evaluation.episodes)
    warm_up((world, judged), print)
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
    return watcher.seconds or float("inf"), model.num_timesteps / (time.perf_counter() - watcher.began)


def race(seeds: range) -> list[tuple[tuple[float, float], tuple[float, float]]]:
    """Return what `ours` and `theirs` came to, seed by seed; interleaved: what else the machine does hits both."""
    spawn = multiprocessing.get_context("spawn")
    results = []
    with ProcessPoolExecutor(1, mp_context=spawn) as us, ProcessPoolExecutor(1, mp_context=spawn) as them:
        for seed in seeds:
            results.append((us.submit(ours, seed).result(), them.submit(theirs, seed).result()))
            mine, other = results[-1]
            print(f"seed {seed}: ours {mine[0]:.2f} s, Stable-Baselines3 {other[0]:.2f} s", flush=True)
    return results


def figures_of(results: list[tuple[tuple[float, float], tuple[float, float]]]) -> dict[str, object]:
    """Return the figures that the table is made of."""
    figures: dict[str, object] = {"threads": os.cpu_count()}
    for index, who in enumerate(("ours", "sb3")):
        seconds, speeds = zip(*(pair[index] for pair in results), strict=True)
        figures |= {
            f"{who}_seconds": [round(value, 2) for value in seconds],
            f"median_{who}_seconds": round(statistics.median(seconds), 2),
            f"mean_{who}_seconds": round(statistics.mean(seconds), 2),
            f"median_{who}_steps_per_second": round(statistics.median(speeds)),
        }
    return figures


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=31)
    parser.add_argument("--json", type=Path, help="write the figures here")
    arguments = parser.parse_args()
    figures = figures_of(race(range(1, arguments.seeds + 1)))
    print(json.dumps(figures))
    if arguments.json:
        arguments.json.write_text(json.dumps(figures, indent=2) + "\n")


if __name__ == "__main__":
    main()
