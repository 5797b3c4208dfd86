"""A loaded policy answers rows and one bare observation, greedily or by its probabilities."""

import numpy as np
import pytest
import torch

from racecraft.algorithms.building import build_learner
from racecraft.algorithms.networks import NetworkConfig
from racecraft.algorithms.policy_spec import PolicySpec
from racecraft.algorithms.ppo import PpoConfig
from racecraft.algorithms.registry import find_algorithm
from racecraft.algorithms.stacking import StackedPolicy
from racecraft.contract.errors import SettingError
from racecraft.contract.world import ArraySpec, ContinuousActions, DiscreteActions, MultiDiscreteActions, WorldSpec
from racecraft.players.trained import TrainedPolicy, policy_from
from racecraft.settings.composition import Settings
from racecraft.training.settings import RuntimeConfig

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


def trained(observations, actions=THREE, policy=None):
    return TrainedPolicy(None, None, PolicySpec("toy", observations, actions), policy or Weighs(), {})


def actor_for(actions):
    spec = WorldSpec("toy", 1, 1, {"place": PLACE}, actions)
    settings = Settings(network=NetworkConfig(), runtime=RuntimeConfig(), ppo=PpoConfig())
    learner = build_learner(find_algorithm("ppo"), spec, settings, 1)
    return policy_from(learner.policy_spec, learner.state_dict()["network"])


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


class DrawsOf(Weighs):
    """Draws by its probabilities."""

    def sample(self, observations, action_mask, generator):
        likely = torch.from_numpy(self.probabilities(observations, action_mask))
        return torch.multinomial(likely, 1, generator=generator)[:, 0].numpy()


def test_choices_are_sampled_by_their_probabilities_where_a_generator_is_given():
    policy, rng = trained({"place": PLACE}, policy=DrawsOf()), np.random.default_rng(1)
    rows = np.eye(3, dtype=np.float32)[[1] * 2000]
    drawn = policy.act({"place": rows}, sample=rng)
    assert np.bincount(drawn, minlength=3) / 2000 == pytest.approx([0.1, 0.8, 0.1], abs=0.03)
    assert policy.act({"place": rows}, sample=rng).tolist() != drawn.tolist()
    mask = np.array([[True, False, True]] * 2000)
    assert set(policy.act({"place": rows}, mask, sample=rng)) == {0, 2}
    assert policy.act(0, sample=rng) in (0, 1, 2)
    with pytest.raises(SettingError, match="a policy of toy knows no probabilities"):
        trained({"place": PLACE}).act(0, sample=rng)


def test_numbers_and_several_choices_are_sampled_too():
    rows = {"place": np.tile(np.eye(3, dtype=np.float32)[:1], (2000, 1))}
    for actions in (ContinuousActions((-1.0, 0.0), (1.0, 4.0)), MultiDiscreteActions((2, 3))):
        policy = trained({"place": PLACE}, actions, actor_for(actions))
        drawn, again = (policy.act(rows, sample=np.random.default_rng(3)) for _ in range(2))
        assert drawn.shape == (2000, 2)
        assert drawn.tolist() == again.tolist()
        assert np.unique(drawn, axis=0).shape[0] > 1
        assert np.unique(policy.act(rows), axis=0).shape[0] == 1
        assert policy.act(rows["place"][0], sample=np.random.default_rng(4)).shape == (2,)


def test_a_stack_moves_on_where_its_policy_is_sampled():
    shown = []

    class Sees(DrawsOf):
        def sample(self, observations, action_mask, generator):
            shown.append(observations["place"][0].tolist())
            return np.zeros(1, np.int64)

    policy = trained({"place": PLACE}, policy=StackedPolicy({"place": PLACE}, 2, Sees()))
    for k in (0, 1):
        policy.act({"place": np.eye(3, dtype=np.float32)[[k]]}, sample=np.random.default_rng(1))
    first, second = np.eye(3)[0], np.eye(3)[1]
    assert np.ravel(shown[1]).tolist() == [*first, *second]
