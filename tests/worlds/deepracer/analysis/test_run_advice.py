"""Advice of a car's learner and of its log together."""

import pytest

from racecraft.analysis.advice import Advice
from racecraft.worlds.deepracer.analysis.run_advice import merge_advice

BACK, ON, WHY = "racecraft train --from RUN:best --set a=1", "racecraft train --run RUN --resume", "racecraft why RUN"


@pytest.mark.parametrize(
    ("learners", "logs", "left"),
    [
        ([BACK], [ON, WHY, BACK], [BACK, WHY, BACK]),
        ([WHY], [ON, BACK], [WHY, ON, BACK]),
        ([], [ON], [ON]),
    ],
)
def test_nobody_is_told_to_go_back_and_on_at_once(learners, logs, left):
    sides = ([Advice("", "", None, command) for command in side] for side in (learners, logs))
    assert [one.command for one in merge_advice(*sides)] == left
