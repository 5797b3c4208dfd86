"""What a check of a reward and a rescored log cost, in processor seconds of all processes, start-up included.

    python benchmarks/reward_lab.py LOG [--rows 100000]

LOG is any log that `racecraft logs` reads; its rows are repeated until there are so many.
"""

from __future__ import annotations

import argparse
import resource
from pathlib import Path

import polars as pl

from racecraft.worlds.deepracer.analysis.logs import find_track
from racecraft.worlds.deepracer.driving.reward.check import check_reward
from racecraft.worlds.deepracer.driving.reward.paying import Payer
from racecraft.worlds.deepracer.driving.reward.rescore import rescore
from racecraft.worlds.deepracer.env.reward_process import open_reward
from racecraft.worlds.deepracer.files.reward_samples import FOLDER
from racecraft.worlds.deepracer.logs import read

SAMPLES = ("centre_line", "metres_gained", "aim_ahead", "line_follower")


def main() -> None:
    """Measure every sample."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("log", type=Path)
    parser.add_argument("--rows", type=int, default=100_000)
    asked = parser.parse_args()
    ticks = read(asked.log).require_ticks()
    track = find_track(ticks)
    again = [ticks.with_columns(pl.col("unique_episode") + k * 10_000) for k in range(1 + asked.rows // ticks.height)]
    ticks = pl.concat(again)[: asked.rows]
    for name in SAMPLES:
        began = cpu_seconds()
        process = open_reward(FOLDER / f"{name}.py")
        rescore(ticks, track, Payer(process))
        process.close()
        rescored = cpu_seconds()
        check_reward(FOLDER / f"{name}.py")
        print(
            f"{name:16} rescore {asked.rows:,} rows {rescored - began:5.2f} s  check {cpu_seconds() - rescored:5.2f} s"
        )


def cpu_seconds() -> float:
    """Return the processor time of this process and of the children that have ended, s."""
    used = (resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN))
    return sum(one.ru_utime + one.ru_stime for one in used)


if __name__ == "__main__":
    main()
