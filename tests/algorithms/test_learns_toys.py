"""PPO by learning: worlds solved in seconds, with a threshold and a fixed seed."""

import statistics

import numpy as np
import pytest
from toy_world import CopyTheNumber, Walk

from racecraft.algorithms.networks import NetworkConfig
from racecraft.algorithms.ppo import PpoConfig, PpoLearner
from racecraft.players.trained import GreedyPolicy
from racecraft.rollout.collector import Collector
from racecraft.rollout.episodes import play_episodes
from racecraft.rollout.statistics import summarise


class Up:
    """Walks up, always."""

    def act(self, observations, action_mask=None):
        return np.full(len(observations["clock"]), 2)

    def reset_state(self, rows):
        pass


def trained(world, updates, **settings):
    config = PpoConfig(**({"learning_rate": 1e-2, "batch_size": 64, "epochs": 4} | settings))
    learner = PpoLearner(world.spec, NetworkConfig(hidden_units=(16,), activation="tanh"), config, seed=1)
    collector = Collector(world, learner, horizon=16, seed=1)
    for _ in range(updates):
        learner.update(collector.collect())
    return learner


def mean_reward(world, learner):
    return summarise(play_episodes(GreedyPolicy(learner), world, episodes_each=4, seed=2)).mean_reward


def test_it_copies_the_number_it_sees():
    learner = trained(CopyTheNumber(16), updates=15)
    assert mean_reward(CopyTheNumber(4), learner) == 8.0  # every number of an episode; guessing brings 2


@pytest.mark.parametrize("continuous", [False, True])
def test_it_walks_up(continuous):
    learner = trained(Walk(8, continuous=continuous), updates=25)
    best = summarise(play_episodes(Up(), Walk(4), episodes_each=4, seed=2)).mean_reward
    assert mean_reward(Walk(4, continuous=continuous), learner) >= 0.97 * best


def test_it_walks_up_as_the_aws_learner():
    config = PpoConfig(
        learning_rate=1e-2, batch_size=64, value_weight=1.0, value_loss="huber", max_grad_norm=None,
        standardise="rollout", drop_remainder=True, probability_floor=1e-8, adam_form="tensorflow",
    )  # fmt: skip
    network = NetworkConfig(
        hidden_units=(16,), activation="tanh", privileged_critic=False, separate_networks=True, initialisation="glorot"
    )
    best = summarise(play_episodes(Up(), Walk(4), episodes_each=4, seed=2)).mean_reward

    def learnt(seed):
        world = Walk(8)
        learner = PpoLearner(world.spec, network, config, seed)
        collector = Collector(world, learner, horizon=16, seed=seed)
        for _ in range(30):
            learner.update(collector.collect_episodes(2))
        return mean_reward(Walk(4), learner) / best

    # One seed is luck, and luck differs between processors.
    assert statistics.median(map(learnt, range(1, 6))) >= 0.95
