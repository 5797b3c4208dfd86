"""A car's laps from starts that its training and its evaluations do not use. See `fresh_laps`."""

from __future__ import annotations

import math

from racecraft.evaluation.fresh_starts import FreshScores
from racecraft.formats.run_folder import RunFolder
from racecraft.worlds.deepracer.evaluation.laps import judge_starts
from racecraft.worlds.deepracer.players.trained_car import load_trained_car

BETWEEN = 0.37
"""Starts lie at (i + BETWEEN) / count of the lap: between those of a training, which go on by 5 % of the lap."""


def fresh_laps(run: RunFolder, which: str, episodes: int) -> FreshScores:
    """Let a checkpoint drive one lap from each of so many fresh starts, from rest, on the track it was trained on."""
    car = load_trained_car(run.path, which)
    starts = [(k + BETWEEN) / episodes for k in range(episodes)]
    report = judge_starts(car.policy, car.world(car.trained_on, episodes, starts))
    laps = tuple(math.inf if lap.seconds is None else lap.seconds for lap in report.laps)
    return FreshScores("lap time, s", True, laps, car.checkpoint.iteration, report.mean_progress_percent)
