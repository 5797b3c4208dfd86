"""Decisions made anew, tick by tick."""

import numpy as np

from racecraft.rollout.repeating import Repeats


def test_what_was_decided_is_decided_again_for_all_or_for_those_asked():
    again = Repeats()
    assert again.tick == 0
    for actions in (np.arange(12).reshape(3, 4), np.arange(100, 108).reshape(2, 4)):
        again.take_up(actions)
        assert again.tick == 0
        assert again.act({}).actions.tolist() == actions[0].tolist()
        assert again.act({}, rows=np.array([3, 1])).actions.tolist() == actions[1, [3, 1]].tolist()
        assert again.tick == 2
