"""What seeds can tell, held against counting by hand and against groups that differ in nothing."""

import itertools

import numpy as np
import pytest

from racecraft.evaluation import seed_statistics
from racecraft.evaluation.seed_statistics import compare_groups, interquartile_mean, mean_interval


def test_the_interquartile_mean_is_the_mean_of_the_middle_half():
    rng = np.random.default_rng(3)
    scores = rng.normal(size=40)
    assert interquartile_mean(scores) == pytest.approx(np.sort(scores)[10:30].mean())
    assert interquartile_mean([4.0]) == 4.0
    assert interquartile_mean([1.0, 2.0, 3.0, 4.0, np.inf]) == pytest.approx((0.75 * 2 + 3 + 0.75 * 4) / 2.5)


def test_luck_is_counted_over_every_way_to_part_the_seeds():
    a, b = [5.0, 7.0, 7.0, 9.0], [4.0, 7.0, 6.0]
    won = lambda one, other: sum((x > y) + 0.5 * (x == y) for x, y in itertools.product(one, other))  # noqa: E731
    splits = list(itertools.combinations(range(7), 4))
    seeds = [*a, *b]
    as_far = [won([seeds[k] for k in one], [seeds[k] for k in range(7) if k not in one]) >= won(a, b) for one in splits]
    found = compare_groups(a, b, less_is_better=False)
    assert found.pairs_won == won(a, b)
    assert found.luck == pytest.approx(sum(as_far) / 35)


@pytest.mark.parametrize(("count", "luck"), [(1, 1 / 2), (3, 1 / 20)])
def test_clean_seeds_are_as_lucky_as_there_are_ways_to_part_them(count, luck):
    fast, slow = np.arange(count), 10.0 + np.arange(count)
    assert compare_groups(fast, slow, less_is_better=True).luck == pytest.approx(luck)
    assert compare_groups(slow, fast, less_is_better=True).luck == 1.0


def test_groups_that_differ_in_nothing_are_rarely_called_different():
    rng = np.random.default_rng(11)
    clear = [compare_groups(*rng.normal(size=(2, 4)), less_is_better=True).luck <= 0.05 for _ in range(200)]
    assert np.mean(clear) < 0.1  # 3 of 70 splits at most


def test_of_many_seeds_luck_is_drawn_and_comes_to_the_same(monkeypatch):
    a, b = np.arange(8.0), np.arange(8.0) + 2.5
    exact = compare_groups(a, b, less_is_better=True).luck
    monkeypatch.setattr(seed_statistics, "MAX_SPLITS", 5_000)
    drawn = compare_groups(a, b, less_is_better=True).luck
    assert drawn == pytest.approx(exact, abs=0.01)
    assert drawn != exact


def test_the_interval_of_a_mean_holds_it_about_as_often_as_it_says():
    rng = np.random.default_rng(5)
    inside = 0
    for _ in range(60):
        told = mean_interval(rng.normal(size=12))
        inside += told.low <= 0.0 <= told.high
    assert 48 <= inside <= 60


def test_two_seeds_have_no_interval_and_no_seed_without_a_lap_has():
    assert mean_interval([1.0, 2.0]).low is None
    assert mean_interval([1.0, 2.0, np.inf]).low is None
    assert compare_groups([1.0, 2.0], [3.0, 4.0, 5.0], less_is_better=True).probability.low is None
