"""What a copy of the reward module for each car costs: `python benchmarks/reward_copies.py [TURNS]` (60).

Five worlds of 32 cars are stepped in turns, a few ticks each, on one core, and the processor's time of each turn is
kept: a busy machine slows all of them alike. They differ in their reward only: none, one that keeps nothing and is
shared, and one that keeps a class, a list and a global, shared as it once was and copied as it is. Cars choose by
chance, so many leave the road and begin again. The page is reward-copies.md; copied by hand.
"""

from __future__ import annotations

import os
import statistics
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

from by_turns import microseconds
from racecraft.contract.world import allocate
from racecraft.kernels import set_threads
from racecraft.worlds.deepracer.env.actions import ActionTable
from racecraft.worlds.deepracer.env.settings import CameraConfig
from racecraft.worlds.deepracer.env.world import RaceWorld
from racecraft.worlds.deepracer.files.reward_file import RewardFunction, default_reward_source, load_reward_function
from racecraft.worlds.deepracer.tracks.catalogue import load_track

CARS, TICKS = 32, 32
KEEPS = """
import math

class Keeper:
    seen = {}

    def __init__(self):
        self.speeds = []
        self.line = [(math.cos(k / 40), math.sin(k / 40)) for k in range(200)]

    def pay(self, params):
        Keeper.seen["steps"] = params["steps"]
        self.speeds.append(params["speed"])
        if len(self.speeds) > 15:
            del self.speeds[0]
        return sum(self.speeds) / len(self.speeds)

keeper = Keeper()
calls = 0

def reward_function(params):
    global calls
    calls += 1
    if not params["all_wheels_on_track"]:
        return 0.001
    return keeper.pay(params)
"""


def stepper(pays: list[Callable] | None) -> Callable[[], None]:
    """Return what takes the next TICKS ticks of a world whose cars are paid so."""
    actions = ActionTable.of([(-0.35, 1.0), (0.0, 1.0), (0.35, 1.0)])
    world = RaceWorld(load_track("reinvent_base"), actions, pays, camera_config=CameraConfig(40, 30), num_cars=CARS)
    buffers, draws = allocate(world.spec), np.random.default_rng(1)
    world.reset(buffers, 1)

    def step() -> None:
        for _ in range(TICKS):
            world.step(draws.integers(0, 3, (CARS, 1)), buffers)

    return step


def main() -> None:
    turns = int(sys.argv[1]) if len(sys.argv) > 1 else 60
    set_threads(1)
    with tempfile.TemporaryDirectory() as folder:
        plain, keeps = (
            _loaded(Path(folder) / name, text) for name, text in (("plain", default_reward_source()), ("keeps", KEEPS))
        )
        began = time.process_time()
        own = keeps.copies(CARS)
        loading = (time.process_time() - began) / CARS * 1e3
        steps = {
            "no reward": stepper(None),
            "keeps nothing: one for all cars": stepper([one.call for one in plain.copies(CARS)]),
            "keeps nothing: the one itself": stepper([plain.call] * CARS),
            "keeps state: one for all cars": stepper([keeps.call] * CARS),
            "keeps state: a copy for each car": stepper([one.call for one in own]),
        }
        spent = microseconds(steps, turns, TICKS * CARS)
    print(f"{CARS} cars, 40x30, {turns} turns of {TICKS} ticks, load {os.getloadavg()[0]:.1f}")
    for name, times in spent.items():
        low, middle, high = statistics.quantiles(times, n=4)
        print(f"  {name:34s} {middle:6.2f} us a tick of a car ({low:.2f} to {high:.2f})")
    print(f"  loading a copy: {loading:.2f} ms, once")
    for more, less in ((2, 1), (4, 3)):
        names = list(spent)[more], list(spent)[less]
        ratio = statistics.median(a / b for a, b in zip(*(spent[name] for name in names), strict=True))
        print(f"  {names[0]} over {names[1]}: {ratio:.3f}")


def _loaded(folder: Path, text: str) -> RewardFunction:
    folder.mkdir()
    (folder / "reward_function.py").write_text(text)
    return load_reward_function(folder / "reward_function.py")


if __name__ == "__main__":
    main()
