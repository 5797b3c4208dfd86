"""Which other action would have saved it: how long it is held, which counts as best, what is tried at all."""

import math
from types import SimpleNamespace

import numpy as np
import pytest

from racecraft.worlds.deepracer.env.actions import ActionBox, ActionTable
from racecraft.worlds.deepracer.evaluation import counterfactuals
from racecraft.worlds.deepracer.evaluation.counterfactuals import (
    HOLDS,
    MOMENTS,
    Options,
    Trials,
    command_words,
    try_alternatives,
)

TABLE = ActionTable.of([(0.3, 1.0), (0.0, 1.0), (-0.6, 1.0), (0.0, 2.0)])
LEFT, STRAIGHT, RIGHT, FAST = range(4)


def trials_of(saved, holds=(1,), moments=(9, 3)):
    saved = np.array(saved, bool)
    return Trials(np.arange(len(saved)), np.array(moments), np.array(holds), Options.of(TABLE), saved)


def test_an_angle_of_half_a_radian_is_as_far_as_a_metre_a_second():
    """Done was straight on at 1 m/s, all save alike: 0.3 rad are nearer than 1 m/s more, 0.6 rad are further."""
    ranked = trials_of(np.ones((1, 2, 4, 1))).ranked(np.tile([0.0, 1.0], (2, 1)))
    assert ranked[:4] == [(1, STRAIGHT, 0), (1, LEFT, 0), (1, FAST, 0), (1, RIGHT, 0)]
    assert [moment for moment, _, _ in ranked] == [1] * 4 + [0] * 4, "the later moment first"


def test_of_one_moment_the_shorter_hold_comes_first_where_it_saves_nearly_as_many():
    """Of five failures held for 3 ticks saves all; for one tick 4, which is nearly, or 3, which is not."""
    for many, first in ((4, (0, LEFT, 0)), (3, (0, LEFT, 1))):
        saved = np.zeros((5, 1, 4, 2), bool)
        saved[:many, 0, LEFT, 0] = saved[:, 0, LEFT, 1] = True
        assert trials_of(saved, (1, 3), (9,)).ranked(np.array([[0.0, 1.0]]))[0] == first


@pytest.mark.parametrize(("saves", "holds"), [(5, [1]), (4, [1]), (3, [1, 3, 9]), (0, [1, 3, 9])])
def test_longer_holds_are_tried_until_one_change_saves_four_of_five(monkeypatch, saves, holds):
    """Each of five failures ends at tick 40; saved are the first few, by a turn to the left 10 ticks before."""
    asked = []

    def rehearsed(policy, worlds, drives, changes, remembers):
        asked.append((remembers, {change.hold for change in changes}))
        return [change.row < saves and change.tick == 30 and change.action == LEFT for change in changes]

    monkeypatch.setattr(counterfactuals, "rerun_with_change", rehearsed)
    drives = SimpleNamespace(last=np.full(5, 40), actions=np.full((41, 5), STRAIGHT))
    trials = try_alternatives(None, None, drives, np.arange(5), TABLE)
    assert asked == [(False, {hold}) for hold in holds]
    assert trials.holds.tolist() == holds
    assert trials.moments.tolist() == list(MOMENTS)
    assert trials.saved.shape == (5, 11, 4, len(holds))
    assert trials.saved.sum() == saves * len(holds)
    assert trials.saved[:saves, MOMENTS.index(10), LEFT].all()


def test_two_ranges_are_tried_at_five_angles_and_three_speeds():
    options = Options.of(ActionBox((-0.5, 0.5), (1.0, 3.0)))
    expected = [(angle, speed) for angle in (-0.5, -0.25, 0.0, 0.25, 0.5) for speed in (1.0, 2.0, 3.0)]
    assert options.actions == pytest.approx(np.array(expected))
    assert options.actions.dtype == np.float32
    assert (options.labels[6], options.labels[14]) == ("straight at 1 m/s", "left 29° at 3 m/s")
    assert command_words(math.radians(-12.4), 1.26) == "right 12° at 1.3 m/s"
    assert HOLDS == (1, 3, 9)
