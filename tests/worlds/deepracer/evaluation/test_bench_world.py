"""What `racecraft bench` measures: ticks of all cars over the time they took, in three cases by turns."""

from itertools import count

import pytest

from racecraft.worlds.deepracer.evaluation import bench_world


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


def test_each_case_takes_its_turn_and_is_told_with_its_bounds(monkeypatch):
    threads = []
    monkeypatch.setattr(bench_world, "set_threads", threads.append)
    monkeypatch.setattr(bench_world, "NUM_CARS", 2)
    monkeypatch.setattr(bench_world, "ROUNDS", 3)
    monkeypatch.setattr(bench_world, "ROUND_SECONDS", 0.01)
    figures = bench_world.bench_world(lambda params: 1.0)
    assert threads == [1, 2, 1] * 3
    for case in ("one_core", "two_cores", "one_core_python_reward"):
        low, median, high = (figures[f"ticks_per_second_{case}{what}"] for what in ("_low", "", "_high"))
        assert 0 < low <= median <= high
