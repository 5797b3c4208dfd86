"""Stacks of observations: what a learner saw when it decided is what it learns from, and what its policy sees alone."""

import copy

import numpy as np
import pytest
import torch
from toy_world import Walk

from racecraft.algorithms.building import build_learner
from racecraft.algorithms.learner import REPLAY, ROLLOUT, Decision
from racecraft.algorithms.networks import NetworkConfig
from racecraft.algorithms.policy_spec import PolicySpec
from racecraft.algorithms.ppo import PpoConfig
from racecraft.algorithms.registry import find_algorithm
from racecraft.algorithms.stacking import FrameStack, StackedLearner, StackedPolicy, joined
from racecraft.contract.errors import SettingError
from racecraft.contract.world import ArraySpec
from racecraft.players.trained import GreedyPolicy, policy_from
from racecraft.rollout.collector import Collector
from racecraft.settings.composition import Settings
from racecraft.training.settings import RuntimeConfig


class Notes:
    """Walks at random and notes the stack it saw; keeps the rollouts it is to learn from."""

    eats, device = ROLLOUT, torch.device("cpu")

    def __init__(self, spec):
        self.spec, self.batches = spec, []
        self.columns = {"saw": spec.observations["square"], "clocks": spec.observations["clock"]}

    def act(self, observations, action_mask=None, *, generator=None, rows=None):
        count = len(observations["square"])
        actions = torch.randint(0, 3, (count,), generator=generator).numpy()
        return Decision(actions, {"saw": observations["square"], "clocks": observations["clock"]})

    def forget(self, rows):
        pass

    def update(self, batch):
        self.batches.append(copy.deepcopy(batch))  # columns are views that the next rollout writes over
        return {}

    def state_dict(self):
        return {}

    def load_state_dict(self, state):
        pass


def stacked(world, size=3):
    return StackedLearner(world.spec, size, Notes)


def test_what_is_learned_from_is_what_was_seen():
    world = Walk(5, num_agents=2)
    learner = stacked(world)
    collector = Collector(world, learner, horizon=7, seed=1)
    for _ in range(6):
        learner.update(collector.collect())
    for batch in learner.inner.batches:
        np.testing.assert_array_equal(batch.observations["square"], batch.columns["saw"])
        np.testing.assert_array_equal(batch.observations["clock"], batch.columns["clocks"])
    assert any(len(batch.final_index) for batch in learner.inner.batches)


def test_whole_episodes_are_stacked_as_they_were_seen():
    world = Walk(4)
    learner = stacked(world, 4)
    collector = Collector(world, learner, horizon=4, seed=1)
    for _ in range(2):
        learner.update(collector.collect_episodes(2))
    for batch in learner.inner.batches:
        np.testing.assert_array_equal(batch.observations["clock"], batch.columns["clocks"])


def test_a_stack_counts_up_by_hand_and_begins_anew():
    world = Walk(3)
    learner = stacked(world)
    learner.update(Collector(world, learner, horizon=30, seed=2).collect())
    (batch,) = learner.inner.batches
    clocks = batch.observations["clock"]  # ticks since the start: the stack of tick c is c-2, c-1, c, never below 0
    newest = clocks[..., -1:].astype(int)
    np.testing.assert_array_equal(clocks, np.maximum(newest + [-2, -1, 0], 0))
    ends = batch.final_observations["clock"]
    np.testing.assert_array_equal(ends, np.tile([10, 11, 12], (len(ends), 1)))
    assert len(ends)
    after = batch.last_observations["clock"].astype(int)
    np.testing.assert_array_equal(after, np.maximum(after[:, -1:] + [-2, -1, 0], 0))


def test_images_are_laid_along_their_channels():
    frames = np.arange(2 * 3 * 4 * 5).reshape(2, 3, 4, 5).astype(np.uint8)
    grey = joined(frames, ArraySpec((4, 5), np.uint8))
    assert grey.shape == (2, 4, 5, 3)
    np.testing.assert_array_equal(grey[:, :, :, 2], frames[:, 2])
    colour = np.stack([frames, frames + 1], axis=-1)  # two channels
    both = joined(colour, ArraySpec((4, 5, 2), np.uint8))
    np.testing.assert_array_equal(both[..., 4:], colour[:, 2])
    np.testing.assert_array_equal(both[..., :2], colour[:, 0])


def test_looking_without_keeping_changes_nothing():
    frames = FrameStack({"x": ArraySpec((1,), np.float32)}, 2)
    frames.push({"x": np.array([[1.0]], np.float32)})
    once, _ = frames.push({"x": np.array([[2.0]], np.float32)}, keep=False)
    again, _ = frames.push({"x": np.array([[3.0]], np.float32)})
    assert once["x"].tolist() == [[1.0, 2.0]]
    assert again["x"].tolist() == [[1.0, 3.0]]


def settings(**network):
    return Settings(
        network=NetworkConfig(hidden_units=(8,), **network), ppo=PpoConfig(batch_size=32), runtime=RuntimeConfig()
    )


def made(world, **network):
    return build_learner(find_algorithm("ppo"), world.spec, settings(**network), seed=1)


def test_a_stacked_run_goes_on_bit_by_bit():
    def turns(learner, collector, count):
        return [learner.update(collector.collect()) for _ in range(count)]

    whole = Walk(4)
    learner = made(whole, stack_size=3)
    collector = Collector(whole, learner, horizon=5, seed=1)
    turns(learner, collector, 2)
    kept, worlds = learner.state_dict(), collector.state()
    told = turns(learner, collector, 3)

    other = made(Walk(4), stack_size=3)
    again = Collector(Walk(4), other, horizon=5, seed=9)
    other.load_state_dict(kept)
    again.restore(worlds)
    assert turns(other, again, 3) == told


def test_the_policy_of_a_checkpoint_stacks_by_itself():
    world = Walk(4)
    learner = made(world, stack_size=3)
    spec = PolicySpec.from_dictionary(learner.policy_spec.as_dictionary())
    assert spec.stack_size == 3
    assert spec.observations["square"].shape == (9,)
    policy, greedy = policy_from(spec, learner.state_dict()["network"]), GreedyPolicy(learner)
    assert isinstance(policy, StackedPolicy)
    rng, odd = np.random.default_rng(1), np.array([True, False, True, False])
    for tick in range(6):
        seen = {"square": rng.random((4, 9), np.float32), "clock": rng.integers(0, 9, (4, 1)).astype(np.uint8)}
        np.testing.assert_array_equal(policy.act(seen), greedy.act(seen))
        if tick == 3:
            policy.forget(odd), greedy.forget(odd)


def test_a_learner_of_a_replay_is_refused():
    class Eater(Notes):
        eats = REPLAY

    with pytest.raises(SettingError, match="network.stack_size is 2"):
        StackedLearner(Walk(2).spec, 2, Eater)
