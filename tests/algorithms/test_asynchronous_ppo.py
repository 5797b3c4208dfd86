"""PPO with its learner beside: what it learns from is older than it is, and V-trace says how much it counts."""

import threading
from contextlib import nullcontext
from dataclasses import replace
from functools import partial
from types import SimpleNamespace

import numpy as np
import pytest
import torch
from tests.algorithms.test_ppo import STATE, made_up, world_spec
from toy_world import CopyTheNumber

from racecraft.algorithms.asynchronous_ppo import AsynchronousPpo, CorrectedPpoLearner
from racecraft.algorithms.imitation import ImitationConfig, ImitationWrapper
from racecraft.algorithms.learner import DivergedError, counting
from racecraft.algorithms.networks import NetworkConfig
from racecraft.algorithms.ppo import LOG_PROB, PpoConfig, PpoLearner
from racecraft.contract.errors import SettingError
from racecraft.contract.world import ContinuousActions, DiscreteActions
from racecraft.players.trained import GreedyPolicy
from racecraft.rollout.collector import Collector
from racecraft.rollout.episodes import play_episodes
from racecraft.rollout.statistics import summarise

SPEC = world_spec({"state": STATE}, DiscreteActions(3))
NUMBERS = world_spec({"state": STATE}, ContinuousActions((-1.0, -1.0), (1.0, 1.0)))
NETWORK = NetworkConfig(hidden_units=(16,), activation="tanh", separate_networks=False)


def plain(seed=3, spec=SPEC, network=NETWORK, kind=PpoLearner, **settings):
    return kind(spec, network, PpoConfig(**{"batch_size": 8, "epochs": 2, **settings}), seed)


def beside(seed=3, kind=CorrectedPpoLearner, spec=SPEC, network=NETWORK, **settings):
    config = PpoConfig(**{"batch_size": 8, "epochs": 2, "asynchronous": True, **settings})
    return AsynchronousPpo(partial(kind, spec, network, config, seed))


def weights_of(learner):
    return {name: part.clone() for name, part in learner.state_dict()["network"].items()}


def assert_weights(one, other, **near):
    assert one.keys() == other.keys()
    for name in one:
        torch.testing.assert_close(one[name], other[name], msg=name, **near or {"rtol": 0, "atol": 0})


@pytest.mark.parametrize("spec", [SPEC, NUMBERS])
@pytest.mark.parametrize("separate", [False, True])
def test_with_nothing_old_it_learns_what_ppo_learns(spec, separate):
    network = replace(NETWORK, separate_networks=separate)
    here, there = plain(spec=spec, network=network), beside(spec=spec, network=network)
    batch = made_up(spec, learner=here)
    batch.active[2, 1] = False
    here.update(batch)
    there.update(batch)
    told = there.update(batch)  # hears of the first
    assert told["mean_weight"] == pytest.approx(1.0, abs=1e-6)
    assert_weights(weights_of(there), weights_of(here), rtol=1e-4, atol=1e-6)


def test_the_actor_goes_on_with_the_weights_of_before_while_the_learner_learns():
    learner, free = beside(), threading.Event()
    before, batch, update = weights_of(learner), made_up(SPEC, learner=plain()), learner.learner.update

    def held(rollout):
        assert free.wait(60)
        return update(rollout)

    learner.learner.update = held
    assert learner.update(batch) == {}  # it does not wait
    assert_weights(weights_of(learner), before)
    assert_weights(learner.inner.network.state_dict(), before)
    free.set()
    assert learner.update(batch)["minibatches"] > 0
    assert any(not torch.equal(part, before[name]) for name, part in weights_of(learner).items())
    assert_weights(learner.inner.network.state_dict(), weights_of(learner))


def test_what_older_weights_decided_counts_as_far_as_todays_would_have():
    """Half the log-probabilities are moved: decisions twice as likely today, and half as likely."""
    learner = plain(kind=CorrectedPpoLearner, ratio_cap=1.5)
    batch = made_up(SPEC, learner=plain())
    true = batch.columns[LOG_PROB].copy()
    batch.columns[LOG_PROB] = true + np.where(np.arange(6)[:, None] % 2, np.log(2.0), -np.log(2.0)).astype(np.float32)
    estimates = learner.compute_advantages(batch)
    log_prob, weights = estimates.log_prob, estimates.weights
    np.testing.assert_allclose(log_prob, true, rtol=1e-4, atol=1e-6)
    np.testing.assert_allclose(weights[0::2], 1.5)
    np.testing.assert_allclose(weights[1::2], 0.5, rtol=1e-4)
    assert learner.mean_weight == pytest.approx(1.0, rel=1e-4)
    whole, rows, _ = learner._prepare(batch)
    np.testing.assert_allclose(whole.weights.reshape(6, 4), weights)
    assert learner._taken(whole, rows[:3]).weights.shape == (3,)


@pytest.mark.parametrize(("rarer", "moves"), [(0.0, True), (200.0, False)])
def test_what_todays_policy_would_never_have_decided_teaches_nothing(rarer, moves):
    """Weights 0: the policy's loss is 0, and the critic's targets are what it says already."""
    learner = plain(kind=CorrectedPpoLearner, entropy_weight=0.0, epochs=1, batch_size=24)
    batch = made_up(SPEC, learner=learner)
    batch.columns[LOG_PROB] += rarer
    before = weights_of(learner)
    learner.update(batch)
    after = weights_of(learner)
    assert any(not torch.equal(after[name], before[name]) for name in before) == moves


def test_what_the_collector_writes_over_afterwards_does_not_matter():
    one, other = beside(), beside()
    for learner, spoilt in ((one, False), (other, True)):
        batch = made_up(SPEC, learner=plain())
        learner.update(batch)
        if spoilt:
            batch.reward[:] = 99.0
            batch.observations["state"][:] = 99.0
        learner.update(made_up(SPEC, learner=plain()))
    assert_weights(weights_of(one), weights_of(other))


def test_it_goes_on_exactly_with_the_rollout_that_was_under_way():
    one, batches = beside(), [made_up(SPEC, seed=seed, learner=plain()) for seed in range(4)]
    for place, batch in enumerate(batches[:2]):
        one.anneal(place / 4)
        one.update(batch)
    kept = {name: {key: part.clone() for key, part in group.items()} for name, group in one.state_dict().items()}
    other = beside(seed=8)
    other.load_state_dict(kept)
    for learner in (one, other):
        for batch in batches[2:]:
            learner.update(batch)
    assert_weights(weights_of(one), weights_of(other))
    for name, part in one.state_dict()["optimiser"].items():
        assert torch.equal(part, other.state_dict()["optimiser"][name]), name


def test_a_schedule_waits_for_the_rollout_it_is_meant_for():
    learner = beside(learning_rate_schedule="linear", learning_rate=1e-2)
    learner.anneal(0.5)
    assert learner.learner.learning_rate == 1e-2
    learner.update(made_up(SPEC, learner=plain()))
    learner.load_state_dict(learner.state_dict())  # waits for it, and begins it again
    assert learner.learner.learning_rate == pytest.approx(5e-3)


@pytest.mark.parametrize("done", [None, 0.25])
def test_whoever_goes_on_with_a_rollout_knows_how_much_lay_behind_it(done):
    """None: nobody said. A rate that falls to 0 in a straight line tells."""
    learner, other = (beside(learning_rate_schedule="linear", learning_rate=1e-2) for _ in range(2))
    if done is not None:
        learner.anneal(done)
    learner.update(made_up(SPEC, learner=plain()))
    state = learner.state_dict()
    other.load_state_dict(state)
    assert torch.equal(other.state_dict()["under_way"]["done"], state["under_way"]["done"])
    assert other.learner.learning_rate == pytest.approx(1e-2 * (1.0 - (done or 0.0)))


def test_a_loss_that_is_no_number_is_told_at_the_next_meeting():
    learner, batch = beside(), made_up(SPEC, learner=plain())
    batch.reward[0, 0] = np.nan
    learner.update(batch)
    with pytest.raises(DivergedError, match="Lower ppo.learning_rate"):
        learner.update(batch)


def test_imitation_beside_it_is_refused():
    with pytest.raises(SettingError, match=r"Use ppo with .*ppo.asynchronous=false, or leave it at 0"):
        ImitationWrapper(beside(), ImitationConfig(strength=1.0), None, seed=1)


def test_random_choices_fall_with_what_its_actor_decided():
    learner = beside(exploration="e-greedy")
    learner.act({"state": np.zeros((5, 5), np.float32)})
    assert counting(learner).explored == 5
    other = beside(exploration="e-greedy")
    other.load_state_dict(learner.state_dict())
    assert counting(other).explored == 5


def test_it_copies_the_number_it_sees():
    world = CopyTheNumber(16)
    config = PpoConfig(learning_rate=1e-2, batch_size=64, epochs=4, asynchronous=True)
    learner = AsynchronousPpo(partial(CorrectedPpoLearner, world.spec, NETWORK, config, 1))
    collector = Collector(world, learner, horizon=16, seed=1)
    for _ in range(17):
        learner.update(collector.collect())
    judged = summarise(play_episodes(GreedyPolicy(learner), CopyTheNumber(4), episodes_each=4, seed=2))
    assert judged.mean_reward == 8.0  # every number of an episode; guessing brings 2


def test_a_cap_that_caps_nothing_is_refused():
    for others, refused in ((PpoConfig(ratio_cap=1.5), True), (PpoConfig(ratio_cap=1.5, asynchronous=True), False)):
        settings = SimpleNamespace(ppo=others, network=NetworkConfig(), runtime=SimpleNamespace(device="cpu"))
        with pytest.raises(SettingError, match="ratio_cap is 1.5") if refused else nullcontext():
            PpoLearner.build(SPEC, settings, 1)
