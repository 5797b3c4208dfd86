"""What watching costs a training: `python benchmarks/watch_cost.py`. Half a minute.

Ticks of the default training (32 cars, 40 x 30 frames, no network, no reward) are taken in turns without an
observer for watching, with one that nobody asks, and with one whose ticks are left for a page; each turn is one
iteration's worth. Processor time of this process is compared, so that other programs do not disturb it.
"""

import statistics
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

from racecraft.contract.world import allocate
from racecraft.envs.deepracer.actions import action_space
from racecraft.envs.deepracer.settings import CameraConfig, RaceConfig
from racecraft.envs.deepracer.world import RaceWorld
from racecraft.formats.aws.model_metadata import action_space_from_aws
from racecraft.formats.live_ticks import say_watched
from racecraft.formats.run_folder import RunFolder
from racecraft.tracks.catalogue import load_track
from racecraft.training.deepracer.live import LivePublisher

TICKS, TURNS, CARS = 64, 15, 32
ACTIONS = [{"steering_angle": float(angle), "speed": 1.0, "index": k} for k, angle in enumerate((-15, 0, 15))]


def main() -> None:
    """Measure and say what was measured."""
    with tempfile.TemporaryDirectory() as folder:
        run = RunFolder.create(Path(folder) / "run", {"kind": "deepracer"})
        spent = measure(run)
    plain = statistics.median(spent["nobody is there to ask"])
    for name, seconds in spent.items():
        tick = statistics.median(seconds) / TICKS
        ratios = [one / other for one, other in zip(seconds, spent["nobody is there to ask"], strict=True)]
        print(f"{name:28} {1e6 * tick:8.1f} µs a tick   {100 * (statistics.median(ratios) - 1):+5.2f} %")
    print(f"{plain / TICKS * 1e6:.0f} µs is a tick of {CARS} cars without a network: a training's is longer")


def measure(run: RunFolder) -> dict[str, list[float]]:
    """Return the processor seconds of each turn, by what was done."""
    world = RaceWorld(
        load_track("reinvent_base"),
        action_space(action_space_from_aws(ACTIONS)),
        race_config=RaceConfig(),
        camera_config=CameraConfig(width=40, height=30),
        num_cars=CARS,
    )
    buffers, dice = allocate(world.spec), np.random.default_rng(1)
    world.reset(buffers, 1)
    publishers = {"nobody is there to ask": None, "nobody watches": LivePublisher(run), "watched": LivePublisher(run)}
    spent: dict[str, list[float]] = {name: [] for name in publishers}
    for turn in range(TURNS + 1):
        for name, publisher in publishers.items():
            run.watched.unlink(missing_ok=True)
            if name == "watched":
                say_watched(run)
            began = time.process_time()
            for _ in range(TICKS):
                actions = dice.integers(0, len(ACTIONS), buffers.reward.shape)
                world.step(actions, buffers)
                if publisher is not None:
                    publisher(world, buffers, actions)
            if turn:  # the first is warm-up
                spent[name].append(time.process_time() - began)
    return spent


if __name__ == "__main__":
    sys.exit(main())
