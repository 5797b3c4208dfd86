"""Evolution strategies by hand, by a twin that is a plain loop, and by what they learn."""

import numpy as np
import pytest
import torch
from toy_world import Walk

from racecraft.algorithms.es import EsConfig, EsLearner, centred_ranks
from racecraft.algorithms.learner import DivergedError
from racecraft.algorithms.networks import NetworkConfig
from racecraft.algorithms.rollout_batch import RolloutBatch
from racecraft.contract.errors import SettingError
from racecraft.players.trained import GreedyPolicy
from racecraft.rollout.collector import Collector
from racecraft.rollout.episodes import play_episodes
from racecraft.rollout.statistics import summarise

NETWORK = NetworkConfig(hidden_units=(16,), activation="tanh")


def learner_for(world, seed=1, **settings):
    return EsLearner(world.spec, NETWORK, EsConfig(**settings), seed)


def flat(learner):
    return torch.nn.utils.parameters_to_vector(learner.parameters).detach().clone()


def test_ranks_are_centred_and_equals_share_the_middle():
    assert centred_ranks(np.array([5.0, 1.0, 5.0, 9.0])).tolist() == pytest.approx([0.0, -0.5, 0.0, 0.5])
    assert centred_ranks(np.array([1.0, 1e9])).tolist() == [-0.5, 0.5]
    assert centred_ranks(np.array([3.0])).tolist() == [0.0]


def test_a_step_is_that_of_a_plain_loop():
    world = Walk(4)
    learner = learner_for(world, noise=0.2, optimiser="sgd", learning_rate=0.5, weight_decay=0.01)
    theta, noises = flat(learner), [learner.noise(0), learner.noise(1)]
    batch = Collector(world, learner, 8, seed=3).collect_episodes(2)
    batch.reward[:] = np.array([1.0, 3.0, 2.0, -7.0])  # ticks tell the members apart; lengths do not reorder them
    ended = batch.terminated | batch.truncated
    returns = []
    for r in range(4):
        ends = np.flatnonzero(ended[:, r])[:2]
        returns.append(batch.reward[: ends[-1] + 1, r].sum() / 2)
    places = np.argsort(np.argsort(returns)) / 3 - 0.5
    gradient = torch.zeros_like(theta)
    for member in range(4):
        sign = 1 if member % 2 == 0 else -1
        gradient += float(places[member]) * sign * noises[member // 2] / (4 * 0.2)
    figures = learner.update(batch)
    assert torch.allclose(flat(learner), theta + 0.5 * (gradient - 0.01 * theta), atol=1e-6)
    assert figures["mean_return"] == pytest.approx(np.mean(returns))
    assert figures["grad_norm"] == pytest.approx(float(gradient.norm()), rel=1e-5)


def test_equal_members_teach_nothing():
    world = Walk(4)
    learner = learner_for(world)
    theta = flat(learner)
    batch = Collector(world, learner, 8, seed=3).collect_episodes(1)
    batch.reward[:] = 0.0
    assert learner.update(batch)["grad_norm"] == 0.0
    assert torch.equal(flat(learner), theta)


@pytest.mark.parametrize("continuous", [False, True])
def test_it_walks_up(continuous):
    world = Walk(16, continuous=continuous)
    learner = learner_for(world, learning_rate=0.05, noise=0.2)
    collector = Collector(world, learner, 8, seed=1)
    for _ in range(30):
        learner.update(collector.collect_episodes(4))
    greedy = summarise(play_episodes(GreedyPolicy(learner), Walk(4, continuous=continuous), episodes_each=4, seed=2))
    assert greedy.mean_reward > 75.0  # up, always: about 83; standing still: 48


def test_what_is_restored_goes_on_bit_for_bit():
    world, twin = Walk(4), Walk(4)
    learner, other = learner_for(world), learner_for(twin)
    collector, second = Collector(world, learner, 8, seed=1), Collector(twin, other, 8, seed=1)
    learner.update(collector.collect_episodes(2))
    other.load_state_dict(learner.state_dict())
    second.restore(collector.state())
    for _ in range(2):
        assert learner.update(collector.collect_episodes(2)) == other.update(second.collect_episodes(2))
    assert torch.equal(flat(learner), flat(other))


def test_one_row_is_no_population():
    with pytest.raises(SettingError, match=r"rollout\.num_worlds"):
        learner_for(Walk(1))


def test_a_return_that_is_no_number_is_named():
    world = Walk(4)
    learner = learner_for(world)
    batch = Collector(world, learner, 8, seed=1).collect_episodes(1)
    batch.reward[0, 0] = np.inf
    with pytest.raises(DivergedError, match="generation 0"):
        learner.update(batch)


def played(rewards, ended, active=None):
    """Return a rollout of ticks and rows that was paid so and ended there."""
    rewards, ended = np.float32(rewards), np.array(ended, bool)
    active = np.ones_like(ended) if active is None else np.array(active, bool)
    rows = rewards.shape[1]
    seen = {"square": np.zeros((*rewards.shape, 9), np.float32), "clock": np.zeros((*rewards.shape, 1), np.uint8)}
    last = {name: array[0] for name, array in seen.items()}
    return RolloutBatch(
        seen, np.zeros(rewards.shape, np.int64), rewards, ended, ended & False, active, last, np.ones(rows, bool)
    )


def test_what_it_tells_is_what_a_pencil_says():
    """Members 0 and 1 played two episodes each, 2 one, 3 and the odd one none; their means are 3, 5 and 10.

    Of two members the better has rank 1/2 and the worse -1/2, so that the gradient is -noise / (2 sigma).
    """
    learner = learner_for(Walk(5), noise=0.25, optimiser="sgd", learning_rate=1e-3, weight_decay=0.5)
    theta, noise = flat(learner), learner.noise(0)
    told = learner.update(
        played(
            [[1.0, 4.0, 0.0, 7.0, 7.0], [2.0, 6.0, 0.0, 7.0, 7.0], [3.0, 0.0, 10.0, 7.0, 7.0]],
            [[0, 1, 0, 0, 0], [1, 1, 0, 0, 0], [1, 0, 1, 0, 0]],
        )
    )
    expected = {
        "mean_return": 6.0, "best_return": 10.0, "return_spread": (26 / 3) ** 0.5,
        "grad_norm": noise.norm().item() / (2 * 0.25),
    }  # fmt: skip
    moved = theta + 1e-3 * (-noise / (2 * 0.25) - 0.5 * theta)
    expected |= {"weight_norm": moved.norm().item(), "pairs": 1, "whole_episodes": 5}
    assert list(told) == list(expected)
    assert told == pytest.approx(expected, rel=1e-5)
    torch.testing.assert_close(flat(learner), moved)


def test_noise_hangs_on_the_generation_and_on_nothing_else():
    learner, larger = learner_for(Walk(4)), learner_for(Walk(8))
    first = learner.noise(1)
    assert torch.equal(first, larger.noise(1)), "on no number of members"
    assert not torch.equal(first, learner_for(Walk(4), seed=2).noise(1))
    learner.update(played(np.ones((1, 4)), np.ones((1, 4))))
    assert learner.generation == 1
    assert not torch.equal(first, learner.noise(1))


def test_after_a_step_and_after_a_state_members_decide_by_the_new_weights():
    world = Walk(4, continuous=True)
    seen = {"square": np.eye(9, dtype=np.float32)[:4], "clock": np.zeros((4, 1), np.uint8)}
    learner, other = learner_for(world), learner_for(world, seed=2)
    before = learner.act(seen).actions
    assert np.array_equal(before, learner.act(seen).actions)
    kept = learner.state_dict()
    learner.update(played(np.arange(4.0)[None], np.ones((1, 4))))
    assert not np.array_equal(learner.act(seen).actions, before)
    learner.load_state_dict(kept)
    assert np.array_equal(learner.act(seen).actions, before)
    other.act(seen)
    other.load_state_dict({"network": kept["network"]})
    assert other.generation == 0
    np.testing.assert_array_equal(other.choose(seen), learner.choose(seen))


def test_each_row_is_its_own_member_and_a_pair_lies_on_both_sides_of_the_mean():
    """Numbers are near to linear in weights that hardly move: two of a pair decide on either side of the mean."""
    learner = learner_for(Walk(4, continuous=True), noise=1e-3)
    same = {"square": np.eye(9, dtype=np.float32)[[3] * 4], "clock": np.zeros((4, 1), np.uint8)}
    told, mean = learner.act(same).actions[:, 0], learner.choose(same)[:, 0]
    assert len(set(told.tolist())) == 4
    np.testing.assert_allclose((told[::2] + told[1::2]) / 2, mean[::2], atol=1e-5)
    some = {name: part[:2] for name, part in same.items()}
    alone = learner.act(some, rows=np.array([1, 3])).actions[:, 0]
    np.testing.assert_allclose(alone, told[[1, 3]], atol=1e-7)


def test_what_is_forbidden_no_member_does():
    learner = learner_for(Walk(4, masked=True), noise=5.0)
    seen = {"square": np.eye(9, dtype=np.float32)[:4], "clock": np.zeros((4, 1), np.uint8)}
    mask = np.zeros((4, 3), bool)
    mask[[0, 1, 2, 3], [2, 0, 1, 2]] = True
    assert learner.act(seen, mask).actions.tolist() == [2, 0, 1, 2]
    assert learner.choose(seen, mask).tolist() == [2, 0, 1, 2]
