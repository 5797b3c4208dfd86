"""What sensors, boxes and variation cost a tick: `python benchmarks/sensors.py [SIZE...]` (40x30 160x120).

Worlds of 32 cars that keep to the road by a plain rule are stepped in turns, a few ticks each, on one core, and the
processor's time of each turn is kept: a busy machine slows all of them alike. No reward, no network; boxes are driven
into as they come. Every figure is the median over the turns; the share is of the plain camera's ticks a second.
"""

from __future__ import annotations

import statistics
import sys
from collections.abc import Callable

import numpy as np

from by_turns import microseconds
from racecraft.contract.world import Array, allocate
from racecraft.kernels import set_threads
from racecraft.worlds.deepracer.env.actions import action_space
from racecraft.worlds.deepracer.env.race_spec import CRITIC_NAME
from racecraft.worlds.deepracer.env.sensors import car_sensors
from racecraft.worlds.deepracer.env.settings import BoxesConfig, CameraConfig
from racecraft.worlds.deepracer.env.variation import VariationConfig
from racecraft.worlds.deepracer.env.world import RaceWorld
from racecraft.worlds.deepracer.files.model_metadata import action_space_from_aws
from racecraft.worlds.deepracer.tracks.catalogue import load_track

CARS, TICKS, TURNS = 32, 32, 40
TRACK = "reinvent_base"
ACTIONS = [{"steering_angle": float(angle), "speed": 1.0, "index": k} for k, angle in enumerate((-20, 0, 20))]
PLAIN, ALL = ["FRONT_FACING_CAMERA"], ["STEREO_CAMERAS", "LIDAR"]
WORLDS: dict[str, tuple[list[str], int, str]] = {
    "plain camera": (PLAIN, 0, "off"),
    "two eyes": (ALL[:1], 0, "off"),
    "LiDAR": ([*PLAIN, "LIDAR"], 0, "off"),
    "six boxes": (PLAIN, 6, "off"),
    "two eyes, LiDAR and six boxes": (ALL, 6, "off"),
    "variation light": (PLAIN, 0, "light"),
    "variation strong": (PLAIN, 0, "strong"),
}
"""Sensors, boxes on the lap and level of variation, by what they are called in the table."""


def stepper(sensors: list[str], boxes: int, level: str, width: int, height: int) -> Callable[[], None]:
    """Return what takes the next TICKS ticks of such a world."""
    actions = action_space(action_space_from_aws(ACTIONS))
    world = RaceWorld(
        load_track(TRACK), actions, camera_config=CameraConfig(width, height), num_cars=CARS,
        sensors=car_sensors(sensors), objects=BoxesConfig(number=boxes) if boxes else None,
        variation=VariationConfig(level=level),
    )  # fmt: skip
    buffers = allocate(world.spec)
    world.reset(buffers, 1)

    def step() -> None:
        for _ in range(TICKS):
            world.step(keep_to_the_road(buffers.observations[CRITIC_NAME]), buffers)

    return step


def keep_to_the_road(told: Array) -> Array:
    """Return choices (N, 1): towards where the road goes half a metre ahead, and back to its middle."""
    wanted = told[..., 7] - 0.5 * told[..., 0]
    return np.where(wanted > 0.1, 2, np.where(wanted < -0.1, 0, 1))


def a_tick(width: int, height: int, turns: int = TURNS) -> dict[str, float]:
    """Return µs of processor time that a tick of one car takes in each of WORLDS."""
    set_threads(1)
    steps = {name: stepper(*world, width, height) for name, world in WORLDS.items()}
    return {name: statistics.median(times) for name, times in microseconds(steps, turns, TICKS * CARS).items()}


def main() -> None:
    for size in sys.argv[1:] or ("40x30", "160x120"):
        width, height = (int(side) for side in size.split("x"))
        measured = a_tick(width, height)
        plain = measured["plain camera"]
        print(f"{size}, {TRACK}, {CARS} cars, one core")
        for name, spent in measured.items():
            print(f"  {name:32s} {spent:6.1f} us a tick of a car, {plain / spent:5.2f} of the plain camera's ticks")


if __name__ == "__main__":
    main()
