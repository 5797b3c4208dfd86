"""Ratings by hand: of two players all is one equation, which is solved here by halving, and of one there is none."""

import math

import numpy as np
import pytest

from racecraft.evaluation.rating import Rating, Result, rate, strengths, wilson, wins_of

NAT = 400 / math.log(10)
"""Elo points: odds of 10 to 1 are 400."""


def nats_of_two(won, lost):
    """Strength of the first of two, who stands as far above the mean as the other below; its prior is 400 points wide.

    There the results' pull equals the prior's: won - games * chance = strength / spread².
    """
    low, high = -5.0, 5.0
    for _ in range(100):
        mid = (low + high) / 2
        pull = won - (won + lost) / (1 + math.exp(-2 * mid)) - mid / math.log(10) ** 2
        low, high = (mid, high) if pull > 0 else (low, mid)
    return low


@pytest.mark.parametrize(("won", "lost"), [(1, 0), (2, 5), (40, 4)])
def test_of_two_players_strength_and_interval_are_those_of_one_equation(won, lost):
    first, second = rate(2, [Result((0, 1), (0, 1))] * won + [Result((0, 1), (1, 0))] * lost)
    nats = nats_of_two(won, lost)
    assert (first.points, second.points) == pytest.approx((1500 + NAT * nats, 1500 - NAT * nats), abs=1e-6)
    chance = 1 / (1 + math.exp(-2 * nats))
    # Along (1, -1) / sqrt(2) the curvature is 2 n p (1 - p) + 1 / spread²; of it each has half the variance.
    spread = math.sqrt(0.5 / (2 * (won + lost) * chance * (1 - chance) + 1 / math.log(10) ** 2))
    assert first.high - first.points == pytest.approx(1.96 * NAT * spread)
    assert first.points - first.low == pytest.approx(1.96 * NAT * spread)


def test_a_game_of_four_is_six_comparisons_that_count_a_third_each_and_equal_places_are_halves():
    wins = wins_of(5, [Result((3, 0, 1, 2), (0, 1, 1, 3)), Result((4, 3), (0, 1)), Result((2,), (0,))])
    third = 1 / 3
    expected = np.zeros((5, 5))
    expected[3, [0, 1, 2]] = third
    expected[[0, 1], 2] = third
    expected[0, 1] = expected[1, 0] = third / 2
    expected[4, 3] = 1.0
    np.testing.assert_allclose(wins, expected)


def test_who_never_met_anybody_stands_at_the_mean_with_what_the_prior_leaves_open():
    assert rate(0, []) == []
    assert rate(1, []) == [Rating(1500, 1500, 1500)], "alone one is the mean"
    one, other = rate(2, [])
    assert one == other
    half = 1.96 * 400 / math.sqrt(2)  # about the mean of two each keeps half the prior's variance
    assert (one.low, one.points, one.high) == pytest.approx((1500 - half, 1500, 1500 + half))


def test_the_mean_of_several_anchors_is_the_scale_and_the_covariance_is_told_of_all():
    games = [Result((0, 1, 2), (0, 1, 2))] * 6 + [Result((2, 0), (0, 1))] * 2
    found = rate(3, games, anchors=(0, 2))
    free = rate(3, games)
    assert found[0].points + found[2].points == pytest.approx(3000)
    shifts = [one.points - other.points for one, other in zip(found, free, strict=True)]
    assert shifts == pytest.approx([shifts[0]] * 3), "anchors move the scale, not the players"
    strong, covariance = strengths(wins_of(3, games), anchors=(0, 2))
    assert covariance.shape == (3, 3)
    assert [one.spread**2 for one in strong] == pytest.approx(np.diag(covariance).tolist())
    assert covariance[0, 0] == pytest.approx(-covariance[0, 2]), "two anchors lie alike to both sides of their mean"


@pytest.mark.parametrize(("wins", "games"), [(3, 7), (0, 10), (10, 10), (12.5, 20)])
def test_wilsons_bounds_are_the_rates_from_which_the_share_lies_two_errors_away(wins, games):
    for bound, side in zip(wilson(wins, games), (1, -1), strict=True):
        away = 1.96 * math.sqrt(max(0.0, bound * (1 - bound)) / games)
        assert bound + side * away == pytest.approx(wins / games, abs=1e-7)
        assert -1e-12 <= bound <= 1 + 1e-12


def test_of_no_games_any_rate_is_possible():
    assert wilson(0, 0) == (0.0, 1.0)
