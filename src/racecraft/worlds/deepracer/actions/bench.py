"""Measure this machine; run it when nothing else runs."""

from __future__ import annotations

from dataclasses import dataclass

from racecraft.actions.action import action
from racecraft.actions.figures import Figures
from racecraft.contract.progress import Progress, quiet
from racecraft.settings.request import Request, option


@dataclass(frozen=True, kw_only=True)
class BenchWorldRequest(Request):
    """Nothing: the cases are fixed."""


@dataclass(frozen=True, kw_only=True)
class BenchLapsRequest(Request):
    """How often is trained."""

    seeds: int = option(5, "How many seeds, counted from 1.", low=1)


@action
def bench_world(request: BenchWorldRequest, progress: Progress = quiet) -> Figures:
    """Ticks per second of 64 cars: physics, every reward parameter and a 160x120 anti-aliased frame.

    Example: racecraft bench world --json
    """
    from racecraft.worlds.deepracer.evaluation import bench_world as bench
    from racecraft.worlds.deepracer.training.trainer import load_reward

    progress("Five rounds of three cases, about 20 s …")
    return Figures(bench.bench_world(load_reward(None).copies(bench.NUM_CARS)))


@action
def bench_laps(request: BenchLapsRequest, progress: Progress = quiet) -> Figures:
    """Seconds from the first training tick to stable laps of the car of the preset fast on reinvent_base.

    Example: racecraft bench laps --seeds 3
    """
    from racecraft.worlds.deepracer.training import bench_laps as bench

    return Figures(bench.bench_laps(range(1, request.seeds + 1), progress))
