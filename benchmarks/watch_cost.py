"""What watching costs a training: `python benchmarks/watch_cost.py`. Half a minute.

Ticks of the default training (32 cars, 40 x 30 frames, no network, no reward) are seen in turns by an observer of whom
nobody wishes anything, and by one that answers a wish; each turn is as long as the ticks of one wish. On an empty road,
among six boxes, behind three bots, and on four courses at once. Medians of processor time are told, so that other
programs disturb it little; a training's own tick, with its network, reward and learning, takes several times as long.
And as a page wishes once while it plays the ticks of a wish, which takes PLAYED_SECONDS, what one answer costs is told
as a share of those seconds too: that is what watching costs a training of any speed.
"""

import statistics
import tempfile
import time
from pathlib import Path

import numpy as np

from racecraft.contract.world import allocate
from racecraft.formats.live_ticks import request_ticks
from racecraft.formats.run_folder import RunFolder
from racecraft.worlds.deepracer.env.actions import action_space
from racecraft.worlds.deepracer.env.multi_course import MultiCourseWorld
from racecraft.worlds.deepracer.env.settings import CameraConfig, RaceConfig
from racecraft.worlds.deepracer.env.vehicle import TICKS_PER_SECOND
from racecraft.worlds.deepracer.env.world import RaceWorld
from racecraft.worlds.deepracer.files.model_metadata import action_space_from_aws
from racecraft.worlds.deepracer.tracks.catalogue import load_track
from racecraft.worlds.deepracer.training import live
from racecraft.worlds.deepracer.training.live import RING_TICKS, LivePublisher

TURNS, CARS = 15, 32
PLAYED_SECONDS = RING_TICKS / TICKS_PER_SECOND
ACTIONS = [{"steering_angle": float(angle), "speed": 1.0, "index": k} for k, angle in enumerate((-15, 0, 15))]


def main() -> None:
    """Measure and say what was measured."""
    for title, world in worlds().items():
        with tempfile.TemporaryDirectory() as folder:
            spent = measure(world, RunFolder.create(Path(folder) / "run", {"kind": "deepracer"}))
        tick = statistics.median(spent["the tick itself"])
        print(f"{title}: {1e6 * tick:.0f} µs is a tick of {CARS} cars without a network")
        for name in ("nobody watches", "a wish"):
            cost = statistics.median(spent[name])
            print(f"  {name:16} {1e6 * cost:6.1f} µs a tick  {100 * cost / tick:5.2f} %")
        answer = RING_TICKS * statistics.median(spent["a wish"])
        print(f"  watched: {1e3 * answer:.2f} ms every {PLAYED_SECONDS:.1f} s  {100 * answer / PLAYED_SECONDS:5.3f} %")


def worlds() -> dict[str, RaceWorld | MultiCourseWorld]:
    """Return what is driven, by what is in the way."""
    boxes, bots = RaceConfig(type="OBJECT_AVOIDANCE"), RaceConfig(type="HEAD_TO_BOT")
    four = [
        made(CARS // 4, track, race) for track in ("reinvent_base", "Vegas_track") for race in (RaceConfig(), boxes)
    ]
    return {
        "an empty road": made(CARS),
        "six boxes": made(CARS, race=boxes),
        "three bots": made(CARS, race=bots),
        "four courses": MultiCourseWorld(four),
    }


def made(cars: int, track: str = "reinvent_base", race: RaceConfig = RaceConfig()) -> RaceWorld:  # noqa: B008 (frozen)
    """Return cars on a track."""
    actions = action_space(action_space_from_aws(ACTIONS))
    camera = CameraConfig(width=40, height=30)
    return RaceWorld(load_track(track), actions, race_config=race, camera_config=camera, num_cars=cars)


def measure(world: RaceWorld | MultiCourseWorld, run: RunFolder) -> dict[str, list[float]]:
    """Return the processor seconds of each turn, by what was done."""
    buffers, dice = allocate(world.spec), np.random.default_rng(1)
    world.reset(buffers, 1)
    publishers = {"nobody watches": LivePublisher(run), "a wish": LivePublisher(run)}
    usual = live.LOOK_SECONDS
    spent: dict[str, list[float]] = {name: [] for name in ("the tick itself", *publishers)}
    for turn in range(TURNS + 1):
        for name, publisher in publishers.items():
            run.watched.unlink(missing_ok=True)
            live.LOOK_SECONDS = usual
            if name == "a wish":
                request_ticks(run)
                live.LOOK_SECONDS = 0.0
            publishing = 0.0
            began = time.process_time()
            for _ in range(RING_TICKS + 1):  # in the first it is looked for the wish
                actions = dice.integers(0, len(ACTIONS), buffers.reward.shape)
                world.step(actions, buffers)
                before = time.thread_time()  # the world's other threads may still be going to sleep
                publisher(world, buffers, actions)
                publishing += time.thread_time() - before
            if turn:  # the first is warm-up
                spent["the tick itself"].append((time.process_time() - began - publishing) / (RING_TICKS + 1))
                spent[name].append(publishing / (RING_TICKS + 1))
    return spent


if __name__ == "__main__":
    main()
