"""Stacks of observations: what a learner saw when it decided is what it learns from, and what its policy sees alone."""

import copy

import numpy as np
import pytest
import torch
from toy_world import LIMIT, Walk

from racecraft.algorithms.building import build_learner
from racecraft.algorithms.dqn import DqnConfig
from racecraft.algorithms.learner import ROLLOUT, Decision, greedy_policy_of
from racecraft.algorithms.networks import NetworkConfig
from racecraft.algorithms.policy_spec import PolicySpec
from racecraft.algorithms.ppo import PpoConfig
from racecraft.algorithms.registry import find_algorithm
from racecraft.algorithms.stacking import (
    AGE,
    FrameStack,
    StackedLearner,
    StackedPolicy,
    joined,
    stacked_specs,
)
from racecraft.contract.world import ArraySpec, DiscreteActions, WorldSpec
from racecraft.players.trained import GreedyPolicy, policy_from
from racecraft.rollout.collector import Collector
from racecraft.rollout.episodes import play_episodes
from racecraft.rollout.replay import Replay
from racecraft.rollout.replay_settings import ReplayConfig
from racecraft.rollout.statistics import summarise
from racecraft.rollout.transition_ring import COLUMN, NOBODY, TransitionRing
from racecraft.settings.composition import Settings
from racecraft.training.settings import RuntimeConfig


class Notes:
    """Walks at random and notes the stack it saw; keeps the rollouts it is to learn from."""

    experience, device = ROLLOUT, torch.device("cpu")

    def __init__(self, spec):
        self.spec, self.batches = spec, []
        self.columns = {"saw": spec.observations["square"], "clocks": spec.observations["clock"]}

    def act(self, observations, action_mask=None, *, generator=None, rows=None):
        count = len(observations["square"])
        actions = torch.randint(0, 3, (count,), generator=generator).numpy()
        return Decision(actions, {"saw": observations["square"], "clocks": observations["clock"]})

    def reset_state(self, rows):
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
            policy.reset_state(odd), greedy.reset_state(odd)


def test_what_is_drawn_from_a_replay_is_what_was_seen():
    """In every place of a ring that has gone round, but for what it has forgotten; afterwards, and at the last."""
    world, size = Walk(5, num_agents=2), 3
    learner = stacked(world, size)
    collector = Collector(world, learner, horizon=7, seed=1)
    ring = TransitionRing(world.spec, 20, learner.columns, size)
    for _ in range(6):
        ring.put(collector.collect())
    saw, stale, finals = ring.flat(COLUMN + "clocks"), 0, 0
    for tick in range(ring.oldest, ring.head - 2):
        index = ring.places(tick, tick + 1)
        for n_step in (1, 2):
            drawn = ring.gather(index, n_step, 0.9)
            _, _, then, cut = ring.look_ahead(index, n_step, 0.9)
            reach = ring.flat(COLUMN + AGE)[index] <= tick - ring.oldest
            np.testing.assert_array_equal(drawn.observations["clock"][reach], saw[index][reach])
            if not reach.all():  # the oldest that is remembered stands in for what is not
                oldest = saw[index][~reach, -1 - (tick - ring.oldest)]
                np.testing.assert_array_equal(drawn.observations["clock"][~reach, 0], oldest)
            goes_on = (cut == NOBODY) & (drawn.discount > 0) & reach
            np.testing.assert_array_equal(drawn.next_observations["clock"][goes_on], saw[then][goes_on])
            last = drawn.next_observations["clock"][(cut != NOBODY) & reach]
            np.testing.assert_array_equal(last, np.tile([LIMIT - 2, LIMIT - 1, LIMIT], (len(last), 1)))
            stale, finals = stale + (~reach).sum(), finals + len(last)
    assert stale
    assert finals


class Recall:
    """Shows a number from 0 to 2 and wants the one shown a tick before; an episode is cut after eight ticks."""

    def __init__(self, num_worlds):
        seen = {"number": ArraySpec((3,), np.float32, 0, 1, doc="one-hot")}
        self.spec = WorldSpec("recall", num_worlds, 1, seen, DiscreteActions(3))
        self.rng = np.random.default_rng(1)

    def reset(self, buffers, seed):
        self.clock = 0
        self.before = self.shown = self.rng.integers(0, 3, (self.spec.num_worlds, 1))
        buffers.observations["number"][:], buffers.active[:] = np.eye(3)[self.shown], True

    def step(self, actions, buffers):
        buffers.reward[:] = actions == self.before
        self.before, self.shown = self.shown, self.rng.integers(0, 3, self.shown.shape)
        self.clock += 1
        buffers.truncated[:] = self.clock == 8
        if self.clock == 8:
            buffers.final_observations["number"][:] = np.eye(3)[self.shown]
            self.clock, self.before = 0, self.shown
        buffers.observations["number"][:] = np.eye(3)[self.shown]

    def close(self):
        pass


@pytest.mark.parametrize(("size", "right"), [(1, False), (2, True)])
def test_dqn_recalls_what_only_a_stack_shows(size, right):
    world = Recall(8)
    groups = settings(stack_size=size).with_group("dqn", DqnConfig(discount=0.0, learning_rate=3e-3, batch_size=64))
    learner = build_learner(find_algorithm("dqn"), world.spec, groups, seed=1)
    replay = Replay(world.spec, ReplayConfig(capacity=4096, learning_starts=64), 0.0, 1, learner.columns, size)
    collector = Collector(world, learner, horizon=32, seed=1)
    for _ in range(12):
        if (fed := replay.add(collector.collect())) is not None:
            learner.update(fed)
    policy = greedy_policy_of(learner)
    reward = summarise(play_episodes(policy, Recall(8), episodes_each=4, seed=2)).mean_reward
    assert (reward > 7.5) == right, reward


VECTOR = {"x": ArraySpec((2,), np.float32), "secret": ArraySpec((1,), np.float32, privileged=True)}


def shown(*numbers):
    return {"x": np.array([[one, -one] for one in numbers], np.float32)}


def test_a_past_is_kept_for_each_row_and_its_age_counted_up_to_its_size():
    frames = FrameStack(VECTOR, 3)
    stacks, age = frames.push(shown(1, 2))
    assert (stacks["x"].tolist(), age.tolist()) == ([[1, -1, 1, -1, 1, -1], [2, -2, 2, -2, 2, -2]], [0, 0])
    assert "secret" not in stacks
    assert age.dtype == np.int16
    for number in (3, 4, 5):  # row 1 alone, then a row that is new
        stacks, age = frames.push(shown(number), np.array([1]))
    assert (stacks["x"].tolist(), age.tolist()) == ([[3, -3, 4, -4, 5, -5]], [2])
    stacks, age = frames.push(shown(7, 6), np.array([3, 0]))
    assert (stacks["x"].tolist(), age.tolist()) == ([[7, -7] * 3, [1, -1, 1, -1, 6, -6]], [0, 1])
    assert frames.age.tolist() == [2, 2, 0, 1]
    frames.reset_state(np.array([True, False]))
    assert frames.age.tolist() == [0, 2, 0, 1]
    stacks, age = frames.push(shown(8, 9))
    assert (stacks["x"].tolist(), age.tolist()) == ([[8, -8] * 3, [4, -4, 5, -5, 9, -9]], [0, 2])


def test_a_learner_hands_on_what_has_nothing_to_do_with_stacks():
    class Told(Notes):
        figures, discount, n_step = {"loss": "of something"}, 0.9, 3

        def __init__(self, spec):
            super().__init__(spec)
            self.annealed, self.forgotten = [], []

        def anneal(self, done):
            self.annealed.append(done)

        def reset_state(self, rows):
            self.forgotten.append(rows.tolist())

    learner = StackedLearner(Walk(2).spec, 3, Told)
    learner.anneal(0.25)
    learner.reset_state(np.array([True, False]))
    assert (learner.inner.annealed, learner.inner.forgotten) == ([0.25], [[True, False]])
    assert (learner.figures, learner.discount, learner.n_step) == ({"loss": "of something"}, 0.9, 3)
    note = learner.columns[AGE]
    assert (note.shape, note.dtype, note.low, note.high) == ((), np.int16, 0, 2)
    StackedLearner(Walk(2).spec, 3, Notes).anneal(0.5)  # who follows no schedule is not asked


@pytest.mark.parametrize(
    ("shape", "dtype", "stacked"),
    [
        ((4, 5), np.uint8, (4, 5, 3)),
        ((4, 5, 2), np.float32, (4, 5, 6)),
        ((4, 5), np.float32, (60,)),
        ((), np.float32, (3,)),
    ],
)
def test_pictures_grow_in_channels_and_everything_else_in_length(shape, dtype, stacked):
    part = ArraySpec(shape, dtype)
    assert stacked_specs({"x": part}, 3)["x"].shape == stacked
    assert joined(np.zeros((2, 3, *shape), dtype), part).shape == (2, *stacked)
    hidden = ArraySpec(shape, dtype, privileged=True)
    assert stacked_specs({"x": hidden}, 3) == {"x": hidden}
