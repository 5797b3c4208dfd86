"""Advantages by hand: every number below is worked out in a comment."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from racecraft.algorithms.returns import advantages, explained_variance


def column(*numbers):
    return np.array(numbers, np.float32)[:, None]


def flags(*bits):
    return np.array(bits, bool)[:, None]


def half(reward, value, following, terminated, truncated, active=None):
    """Advantages with gamma = lambda = 1/2, of one row."""
    found, targets = advantages(reward, value, following, terminated, truncated, 0.5, 0.5, active)
    assert_allclose(targets, found + value)
    return found[:, 0]


@pytest.mark.parametrize(("over", "cut", "first"), [(0, 1, 1.5), (1, 0, 0.5), (1, 1, 0.5)])
def test_an_episode_cut_by_the_clock_bootstraps_and_one_that_is_over_does_not(over, cut, first):
    # tick 1: delta = 1 + 0.5 * 0.75 - 0.25 = 1.125, nothing after it
    # tick 0: delta = 1 + 0.5 * 2.00 - 0.50 = 1.5 where it is cut, 1 - 0.5 = 0.5 where it is over; nothing crosses
    got = half(column(1, 1), column(0.5, 0.25), column(2.0, 0.75), flags(over, 0), flags(cut, 0))
    assert_allclose(got, [first, 1.125])


def test_advantages_flow_back_through_an_episode():
    # tick 2: 3 + 0.5 * 4 - 1     = 4
    # tick 1: 0 + 0.5 * 1 - 2     = -1.5, + 0.25 * 4    = -0.5
    # tick 0: 1 + 0.5 * 2 - 0     = 2,    + 0.25 * -0.5 = 1.875
    got = half(column(1, 0, 3), column(0, 2, 1), column(2, 1, 4), flags(0, 0, 0), flags(0, 0, 0))
    assert_allclose(got, [1.875, -0.5, 4.0])


def test_an_inactive_tick_belongs_to_the_active_one_before_it():
    # tick 2 is active: 3 + 0.5 * 4 - 1 = 4
    # tick 1 is not: it is worth 2 + 0.5 * 1 = 2.5, whatever the critic says (99), and passes 0.5 * 4 = 2 through
    # tick 0: 1 + 0.5 * 2.5 - 0.25 = 2, + 0.25 * 2 = 2.5
    got = half(column(1, 2, 3), column(0.25, 99, 1), column(99, 1, 4), flags(0, 0, 0), flags(0, 0, 0), flags(1, 0, 1))
    assert_allclose(got[[0, 2]], [2.5, 4.0])


def test_an_inactive_start_leaks_nothing_into_the_episode_before():
    got = half(column(1, 5, 3), column(0.5, 7, 1), column(7, 1, 4), flags(1, 0, 0), flags(0, 0, 0), flags(1, 0, 1))
    assert_allclose(got[[0, 2]], [0.5, 4.0])


def test_with_lambda_one_the_target_is_the_discounted_sum_of_rewards():
    reward, value = np.random.default_rng(0).normal(size=(2, 7, 75)).astype(np.float32)
    over = np.zeros((7, 75), bool)
    over[-1] = True
    # the values in between telescope away
    following = np.concatenate([value[1:], value[:1]])
    _, targets = advantages(reward, value, following, over, over & False, 0.9, 1)
    summed = np.zeros(75)
    for t in reversed(range(7)):
        summed = reward[t] + 0.9 * summed
        assert_allclose(targets[t], summed, rtol=1e-4, atol=1e-4)


def test_explained_variance_is_one_for_a_seer_and_none_for_a_constant():
    truth = np.float32([1, 2, 3])
    assert explained_variance(truth, truth) == 1.0
    assert explained_variance(np.float32([2, 2, 2]), truth) == 0.0
    assert np.isnan(explained_variance(truth, np.float32([2, 2, 2])))


def slowly_corrected(reward, value, following, over, cut, discount, mix, weight):
    """Return V-trace's targets by the sum of Espeholt et al.'s equation 1, tick by tick, of one row."""
    targets = []
    for s in range(len(reward)):
        found, passed = value[s], 1.0
        for t in range(s, len(reward)):
            error = reward[t] + (0.0 if over[t] else discount * following[t]) - value[t]
            found += discount ** (t - s) * passed * weight[t] * error
            passed *= mix * weight[t]
            if over[t] or cut[t]:
                break
        targets.append(found)
    return np.array(targets)


def arbitrary(ticks=9, rows=75):
    rng = np.random.default_rng(0)
    reward, value, last = rng.normal(size=(3, ticks, rows)).astype(np.float32)
    over, cut = rng.random((2, ticks, rows)) < 0.15
    following = np.where(cut, last, np.concatenate([value[1:], last[:1]]))
    weight = np.minimum(np.exp(rng.normal(size=(ticks, rows))), 1.0).astype(np.float32)
    return reward, value, following, over, cut, weight


@pytest.mark.parametrize("mix", [0.0, 0.8, 1.0])
def test_what_older_weights_decided_has_the_targets_of_v_trace(mix):
    *story, weight = arbitrary()
    found, targets = advantages(*story, 0.9, mix, ratio=weight)
    rows = zip(*(part.T for part in (*story, weight)), strict=True)
    slow = np.stack([slowly_corrected(*row[:5], 0.9, mix, row[5]) for row in rows])
    assert_allclose(targets, slow.T, rtol=1e-4, atol=1e-5)
    reward, value, following, over, cut = story
    if mix == 1.0:  # the paper's own advantage: r + gamma v' - V, with v' the target of what follows
        behind = np.where(over | cut, following, np.concatenate([targets[1:], following[-1:]]))
        assert_allclose(found, reward + 0.9 * behind * ~over - value, rtol=1e-4, atol=1e-5)


def test_with_nothing_old_they_are_the_advantages_of_ever():
    *story, weight = arbitrary()
    active = np.random.default_rng(1).random(weight.shape) < 0.8
    for obeyed in (None, active):
        for here, there in zip(
            advantages(*story, 0.9, 0.8, obeyed), advantages(*story, 0.9, 0.8, obeyed, np.ones_like(weight)),
            strict=True,
        ):  # fmt: skip
            assert np.array_equal(here, there)


def test_an_inactive_tick_passes_through_what_follows_whatever_its_weight():
    # as above with gamma = lambda = 1/2: tick 2 has error 4 and weight 1/2: it adds 2; tick 1 passes 0.5 * 2 = 1
    # tick 0: error 2, advantage 2 + 0.5 * (0.5 * 1) = 2.25; before weights it would be 2.5 with 0.5 * 2
    reward, value, following = column(1, 2, 3), column(0.25, 99, 1), column(99, 1, 4)
    nothing, weight = flags(0, 0, 0), column(1, 7, 0.5)
    found, _ = advantages(reward, value, following, nothing, nothing, 0.5, 0.5, flags(1, 0, 1), weight)
    assert_allclose(found[[0, 2], 0], [2.25, 4.0])


def test_a_rollout_of_one_tick_needs_no_other():
    # 2 + 0.5 * 4 - 1 = 3 where it goes on, 2 - 1 = 1 where it is over; nothing comes after either
    one = column(2), column(1), column(4)
    for over, expected in ((0, 3.0), (1, 1.0)):
        for obeyed in (None, flags(1)):
            assert half(*one, flags(over), flags(0), obeyed).tolist() == [expected]


def test_the_share_foreseen_is_one_less_the_error_s_variance_over_the_targets():
    # targets 0 and 4: variance 4; errors 0 - 1 and 4 - 3: variance 1; 1 - 1/4
    assert explained_variance(np.float32([1, 3]), np.float32([0, 4])) == 0.75
    # targets 1 and 3 have the variance 1; errors 2 and -2 have 4: worse than none
    assert explained_variance(np.float32([-1, 5]), np.float32([1, 3])) == -3.0
