"""REINFORCE by hand, by its figures in NumPy, and by what it learns."""

import math

import numpy as np
import pytest
import torch
from toy_world import CopyTheNumber, Walk

from racecraft.algorithms import reinforce as page
from racecraft.algorithms.learner import DivergedError
from racecraft.algorithms.networks import NetworkConfig
from racecraft.algorithms.reinforce import FIGURES, ReinforceConfig, ReinforceLearner, reinforce_loss
from racecraft.algorithms.returns import episode_returns, explained_variance, rewards_to_go
from racecraft.players.trained import GreedyPolicy
from racecraft.rollout.collector import Collector
from racecraft.rollout.episodes import play_episodes
from racecraft.rollout.statistics import summarise

NETWORK = NetworkConfig(hidden_units=(16,), activation="tanh")


def learner_for(world, seed=1, **settings):
    return ReinforceLearner(world.spec, NETWORK, ReinforceConfig(**settings), seed)


def mean_reward(world, learner):
    return summarise(play_episodes(GreedyPolicy(learner), world, episodes_each=4, seed=2)).mean_reward


class TwoLogits(torch.nn.Module):
    """A policy of two choices whose logits are its only weights, and a value that is a weight, too."""

    log_std = None

    def __init__(self):
        super().__init__()
        self.logits = torch.nn.Parameter(torch.tensor([0.0, math.log(3.0)]))
        self.expected = torch.nn.Parameter(torch.tensor(1.0))

    def policy(self, observations):
        return self.logits.expand(len(observations["x"]), 2)

    def forward(self, observations):
        return self.policy(observations), self.expected.expand(len(observations["x"]))


def test_the_loss_is_what_a_pencil_says():
    world = CopyTheNumber(1, count=2)
    network, seen = TwoLogits(), {"x": torch.zeros(2, 1)}
    told = reinforce_loss(
        network, learner_for(world).distribution, seen, torch.tensor([0, 1]), torch.tensor([2.0, -1.0]),
        torch.tensor([3.0, 0.0]), None, ReinforceConfig(value_weight=0.5, entropy_weight=0.1),
    )  # fmt: skip
    # Probabilities 1/4 and 3/4; advantages 2 and -1; the critic says 1 where 3 and 0 came.
    policy = -(2.0 * math.log(0.25) - math.log(0.75)) / 2
    entropy = -(0.25 * math.log(0.25) + 0.75 * math.log(0.75))
    assert told[1].tolist() == pytest.approx([policy, 2.5, entropy], rel=1e-6)
    assert told[0].item() == pytest.approx(policy + 0.5 * 2.5 - 0.1 * entropy, rel=1e-6)


def test_what_follows_stops_at_an_end_and_goes_on_behind_a_cut():
    reward = np.array([[1.0], [2.0], [4.0], [8.0]], np.float32)
    terminated, truncated = np.zeros((4, 1), bool), np.zeros((4, 1), bool)
    terminated[1], truncated[3] = True, True
    following = np.full((4, 1), 100.0, np.float32)
    assert rewards_to_go(reward, terminated, truncated, 0.5).ravel().tolist() == [2.0, 2.0, 8.0, 8.0]
    assert rewards_to_go(reward, terminated, truncated, 0.5, following).ravel().tolist() == [2.0, 2.0, 33.0, 58.0]


def test_an_episode_beyond_the_quota_does_not_count():
    reward = np.array([[1, 1], [1, 2], [5, 4], [5, 8]], np.float32)
    ended = np.array([[0, 0], [1, 0], [1, 0], [1, 1]], bool)
    active = np.array([[1, 1], [1, 0], [0, 1], [0, 1]], bool)
    count, mean = episode_returns(reward, ended, active)
    assert count.tolist() == [1, 1]
    assert mean.tolist() == [2.0, 15.0]
    count, mean = episode_returns(reward[:1], ended[:1], active[:1])
    assert count.tolist() == [0, 0]
    assert np.isnan(mean).all()


def test_a_critic_is_taught_with_baseline_value_only():
    world = Walk(4)
    for baseline, moves in (("value", True), ("none", False)):
        learner = learner_for(world, baseline=baseline)
        before = learner.network.value_head.weight.detach().clone()
        learner.update(Collector(world, learner, 8, seed=1).collect_episodes(1))
        assert torch.equal(before, learner.network.value_head.weight) is not moves


@pytest.mark.parametrize("baseline", ["none", "mean", "value"])
def test_it_copies_the_number_it_sees(baseline):
    world = CopyTheNumber(8)
    learner = learner_for(world, baseline=baseline, learning_rate=3e-2, discount=0.5)
    collector = Collector(world, learner, 8, seed=1)
    for _ in range(40):
        learner.update(collector.collect_episodes(2))
    assert mean_reward(CopyTheNumber(4), learner) >= 7.5  # every number of an episode is 8; guessing brings 2


def test_it_walks_up_by_numbers():
    world = Walk(8, continuous=True)
    learner = learner_for(world, learning_rate=2e-2)
    collector = Collector(world, learner, 8, seed=1)
    before = mean_reward(Walk(4, continuous=True), learner)
    for _ in range(40):
        learner.update(collector.collect_episodes(2))
    assert mean_reward(Walk(4, continuous=True), learner) > 1.3 * before


def test_what_is_restored_goes_on_bit_for_bit():
    world, twin = Walk(4), Walk(4)
    learner, other = learner_for(world), learner_for(twin, seed=9)
    collector, second = Collector(world, learner, 8, seed=1), Collector(twin, other, 8, seed=1)
    learner.update(collector.collect_episodes(2))
    other.load_state_dict(learner.state_dict())
    second.restore(collector.state())
    for _ in range(2):
        assert learner.update(collector.collect_episodes(2)) == other.update(second.collect_episodes(2))
    assert all(
        torch.equal(one, two)
        for one, two in zip(learner.network.parameters(), other.network.parameters(), strict=False)
    )


def test_rewards_that_are_no_numbers_are_named():
    world = Walk(4)
    learner = learner_for(world)
    batch = Collector(world, learner, 8, seed=1).collect_episodes(1)
    batch.reward[0, 0] = np.nan
    with pytest.raises(DivergedError, match="learning_rate"):
        learner.update(batch)


def cut_episodes(world, learner, seed=4):
    """Return whole episodes, some of them cut by the clock."""
    batch = Collector(world, learner, 8, seed=seed).collect_episodes(2)
    assert len(batch.final_index)
    return batch


@pytest.mark.parametrize("scaled", [True, False])
@pytest.mark.parametrize("baseline", ["none", "mean", "value"])
def test_figures_of_an_update_are_those_of_numpy(baseline, scaled):
    world = Walk(5)
    learner = learner_for(world, baseline=baseline, scale_returns=scaled, discount=0.9, entropy_weight=0.1)
    batch = cut_episodes(world, learner)
    active = batch.active
    with torch.no_grad():
        seen = {name: torch.from_numpy(part) for name, part in batch.observations.items()}
        flat = {name: part.flatten(0, 1) for name, part in seen.items()}
        values = learner.network.value(flat).view(batch.shape).numpy()
        logits = torch.log_softmax(learner.network.policy(flat), dim=1).numpy()
        finals = learner.network.value(
            {name: torch.from_numpy(part) for name, part in batch.final_observations.items()}
        )
    following = np.zeros(batch.shape, np.float32)
    if baseline == "value":
        following.reshape(-1)[batch.final_index] = finals.numpy()
    returns = np.zeros(batch.shape)
    behind = np.zeros(5)
    for t in reversed(range(len(returns))):
        behind = np.where(batch.truncated[t], following[t], np.where(batch.terminated[t], 0.0, behind))
        behind = returns[t] = batch.reward[t] + 0.9 * behind
    found = returns[active]
    apart = found - {"none": 0.0, "mean": found.mean(), "value": values[active]}[baseline]
    if scaled:
        apart = apart / np.sqrt((apart**2).mean())
    chosen = np.take_along_axis(logits, batch.columns["raw_action"].reshape(-1, 1), axis=1).reshape(batch.shape)[active]
    told = learner.update(batch)
    assert list(told) == list(FIGURES)
    assert told["policy_loss"] == pytest.approx(-(apart * chosen).mean(), rel=1e-3, abs=1e-5)
    assert told["entropy"] == pytest.approx(-(np.exp(logits) * logits).sum(axis=1)[active.ravel()].mean(), rel=1e-4)
    assert told["transitions"] == active.sum() == len(found)
    ended = batch.terminated | batch.truncated
    count, mean = episode_returns(batch.reward, ended, active)
    assert told["whole_episodes"] == count.sum() == 10
    assert told["mean_return"] == pytest.approx((count * mean).sum() / 10, rel=1e-6)
    if baseline == "value":
        assert told["value_loss"] == pytest.approx(((values[active] - found) ** 2).mean(), rel=1e-3)
        assert told["explained_variance"] == pytest.approx(explained_variance(values[active], found), rel=1e-3)
    else:
        assert (told["value_loss"], told["explained_variance"]) == (0.0, 0.0)
    assert told["grad_norm"] > 0.0


@pytest.mark.parametrize("baseline", ["mean", "value"])
def test_a_gradient_taken_some_rows_at_a_time_is_that_of_all(monkeypatch, baseline):
    found = []
    for at_once in (4096, 7):
        monkeypatch.setattr(page, "ROWS_AT_ONCE", at_once)
        world = Walk(5, masked=True)
        learner = learner_for(world, baseline=baseline, max_grad_norm=None)
        told = learner.update(cut_episodes(world, learner))
        found.append((told, [None if one.grad is None else one.grad.clone() for one in learner.network.parameters()]))
    (one, mine), (other, its) = found
    assert other == pytest.approx(one, rel=1e-4, abs=1e-6)
    for gradient, same in zip(mine, its, strict=True):
        assert (gradient is None) == (same is None)
        assert gradient is None or torch.allclose(gradient, same, atol=1e-5)


def test_a_gradient_is_cut_where_it_is_asked_for():
    for limit in (None, 1e-3):
        world = Walk(5)
        learner = learner_for(world, max_grad_norm=limit)
        told = learner.update(cut_episodes(world, learner))
        kept = math.sqrt(sum(float(one.grad.square().sum()) for one in learner.network.parameters()))
        assert told["grad_norm"] > 1e-2
        assert kept == pytest.approx(told["grad_norm"] if limit is None else limit, rel=1e-3)


def test_with_nobody_active_nothing_is_learned():
    world = Walk(5)
    learner = learner_for(world, scale_returns=False)
    batch = cut_episodes(world, learner)
    batch.active[:] = False
    before = [part.detach().clone() for part in learner.network.parameters()]
    assert learner.update(batch) == dict.fromkeys(FIGURES, 0.0)
    assert all(torch.equal(old, new) for old, new in zip(before, learner.network.parameters(), strict=True))
