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
