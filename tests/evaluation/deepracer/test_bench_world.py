"""What `racecraft bench` measures: the world that its page names, and ticks of all cars over the time they took."""

from itertools import count

import numpy as np
import pytest

from racecraft.evaluation.deepracer import bench_world


def test_the_world_that_is_measured_is_64_cars_of_160_by_120_pixels_and_ten_actions(monkeypatch):
    made = {}

    class Recorded:
        def __init__(self, track, actions, reward, camera_config, num_cars):
            made.update(actions=actions, size=(camera_config.width, camera_config.height), cars=num_cars)
            raise KeyboardInterrupt

    monkeypatch.setattr(bench_world, "RaceWorld", Recorded)
    with pytest.raises(KeyboardInterrupt):
        bench_world.bench_world(lambda params: 1.0)
    assert (made["cars"], made["size"]) == (64, (160, 120))
    actions = made["actions"]
    told = list(zip(np.degrees(actions.steering).round(6), actions.speed, strict=True))
    assert told == [(angle, speed) for angle in (-30, -15, 0, 15, 30) for speed in (0.5, 1.0)]


def test_a_round_counts_the_ticks_of_all_cars_over_the_time_that_passed(monkeypatch):
    """By hand: a clock that goes on by 0.4 s at each look; after two ticks 1.2 s have passed."""
    seen = []
    run = bench_world._Run.__new__(bench_world._Run)
    run._world = type("World", (), {"step": staticmethod(lambda choices, buffers: seen.append(choices))})
    run._buffers, run._choices = None, [10, 20]
    looks = count()
    monkeypatch.setattr(bench_world.time, "perf_counter", lambda: 0.4 * next(looks))
    assert run.ticks_per_second() == pytest.approx(2 * 64 / 1.2)
    assert seen == [10, 20]
