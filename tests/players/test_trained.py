"""A loaded policy answers rows and one bare observation, greedily or by its probabilities."""

import numpy as np
import pytest

from racecraft.algorithms.policy_spec import PolicySpec
from racecraft.contract.errors import SettingError
from racecraft.contract.world import ArraySpec, ContinuousActions, DiscreteActions
from racecraft.players.trained import TrainedPolicy

PLACE, MUCH = ArraySpec((3,), np.float32, 0.0, 1.0), ArraySpec((2,), np.float32)


class Weighs:
    """Chooses by the place that is shown; knows its probabilities."""

    def act(self, observations, action_mask=None):
        assert observations["place"].dtype == np.float32
        return self.probabilities(observations, action_mask).argmax(axis=1)

    def probabilities(self, observations, action_mask=None):
        likely = 0.1 + 0.7 * observations["place"]
        return likely if action_mask is None else np.where(action_mask, likely, 0.0)


THREE = DiscreteActions(3)


def trained(observations, actions=THREE):
    return TrainedPolicy(None, None, PolicySpec("toy", observations, actions), Weighs(), {})


def test_rows_are_answered_row_by_row_and_a_bare_observation_by_one_action():
    policy, rows = trained({"place": PLACE}), np.eye(3, dtype=np.float32)[[2, 0]]
    assert policy.act({"place": rows, "more": np.zeros(9)}).tolist() == [2, 0]
    for bare in (rows[0], {"place": rows[0].astype(float)}, 2, np.int64(2)):
        assert policy.act(bare) == 2
    assert policy.act(rows).tolist() == [2, 0]
    assert policy.act(rows[0], np.array([True, True, False])) in (0, 1)
    several = trained({"place": PLACE, "much": MUCH})
    assert several.act({"place": 1, "much": [0.5, 0.5]}) == 1
    with pytest.raises(SettingError, match="sees place, much; expected each by its name"):
        several.act(rows[0])


def test_choices_are_sampled_by_their_probabilities_where_a_generator_is_given():
    policy, rng = trained({"place": PLACE}), np.random.default_rng(1)
    rows = np.eye(3, dtype=np.float32)[[1] * 2000]
    drawn = policy.act({"place": rows}, sample=rng)
    assert np.bincount(drawn, minlength=3) / 2000 == pytest.approx([0.1, 0.8, 0.1], abs=0.03)
    mask = np.array([[True, False, True]] * 2000)
    assert set(policy.act({"place": rows}, mask, sample=rng)) == {0, 2}
    assert policy.act(0, sample=rng) in (0, 1, 2)
    with pytest.raises(SettingError, match="expected single choices to sample"):
        trained({"place": PLACE}, ContinuousActions((-1.0,), (1.0,))).act(0, sample=rng)
