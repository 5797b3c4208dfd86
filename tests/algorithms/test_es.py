"""Evolution strategies by hand, by twins (one network after the other; a plain loop), and by what they learn."""

import numpy as np
import pytest
import torch
from toy_world import CopyTheNumber, Walk

from racecraft.algorithms.es import EsConfig, EsLearner, centred_ranks
from racecraft.algorithms.learner import DivergedError, Learner
from racecraft.algorithms.networks import ActorCritic, Architecture, NetworkConfig
from racecraft.algorithms.population import PolicyAlone, Population
from racecraft.algorithms.rollout_batch import RolloutBatch
from racecraft.contract.errors import SettingError
from racecraft.contract.world import ArraySpec, DiscreteActions
from racecraft.players.trained import GreedyPolicy
from racecraft.rollout.collector import Collector
from racecraft.rollout.episodes import play_episodes
from racecraft.rollout.statistics import summarise

NETWORK = NetworkConfig(hidden_units=(16,), activation="tanh")


def learner_for(world, seed=1, **settings):
    return EsLearner(world.spec, NETWORK, EsConfig(**settings), seed)


def flat(learner):
    return torch.nn.utils.parameters_to_vector(learner.parameters).detach().clone()


VECTORS = {"b": ArraySpec((3,), np.float32), "a": ArraySpec((2, 2), np.uint8)}
IMAGE = {"eye": ArraySpec((12, 16), np.uint8), "speed": ArraySpec((1,), np.float32)}
CASES = [
    (VECTORS, Architecture(trunk_units=(8, 8), vector_units=(5,))),
    (VECTORS, Architecture(trunk_units=())),
    (IMAGE, Architecture(convolutions=((4, 5, 2), (6, 3, 1)), trunk_units=(8,))),
]


@pytest.mark.parametrize(("observations", "architecture"), CASES, ids=["dense", "linear", "image"])
def test_asked_at_once_they_say_what_each_says_alone(observations, architecture):
    if observations is VECTORS:
        observations = {"b": ArraySpec((3,), np.float32), "a": ArraySpec((4,), np.float32)}
    chance = torch.Generator().manual_seed(3)
    network = ActorCritic(observations, DiscreteActions(3), architecture, chance)
    population, alone = Population(network, 5), PolicyAlone(network)
    size = sum(one.numel() for one in alone.parameters())
    weights = torch.randn(5, size, generator=chance)
    for member in range(5):
        population.put(member, weights[member])
    seen = {
        name: (torch.rand(5, *part.shape, generator=chance) * 200).to(
            torch.uint8 if part.dtype == np.uint8 else torch.float32
        )
        for name, part in observations.items()
    }
    wanted = []
    for member in range(5):
        torch.nn.utils.vector_to_parameters(weights[member], alone.parameters())
        wanted.append(alone({name: part[member : member + 1] for name, part in seen.items()})[0])
    wanted = torch.stack(wanted).detach()
    scale = wanted.abs().max()
    assert torch.allclose(population.params(seen) / scale, wanted / scale, atol=1e-5)
    some = np.array([1, 4])
    told = population.params({name: part[some] for name, part in seen.items()}, some)
    assert torch.allclose(told / scale, wanted[some] / scale, atol=1e-5)


def test_ranks_are_centred_and_equals_share_the_middle():
    assert centred_ranks(np.array([5.0, 1.0, 5.0, 9.0])).tolist() == pytest.approx([0.0, -0.5, 0.0, 0.5])
    assert centred_ranks(np.array([1.0, 1e9])).tolist() == [-0.5, 0.5]
    assert centred_ranks(np.array([3.0])).tolist() == [0.0]


def test_members_of_a_pair_lie_opposite_each_other_and_the_odd_one_is_the_mean():
    learner = learner_for(Walk(5), noise=0.3)
    seen = {"square": np.eye(9, dtype=np.float32)[:5], "clock": np.zeros((5, 1), np.uint8)}
    learner.act(seen)
    weights = learner._population._weights["policy_head.weight"]
    mean = learner.network.policy_head.weight.T
    assert torch.allclose(weights[0] + weights[1], 2 * mean, atol=1e-6)
    assert torch.equal(weights[4], mean)
    spread = torch.cat([learner.noise(pair) for pair in range(2)])
    assert abs(float(spread.mean())) < 0.15
    assert abs(float(spread.std()) - 1.0) < 0.1
    assert torch.equal(learner.noise(1), learner.noise(1))
    assert not torch.equal(learner.noise(0), learner.noise(1))


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


def test_adam_takes_the_first_step_as_long_as_its_learning_rate():
    world = Walk(4)
    learner = learner_for(world, learning_rate=0.02)
    theta = flat(learner)
    batch = Collector(world, learner, 8, seed=3).collect_episodes(1)
    batch.reward[:] = np.array([1.0, 3.0, 2.0, -7.0])
    learner.update(batch)
    moved = (flat(learner) - theta).abs()
    assert torch.allclose(moved[moved > 1e-4], torch.tensor(0.02), atol=1e-4)


def test_equal_members_teach_nothing():
    world = Walk(4)
    learner = learner_for(world)
    theta = flat(learner)
    batch = Collector(world, learner, 8, seed=3).collect_episodes(1)
    batch.reward[:] = 0.0
    assert learner.update(batch)["grad_norm"] == 0.0
    assert torch.equal(flat(learner), theta)


def test_a_pair_without_an_episode_is_left_out():
    world = Walk(4)
    learner = learner_for(world)
    batch = Collector(world, learner, 8, seed=3).collect_episodes(1)
    batch.active[:, 1] = False
    assert learner.update(batch)["pairs"] == 1


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


def test_it_is_a_learner():
    assert isinstance(learner_for(CopyTheNumber(2)), Learner)


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


def test_where_nobody_ended_an_episode_all_figures_but_the_weights_are_nought():
    learner = learner_for(Walk(4), optimiser="sgd")
    theta = flat(learner)
    told = learner.update(played(np.ones((3, 4)), np.zeros((3, 4))))
    assert told == {**dict.fromkeys(told, 0.0), "weight_norm": pytest.approx(theta.norm().item())}
    assert torch.equal(flat(learner), theta)


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


def test_members_are_given_their_weights_once_a_generation():
    learner, asked = learner_for(Walk(5)), []
    seen = {"square": np.eye(9, dtype=np.float32)[:5], "clock": np.zeros((5, 1), np.uint8)}
    noise = learner.noise
    learner.noise = lambda pair: asked.append(pair) or noise(pair)
    for _ in range(3):
        learner.act(seen)
    assert asked == [0, 1], "a large population's noise is not drawn at every tick"
