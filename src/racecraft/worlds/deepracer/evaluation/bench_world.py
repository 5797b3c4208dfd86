"""How fast the car world is: physics, geometry, every reward parameter and an anti-aliased frame, tick by tick."""

from __future__ import annotations

import math
import statistics
import time

import numpy as np

from racecraft.contract.world import allocate
from racecraft.kernels import set_threads
from racecraft.worlds.deepracer.env.actions import ActionTable
from racecraft.worlds.deepracer.env.reward_caller import CarRewards
from racecraft.worlds.deepracer.env.settings import CameraConfig
from racecraft.worlds.deepracer.env.world import RaceWorld
from racecraft.worlds.deepracer.tracks.catalogue import load_track

NUM_CARS = 64
WIDTH, HEIGHT = 160, 120
ROUNDS = 5
ROUND_SECONDS = 1.0

BENCHMARK_ACTIONS = ActionTable.of(
    [(math.radians(angle), speed) for angle in (-30.0, -15.0, 0.0, 15.0, 30.0) for speed in (0.5, 1.0)]
)
"""Ten actions: ±30, ±15, 0 degrees at 0.5 and 1.0 m/s."""


def bench_world(reward: CarRewards, track_name: str = "reinvent_base") -> dict[str, float]:
    """Return ticks per second (cars times ticks over wall time), the median of interleaved rounds.

    Args:
        reward: Of NUM_CARS cars: the Python reward of the third figure.
        track_name: The circuit.

    Returns:
        ticks_per_second_one_core, ticks_per_second_two_cores, ticks_per_second_one_core_python_reward, and for each
        its lowest and highest round as `…_low`, `…_high`.
    """
    cases = {"one_core": (1, None), "two_cores": (2, None), "one_core_python_reward": (1, reward)}
    runs = {name: _Run(track_name, case_reward) for name, (_, case_reward) in cases.items()}
    measured: dict[str, list[float]] = {name: [] for name in cases}
    for _ in range(ROUNDS):
        for name, (cores, _) in cases.items():
            set_threads(cores)
            measured[name].append(runs[name].ticks_per_second())
    figures: dict[str, float] = {}
    for name, rounds in measured.items():
        figures[f"ticks_per_second_{name}"] = round(statistics.median(rounds))
        figures[f"ticks_per_second_{name}_low"] = round(min(rounds))
        figures[f"ticks_per_second_{name}_high"] = round(max(rounds))
    return figures


class _Run:
    """Cars that drive at random, which keeps them spread round the track and ends many episodes."""

    def __init__(self, track_name: str, reward: CarRewards | None) -> None:
        self._world = RaceWorld(
            load_track(track_name),
            BENCHMARK_ACTIONS,
            reward,
            camera_config=CameraConfig(WIDTH, HEIGHT),
            num_cars=NUM_CARS,
        )
        self._buffers = allocate(self._world.spec)
        self._world.reset(self._buffers, seed=0)
        self._choices = np.random.default_rng(0).integers(0, len(BENCHMARK_ACTIONS.speed), (256, NUM_CARS, 1))
        self._world.step(self._choices[0], self._buffers)

    def ticks_per_second(self) -> float:
        """Drive for a round."""
        ticks, began = 0, time.perf_counter()
        while (spent := time.perf_counter() - began) < ROUND_SECONDS:
            self._world.step(self._choices[ticks % len(self._choices)], self._buffers)
            ticks += 1
        return ticks * NUM_CARS / spent
