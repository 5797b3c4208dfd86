"""Plan the best known laps of all tracks and write `driving/known_laps.csv`.

    python scripts/plan_known_laps.py [--slice 1/4] [--only v6:2.5] [--track reinvent_base] [--again]

Rows that the table has are left out, unless `--again` is given; a slice that was interrupted goes on where it stopped.
Slices write beside each other into `known_laps-I-of-N.csv` of the current folder; `--merge FILE…` puts them into the
table of the package, where a faster lap takes a slower one's place. Tracks of one shape are planned once. A plan takes
1 to 15 CPU-seconds.
"""

from __future__ import annotations

import argparse
import time
from pathlib import Path

import racecraft
from racecraft.kernels import set_threads
from racecraft.worlds.deepracer.driving.action_tables import default_table, read_table
from racecraft.worlds.deepracer.driving.known_laps import FORWARD, REVERSE, TABLE, KnownLap, read_laps, record_lap
from racecraft.worlds.deepracer.driving.planner import BEAM, REFINEMENTS, plan_best_lap
from racecraft.worlds.deepracer.env.vehicle import PROFILES
from racecraft.worlds.deepracer.tracks.catalogue import load_track, names, resolve
from racecraft.worlds.deepracer.tracks.track import Track

CARS = (("v6", 2.5), ("v5-classic", 4.0), ("v4", 4.0), ("v6", 4.0))
"""In the order in which they are planned: today's default car first."""
FIRST = ("reinvent_base", "2022_reinvent_champ", "2024_reinvent_champ_ccw", "Monaco", "Oval_track")
"""Tracks that are asked for most."""


def roads() -> dict[tuple[str, str], Track]:
    """Return every track in each direction it can be driven: forward before reverse, those asked for most first."""
    order = dict.fromkeys([*(resolve(name) for name in FIRST), *names()])
    forward = {(name, FORWARD): load_track(name) for name in order}
    return forward | {(name, REVERSE): road.reversed() for (name, _), road in forward.items() if road.closed}


def plan_lap(road: Track, car: str, top_speed: float, beam: int, refinements: int) -> float | None:
    """Return the lap time of a plan with the car's usual table, s; None where no lap was found."""
    actions = read_table(default_table(car, top_speed))
    plan = plan_best_lap(road, PROFILES[car], actions, beam=beam, refinements=refinements)
    return None if plan is None else plan.lap_seconds


def main() -> None:
    """Plan a slice, or merge slices."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--slice", default="1/1", help="I/N: every N-th row, from the I-th.")
    parser.add_argument("--only", action="append", default=[], help="CAR:TOP_SPEED, such as v6:2.5; may be repeated.")
    parser.add_argument("--track", action="append", default=[], help="A track by name; may be repeated.")
    parser.add_argument("--again", action="store_true", help="Plan rows again that the table has.")
    parser.add_argument("--beam", type=int, default=BEAM, help="States kept after each tick.")
    parser.add_argument("--refinements", type=int, default=REFINEMENTS, help="How often a lap may become the guide.")
    parser.add_argument("--merge", nargs="+", type=Path, default=[], help="Put these files into the table, and stop.")
    given = parser.parse_args()
    set_threads(1)  # slices run beside each other
    for file in given.merge:
        print(file, sum(record_lap(lap) for lap in read_laps(file)), "rows new or faster")
    if given.merge:
        return
    first, count = map(int, given.slice.split("/"))
    part = Path(f"known_laps-{first}-of-{count}.csv")
    read = [part] if given.again else [TABLE, part]
    done = {lap.key for file in read if file.is_file() for lap in read_laps(file)}
    every = roads()
    alike: dict[str, list[tuple[str, str]]] = {}
    for key, road in every.items():
        alike.setdefault(road.hash(), []).append(key)
    asked = {resolve(name) for name in given.track} or set(names())
    cars = [(car, float(speed)) for car, speed in (one.split(":") for one in given.only)] or CARS
    rows = [(car, speed, keys) for car, speed in cars for keys in alike.values() if asked & {name for name, _ in keys}]
    for number, (car, speed, keys) in enumerate(rows[first - 1 :: count], 1):
        if all((*key, car, speed) in done for key in keys):
            continue
        began, cpu = time.perf_counter(), time.process_time()
        seconds = plan_lap(every[keys[0]], car, speed, given.beam, given.refinements)
        for name, direction in keys if seconds is not None else ():
            table = default_table(car, speed)
            record_lap(KnownLap(name, direction, car, speed, table, seconds, "plan", racecraft.__version__), part)
        told = "no lap" if seconds is None else f"{seconds:.2f} s"
        spent = f"{time.process_time() - cpu:.1f} CPU-s, {time.perf_counter() - began:.0f} s"
        print(f"{number}/{len(rows[first - 1 :: count])}", *keys[0], car, speed, told, spent, flush=True)


if __name__ == "__main__":
    main()
