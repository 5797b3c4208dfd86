"""How often a lost player is started anew."""

import pytest

from racecraft.contract.errors import UserInputError
from racecraft.worlds.unity.env.restarts import RestartLimits, RestartQuota


class Clock:
    now = 0.0

    def __call__(self):
        return self.now


def taken(limits, times):
    """Return whether a new start was given at each of the times, in seconds."""
    clock = Clock()
    quota = RestartQuota(limits, clock)
    given = []
    for clock.now in times:
        given.append(quota.use() == "")
    assert quota.used == sum(given)
    return given


def test_ml_agents_defaults_give_one_a_minute_and_ten_in_all():
    assert taken(RestartLimits(), [0, 1, 59.9, 60, 61]) == [True, False, False, True, False]
    assert taken(RestartLimits(), range(0, 720, 60)) == [True] * 10 + [False] * 2


def test_minus_one_is_no_limit():
    assert taken(RestartLimits(-1, -1), [0] * 100) == [True] * 100
    assert taken(RestartLimits(-1, 2, 10), [0, 0, 0, 10]) == [True, True, False, True]
    assert taken(RestartLimits(2, -1), [0, 0, 0]) == [True, True, False]
    assert taken(RestartLimits(0), [0, 100]) == [False, False]


def test_limits_that_cannot_be_are_refused():
    with pytest.raises(UserInputError, match="max_lifetime_restarts is -2; expected a count"):
        RestartLimits(max_lifetime_restarts=-2)
    with pytest.raises(UserInputError, match="expected seconds"):
        RestartLimits(restarts_rate_limit_period_s=-1)


def test_a_period_of_no_length_limits_nothing():
    assert taken(RestartLimits(-1, 1, 0), [0, 0, 0]) == [True] * 3
    assert taken(RestartLimits(-1, 1, 0.5), [0, 0.25, 0.5]) == [True, False, True]


def test_new_starts_are_counted_as_they_are_given():
    quota = RestartQuota(RestartLimits(2, -1), Clock())
    counts = [quota.used]
    for _ in range(3):
        quota.use()
        counts.append(quota.used)
    assert counts == [0, 1, 2, 2]


def test_a_refusal_says_what_was_used_and_what_would_do():
    lifetime, rate = (RestartQuota(RestartLimits(*limits), Clock()) for limits in ((1, -1), (-1, 1, 30)))
    assert (lifetime.use(), rate.use()) == ("", "")
    assert lifetime.use() == (
        "It was started anew 1 times before, and max_lifetime_restarts is 1; give more, or -1 for no limit."
    )
    assert rate.use() == (
        "It was started anew 1 times in the last 30 s, and restarts_rate_limit_n is 1; give more, or -1 for no limit."
    )
