"""What laps earn is set against their times."""

import numpy as np
import pytest

from racecraft.worlds.deepracer.driving.reward.speed import LAPPING, NEITHER, PACE, SPEED, judge_speed, spearman

SECONDS = np.linspace(6.0, 40.0, 12)


@pytest.mark.parametrize(
    ("earned", "teaches"),
    [(SECONDS, LAPPING), (400.0 / SECONDS, SPEED), (0.0 * SECONDS + 35.0, PACE), (0.0 * SECONDS, NEITHER)],
)  # fmt: skip
def test_the_verdict_follows_the_sums_then_the_pay_a_second(earned, teaches):
    assert judge_speed([("a", float(s), float(e)) for s, e in zip(SECONDS, earned, strict=True)]).teaches == teaches


def test_ranks_are_those_of_the_textbook_and_ties_share_theirs():
    assert spearman(np.array([1.0, 2.0, 3.0, 4.0]), np.array([1.0, 4.0, 9.0, 16.0])) == pytest.approx(1.0)
    assert spearman(np.array([1.0, 2.0, 3.0, 4.0]), np.array([1.0, 1.0, 2.0, 2.0])) == pytest.approx(0.8944, abs=1e-4)
    assert spearman(np.array([1.0, 2.0]), np.array([5.0, 5.0])) == 0.0
