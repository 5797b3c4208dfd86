"""What `racecraft bench` measures: the world that its page names, and ticks of all cars over the time they took."""

from itertools import count

import numpy as np
import pytest

from racecraft.worlds.deepracer.evaluation import bench_world


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


def test_three_cases_take_turns_for_five_rounds_and_the_median_is_told_with_its_bounds(monkeypatch):
    made, threads = [], []

    class Measured:
        def __init__(self, track_name, reward):
            made.append((track_name, reward))
            self.rates = iter([1000.6 * len(made) + spread for spread in (30, 10, 20, 50, 40)])

        def ticks_per_second(self):
            return next(self.rates)

    monkeypatch.setattr(bench_world, "_Run", Measured)
    monkeypatch.setattr(bench_world, "set_threads", threads.append)
    reward = lambda params: 1.0  # noqa: E731
    figures = bench_world.bench_world(reward)
    assert made == [("reinvent_base", None), ("reinvent_base", None), ("reinvent_base", reward)]
    assert threads == [1, 2, 1] * 5
    rates = {"one_core": (1031, 1011, 1051), "two_cores": (2031, 2011, 2051)}
    rates["one_core_python_reward"] = (3032, 3012, 3052)
    assert figures == {
        f"ticks_per_second_{name}{what}": rate
        for name, three in rates.items()
        for what, rate in zip(("", "_low", "_high"), three, strict=True)
    }


def test_cars_begin_at_seed_0_and_choose_each_of_the_ten_actions(monkeypatch):
    steps, seeds = [], []

    class World:
        spec = None

        def __init__(self, *made, **how):
            pass

        def reset(self, buffers, seed):
            seeds.append(seed)

        def step(self, choices, buffers):
            steps.append(choices)

    monkeypatch.setattr(bench_world, "RaceWorld", World)
    monkeypatch.setattr(bench_world, "allocate", lambda spec: None)
    run = bench_world._Run("reinvent_base", None)
    assert (seeds, len(steps), steps[0].shape) == ([0], 1, (64, 1))
    assert sorted(set(run._choices.ravel().tolist())) == [*range(10)]
    assert (run._choices[0] == steps[0]).all()
