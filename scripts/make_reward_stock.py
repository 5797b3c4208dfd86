"""Drive the stock of laps on which rewards are checked, and write `driving/reward/stock.npz`.

    python scripts/make_reward_stock.py

On each track cars follow classical lines and lanes at speeds from 0.4 to 4 m/s, some of them clumsily; the planner adds
the fastest lap it finds. Laps are kept evenly by rank, from the fastest to the slowest, and so are drives that leave
the road. Commands are those of a racer's table: angles in steps of 5 degrees, speeds in steps of 0.1 m/s.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from racecraft.contract.world import allocate
from racecraft.worlds.deepracer.driving.action_tables import read_table
from racecraft.worlds.deepracer.driving.lines import LINES, classical_line
from racecraft.worlds.deepracer.driving.planner import plan_best_lap
from racecraft.worlds.deepracer.driving.profile import with_speeds
from racecraft.worlds.deepracer.driving.racing_line import RacingLine
from racecraft.worlds.deepracer.driving.reward.stock import STOCK_FILE, TRACKS
from racecraft.worlds.deepracer.driving.road_frame import road_frame
from racecraft.worlds.deepracer.env.actions import ActionBox
from racecraft.worlds.deepracer.env.race import LAP_COMPLETE, OFF_TRACK
from racecraft.worlds.deepracer.env.settings import CameraConfig, RaceConfig
from racecraft.worlds.deepracer.env.vehicle import MAX_STEERING_RAD, PROFILES, WHEELBASE_M
from racecraft.worlds.deepracer.env.world import RaceWorld
from racecraft.worlds.deepracer.tracks.catalogue import load_track
from racecraft.worlds.deepracer.tracks.track import Track

CAR = PROFILES["v6"]
TOP_SPEEDS = (0.4, 0.7, 1.0, 1.3, 1.6, 2.0, 2.5, 3.0, 4.0)
LANES_M = (-0.2, 0.2)
LAPS, FAILURES = 14, 4
"""Kept of each track, the planned lap aside."""
MAX_SECONDS = 90.0


@dataclass(frozen=True)
class Driver:
    """Follows a line."""

    name: str
    line: RacingLine
    weave_m: float = 0.0
    """Swings so far to both sides of the line, every two metres."""
    noise_rad: float = 0.0
    """Spread of what is added to each steering command."""


def drivers(track: Track) -> list[Driver]:
    """Return everybody who drives."""
    made = []
    frame = road_frame(track, 0.1)
    for top in TOP_SPEEDS:
        lines = {kind: classical_line(track, CAR, top, kind) for kind in LINES}
        lines |= {
            f"{'left' if lane > 0 else 'right'} lane": with_speeds(frame, np.full(len(frame.xy), lane), CAR, top)
            for lane in LANES_M
        }
        for kind, line in lines.items():
            made.append(Driver(f"{kind} line up to {top:g} m/s", line))
            if kind in ("centre", "least-curvature"):
                made.append(Driver(f"{kind} line up to {top:g} m/s, weaving", line, weave_m=0.15))
                made.append(Driver(f"{kind} line up to {top:g} m/s, unsteady", line, noise_rad=0.25))
    return made


def drive(track: Track, crew: list[Driver]) -> list[tuple[str, np.ndarray, bool]]:
    """Let everybody drive one lap from rest; return name, rows (T, 5) and whether it was complete."""
    rng = np.random.default_rng(1)
    world = RaceWorld(
        track, ActionBox((-MAX_STEERING_RAD, MAX_STEERING_RAD), (0.1, 4.0)), num_cars=len(crew),
        start_shares=[0.0] * len(crew), camera_config=CameraConfig(8, 8),
        race_config=RaceConfig(max_episode_seconds=MAX_SECONDS),
    )  # fmt: skip
    buffers = allocate(world.spec)
    world.reset(buffers, 0)
    rows: list[list[np.ndarray]] = [[] for _ in crew]
    ends = np.full(len(crew), -1)
    for tick in range(int(MAX_SECONDS * 15) - 2):
        cars = world.cars[:, 0]
        commands = np.array(
            [command(driver, car, tick, rng) for driver, car in zip(crew, cars, strict=True)], np.float32
        )
        world.step(commands[:, None], buffers)
        for number, report in enumerate(world.reports[:, 0]):
            if ends[number] < 0:
                if tick > 0:  # the first row holds the car and is not paid
                    rows[number].append(
                        np.array([report[k] for k in ("x", "y", "yaw", "steering", "speed")], np.float32)
                    )
                if report["terminated"] or report["truncated"]:
                    ends[number] = report["status"]
        if (ends >= 0).all():
            break
    return [
        (driver.name, np.array(one), bool(end == LAP_COMPLETE))
        for driver, one, end in zip(crew, rows, ends, strict=True)
        if end in (LAP_COMPLETE, OFF_TRACK)
    ]


def command(driver: Driver, car: np.void, tick: int, rng: np.random.Generator) -> tuple[float, float]:
    """Return steering (rad) and speed (m/s): pure pursuit of the line."""
    line = driver.line
    place = int(np.argmin((line.xy[:, 0] - car["x"]) ** 2 + (line.xy[:, 1] - car["y"]) ** 2))
    step = line.arc[-1] / len(line.xy)
    speed = float(line.speed[(place + 2) % len(line.xy)])
    reach = 0.35 + 0.22 * max(car["speed"], 0.3)
    aim = (place + round(reach / step)) % len(line.xy)
    heading = line.heading[aim]
    swing = driver.weave_m * np.sin(np.pi * aim * step)
    x, y = line.xy[aim] + swing * np.array([-np.sin(heading), np.cos(heading)])
    dx, dy = x - car["x"], y - car["y"]
    across = -np.sin(car["yaw"]) * dx + np.cos(car["yaw"]) * dy
    curvature = 2.0 * across / (dx * dx + dy * dy)
    angle = np.arctan(curvature * WHEELBASE_M / (CAR.curvature_gain * 0.9))
    angle += 0.5 * (angle - car["steering"]) + rng.normal(0.0, 1.0) * driver.noise_rad
    degrees = 5.0 * np.round(np.degrees(np.clip(angle, -MAX_STEERING_RAD, MAX_STEERING_RAD)) / 5.0)
    return float(np.radians(degrees)), float(np.clip(np.round(speed / CAR.speed_gain, 1), 0.1, 4.0))


def planned(track: Track) -> tuple[str, np.ndarray, bool]:
    """Return the first lap of the best plan."""
    plan = plan_best_lap(track, CAR, read_table("7x1.5,2.5"))
    assert plan is not None, track.name
    first = slice(1, plan.lap_ticks[0])
    return "planned, 7 angles at 1.5 and 2.5 m/s", np.column_stack([
        plan.path[first, :3], plan.commands[plan.choices[first]]
    ]).astype(np.float32), True  # fmt: skip


def main() -> None:
    """Drive on every track and write what is kept."""
    kept: dict[str, np.ndarray] = {}
    for name in TRACKS:
        track = load_track(name)
        driven = drive(track, drivers(track))
        laps = sorted((one for one in driven if one[2]), key=lambda one: len(one[1]))
        failed = [one for one in driven if not one[2]]
        picked = [laps[k] for k in np.unique(np.linspace(0, len(laps) - 1, LAPS).round().astype(int))]
        picked += [failed[k] for k in np.unique(np.linspace(0, len(failed) - 1, FAILURES).round().astype(int))]
        for number, (title, rows, complete) in enumerate([planned(track), *picked]):
            kept[f"{name}/{number:02}/{'lap' if complete else 'failed'}/{title}"] = rows
        print(name, len(laps), "laps,", len(failed), "failures; kept:")
        for title, rows, complete in picked:
            print(f"  {len(rows) / 15:6.2f} s {'lap' if complete else 'off':4} {title}")
    np.savez_compressed(STOCK_FILE, **kept)
    print(STOCK_FILE, STOCK_FILE.stat().st_size, "bytes;", sum(map(len, kept.values())), "rows")


if __name__ == "__main__":
    main()
