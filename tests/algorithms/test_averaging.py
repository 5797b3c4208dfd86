"""The mean of a learner's latest weights: who goes by it, and who does not."""

import numpy as np
import pytest
import torch

from racecraft.algorithms.averaging import AveragedLearner
from racecraft.algorithms.building import build_learner, with_averaging
from racecraft.algorithms.networks import NetworkConfig
from racecraft.algorithms.ppo import PpoConfig, PpoLearner
from racecraft.algorithms.registry import find_algorithm
from racecraft.algorithms.weights import take_policy, with_policy
from racecraft.contract.errors import SettingError
from racecraft.contract.world import ArraySpec, DiscreteActions, WorldSpec
from racecraft.players.trained import policy_from
from racecraft.settings.composition import Settings
from racecraft.training.settings import EvaluationConfig, RuntimeConfig

SPEC = WorldSpec("toy", 4, 1, {"position": ArraySpec((2,), np.float32)}, DiscreteActions(3))
SEEN = {"position": np.random.default_rng(0).normal(size=(50, 2)).astype(np.float32)}


class Drawn(PpoLearner):
    """Learns nothing: every update draws its weights anew."""

    def update(self, experience):
        with torch.no_grad():
            for part in self.network.parameters():
                part.copy_(torch.randn(part.shape, generator=self.generator))
        return {}


@pytest.fixture
def learner():
    return AveragedLearner(Drawn(SPEC, NetworkConfig(), PpoConfig(), seed=3), 0.25, PpoLearner.load_policy)


def test_the_mean_is_over_a_share_of_the_updates_so_far(learner):
    begun, drawn = {name: part.clone() for name, part in learner.mean.items()}, []
    for _ in range(5):
        learner.update(None)
        drawn.append(learner.inner.state_dict()["network"])
    for name, mean in begun.items():
        for weight, one in zip((1.0, 1 / 1.25, 1 / 1.5, 1 / 1.75, 1 / 2.0), drawn, strict=True):
            mean = (1.0 - weight) * mean + weight * one[name]
        torch.testing.assert_close(learner.mean[name], mean)


def test_who_explores_goes_by_the_latest_weights_and_who_is_judged_and_kept_by_the_mean(learner):
    judged = learner.greedy_policy()
    for _ in range(3):
        learner.update(None)
    drawn = learner.act(SEEN, generator=torch.Generator().manual_seed(1))
    same = learner.inner.act(SEEN, generator=torch.Generator().manual_seed(1))
    assert (drawn.columns["log_prob"] == same.columns["log_prob"]).all()
    state = learner.state_dict()
    kept = policy_from(learner.policy_spec, take_policy(state))
    assert (judged.act(SEEN) == kept.act(SEEN)).all()
    assert (learner.choose(SEEN) == kept.act(SEEN)).all()
    assert (judged.act(SEEN) != learner.inner.choose(SEEN)).any()


def test_it_goes_on_where_it_was_and_begins_with_weights_alone(learner):
    for _ in range(3):
        learner.update(None)
    state = learner.state_dict()
    kept = take_policy(state)
    twin = AveragedLearner(Drawn(SPEC, NetworkConfig(), PpoConfig(), seed=4), 0.25, PpoLearner.load_policy)
    twin.load_state_dict(with_policy(state, kept))
    for one in (learner, twin):
        one.update(None)
    assert all(torch.equal(part, twin.mean[name]) for name, part in learner.mean.items())
    twin.load_state_dict({"network": kept})
    assert twin.updates == 0
    assert all(torch.equal(part, twin.mean[name]) for name, part in kept.items())


def test_it_is_laid_round_a_learner_where_a_share_is_set_and_refused_where_a_search_asks():
    groups = {"network": NetworkConfig(hidden_units=(4,)), "runtime": RuntimeConfig()}
    averaged = Settings(evaluation=EvaluationConfig(averaged=0.1), ppo=PpoConfig(), **groups)
    assert isinstance(build_learner(find_algorithm("ppo"), SPEC, averaged, 1), AveragedLearner)
    latest = averaged.with_group("evaluation", EvaluationConfig())
    assert isinstance(build_learner(find_algorithm("ppo"), SPEC, latest, 1), PpoLearner)
    with pytest.raises(SettingError, match="evaluation.averaged is 0.1, and alphazero is asked by a search"):
        with_averaging(build_learner(find_algorithm("ppo"), SPEC, latest, 1), find_algorithm("alphazero"), averaged)
