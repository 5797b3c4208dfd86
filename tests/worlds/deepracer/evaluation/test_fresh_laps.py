"""Fresh starts are none of a training's, and an unfinished lap is told as none."""

import math
from types import SimpleNamespace

import numpy as np
import pytest

from racecraft.worlds.deepracer.evaluation import fresh_laps as module
from racecraft.worlds.deepracer.evaluation.laps import Lap, LapReport


@pytest.mark.parametrize("episodes", [1, 20, 50])
def test_starts_lie_between_those_of_a_training(monkeypatch, episodes):
    starts = []
    laps = (Lap(0.0, 100.0, 6.2, "lap_complete", 93), Lap(0.0, 40.0, None, "off_track", 30))
    car = SimpleNamespace(
        policy=None, trained_on=None, checkpoint=SimpleNamespace(iteration=7),
        world=lambda track, count, shares: starts.extend(shares),
    )  # fmt: skip
    monkeypatch.setattr(module, "load_trained_car", lambda path, which: car)
    monkeypatch.setattr(module, "judge_starts", lambda policy, world: LapReport(laps))
    told = module.fresh_laps(SimpleNamespace(path="run"), "best", episodes)
    assert told.values == (6.2, math.inf)
    assert (told.checkpoint, told.fallback) == (7, 70.0)
    trained = np.arange(0.0, 1.0, 0.05)  # where a training's evaluations begin
    assert len(starts) == episodes
    assert min(np.abs(np.subtract.outer(starts, trained)).min(axis=1)) > 0.002
