"""Who earns something in a tick."""

import pytest

from racecraft.contract.errors import ContractError
from racecraft.worlds.deepracer.env import race
from racecraft.worlds.deepracer.env.reward_caller import IS_PAID, require_rewards


def test_a_car_that_waits_or_is_away_earns_nothing():
    assert [name for name, paid in zip(race.STATUSES, IS_PAID, strict=True) if not paid] == ["prepare", "park", "pause"]


def test_rewards_are_one_for_all_or_one_for_each_car():
    for reward in (None, len, [len] * 4):
        require_rewards(reward, 4)
    for count in (0, 3, 5):
        with pytest.raises(ContractError, match=f"{count} reward functions were given; expected one for all or 4"):
            require_rewards([len] * count, 4)
