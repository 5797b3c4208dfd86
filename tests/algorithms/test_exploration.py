"""Reward for what is new: bonuses by hand and by law, and a corridor that chance alone does not walk to its end."""

import numpy as np
import pytest
import torch
from toy_world import Walk

from racecraft.algorithms.building import build_learner, signal_groups
from racecraft.algorithms.curiosity import CuriosityConfig, CuriosityModel
from racecraft.algorithms.intrinsic import IntrinsicReward, ReturnScale, RunningMoments, transitions
from racecraft.algorithms.learner import REPLAY
from racecraft.algorithms.networks import Architecture, NetworkConfig
from racecraft.algorithms.ppo import PpoConfig
from racecraft.algorithms.registry import find_algorithm
from racecraft.algorithms.rnd import RndConfig, RndModel
from racecraft.contract.errors import SettingError
from racecraft.contract.world import (
    ArraySpec,
    DiscreteActions,
    WorldSpec,
)
from racecraft.rollout.collector import Collector
from racecraft.settings.composition import Settings
from racecraft.training.settings import RuntimeConfig

SEEN = {"x": ArraySpec((4,), np.float32), "true": ArraySpec((1,), np.float32, privileged=True)}
SMALL = Architecture(trunk_units=(8,))


class Corridor:
    """Squares in a row, two doors each: one leads on, the other a square back. Only the last square brings 1.

    Which door leads on differs from square to square, so that going on by habit leads nowhere. Cut after two lengths.
    """

    def __init__(self, num_worlds, length=32):
        seen = {"square": ArraySpec((length,), np.float32, 0, 1, doc="one-hot")}
        self.spec = WorldSpec("corridor", num_worlds, 1, seen, DiscreteActions(2))
        self.length, self.found = length, 0
        self.door = np.random.default_rng(7).integers(0, 2, length)

    def reset(self, buffers, seed):
        self.at, self.clock = (np.zeros((self.spec.num_worlds, 1), np.int64) for _ in range(2))
        self._show(buffers.observations)
        buffers.active[:] = True

    def step(self, actions, buffers):
        self.at = np.clip(self.at + np.where(actions == self.door[self.at], 1, -1), 0, self.length - 1)
        self.clock = self.clock + 1
        there = self.at == self.length - 1
        self.found += int(there.sum())
        buffers.reward[:], buffers.terminated[:] = there, there
        buffers.truncated[:] = (self.clock == 2 * self.length) & ~there
        if buffers.ended.any():
            self._show(buffers.final_observations)
            self.at[buffers.ended], self.clock[buffers.ended] = 0, 0
        self._show(buffers.observations)

    def close(self):
        pass

    def _show(self, named):
        named["square"][:] = np.eye(self.length, dtype=np.float32)[self.at]


def settings(**signals):
    groups = signal_groups() | signals
    return Settings(
        network=NetworkConfig(hidden_units=(32,), activation="tanh"),
        ppo=PpoConfig(learning_rate=3e-3, discount=0.99, batch_size=128, entropy_weight=0.01),
        runtime=RuntimeConfig(), **groups,
    )  # fmt: skip


def learner_for(world, seed=1, **signals):
    return build_learner(find_algorithm("ppo"), world.spec, settings(**signals), seed)


def goals(seed, updates, length=32, **signals):
    """Return how many episodes of the last ten updates ended at the end of the corridor."""
    world = Corridor(8, length)
    learner = learner_for(world, seed, **signals)
    collector = Collector(world, learner, horizon=64, seed=seed)
    for left in range(updates, 0, -1):
        if left == 10:
            world.found = 0
        learner.update(collector.collect())
    return world.found


@pytest.mark.parametrize(
    "signals",
    [
        {"curiosity": CuriosityConfig(strength=0.1, learning_rate=1e-3)},
        {"rnd": RndConfig(strength=0.1, learning_rate=1e-3)},
    ],
)
@pytest.mark.long
def test_what_is_new_leads_to_the_end_of_the_corridor(signals):
    assert goals(1, 60, **signals) >= 60  # of the 80 to 160 that 5,120 ticks have room for


@pytest.mark.long
def test_chance_alone_does_not_find_it():
    assert goals(1, 60) == 0


def test_without_strength_nothing_is_laid_round():
    assert not isinstance(learner_for(Walk(2)), IntrinsicReward)
    both = learner_for(Walk(2), curiosity=CuriosityConfig(strength=1), rnd=RndConfig(strength=1))
    assert [both.model.name, both.inner.model.name] == ["rnd", "curiosity"]


class Fixed:
    """Learns nothing and keeps what it is rewarded with; its bonus is what is seen afterwards."""

    experience, device, columns = "rollout", torch.device("cpu"), {}

    def __init__(self, spec):
        self.spec = spec

    def act(self, observations, action_mask=None, *, generator=None, rows=None):
        from racecraft.algorithms.learner import Decision

        return Decision(torch.randint(0, 3, (len(observations["clock"]),), generator=generator).numpy(), {})

    def reset_state(self, rows):
        pass

    def update(self, batch):
        self.reward = batch.reward
        return {}


class ClockModel:
    """Finds late clocks new."""

    name, strength, is_novelty, figures = "clock", 0.5, True, {}

    def bonus(self, before, actions, after):
        self.pairs = before["clock"][:, 0], after["clock"][:, 0]
        return after["clock"][:, 0].astype(np.float32)

    def learn(self, before, actions, after):
        return {}


def test_the_bonus_is_added_tick_by_tick_in_its_own_deviations():
    world = Walk(6)
    learner = IntrinsicReward(Fixed(world.spec), ClockModel())
    batch = Collector(world, learner, horizon=20, seed=1).collect()
    batch.active[4, 3] = False
    plain, clock = batch.reward.copy(), batch.observations["clock"][..., 0].astype(np.float32)
    told = learner.update(batch)
    raw = np.where(batch.active & ~batch.terminated, clock + 1, 0.0)
    sums, ticks = np.zeros(raw.shape), np.zeros(6)
    for tick, row in enumerate(raw):
        ticks = sums[tick] = 0.99 * ticks + row
    np.testing.assert_allclose(learner.inner.reward, plain + 0.5 * raw / sums.std(), rtol=1e-5)
    np.testing.assert_array_equal(batch.reward, plain)
    assert told["clock_reward"] == pytest.approx((0.5 * raw / sums.std())[batch.active].mean(), rel=1e-5)


def test_what_follows_a_cut_is_the_final_observation_and_not_the_next_start():
    world = Walk(6)
    batch = Collector(world, Fixed(world.spec), horizon=30, seed=1).collect()
    assert len(batch.final_index)
    chosen = np.flatnonzero(~batch.terminated.reshape(-1))
    before, _, after = transitions(batch, chosen)
    np.testing.assert_array_equal(after["clock"], before["clock"] + 1)
    assert batch.terminated.any()


@pytest.mark.parametrize("kind", ["rnd", "curiosity"])
def test_what_is_seen_again_and_again_grows_old(kind):
    actions = np.zeros(64, np.int64)
    model = model_of(kind, learning_rate=1e-2)
    rng = np.random.default_rng(0)
    often = {"x": rng.normal(size=(64, 4)).astype(np.float32)}
    then = {"x": rng.normal(size=(64, 4)).astype(np.float32)}
    first = model.bonus(often, actions, then).mean()
    for _ in range(100):
        model.learn(often, actions, then)
    assert model.bonus(often, actions, then).mean() < 0.3 * first
    new = {"x": then["x"] + 3}
    assert model.bonus(often, actions, new).mean() > 2 * model.bonus(often, actions, then).mean()


def model_of(kind, **values):
    if kind == "rnd":
        return RndModel(SEEN, SMALL, RndConfig(strength=1, **values), 1, "cpu")
    return CuriosityModel(SEEN, DiscreteActions(3), SMALL, CuriosityConfig(strength=1, **values), 1, "cpu")


def test_moments_of_lots_are_those_of_the_whole():
    rows = np.random.default_rng(0).normal(3, 2, (90, 4))
    moments = RunningMoments((4,))
    for lot in np.split(rows, [7, 40]):
        moments.add(lot)
    np.testing.assert_allclose(moments.mean, rows.mean(axis=0))
    np.testing.assert_allclose(moments.variance, rows.var(axis=0))
    assert ReturnScale(0.9).measured(np.zeros((3, 2))) > 0


@pytest.mark.parametrize("name", ["rnd", "curiosity"])
def test_an_intrinsic_run_goes_on_bit_by_bit(name):
    signals = {name: type(signal_groups()[name])(strength=0.5)}

    def turns(learner, collector, count):
        return [learner.update(collector.collect()) for _ in range(count)]

    learner = learner_for(Walk(4), **signals)
    collector = Collector(Walk(4), learner, horizon=8, seed=1)
    turns(learner, collector, 2)
    kept, worlds = learner.state_dict(), collector.state()
    told = turns(learner, collector, 3)
    other = learner_for(Walk(4), seed=5, **signals)
    again = Collector(Walk(4), other, horizon=8, seed=9)
    other.load_state_dict(kept)
    again.restore(worlds)
    assert turns(other, again, 3) == told
    assert told[0][f"{name}_reward"] > 0


class Likeness(ClockModel):
    """Pays for what is like what was shown: nothing is measured, and the end of a story earns, too."""

    name, is_novelty, strength, figures = "gail", False, 0.5, {"gail_loss": "of something"}
    learned = None

    def learn(self, before, actions, after):
        self.learned = len(actions)
        return {"gail_loss": 0.25}


def test_a_bonus_for_likeness_is_added_as_it_is_at_the_end_of_a_story_too():
    world = Walk(6)
    learner = IntrinsicReward(Fixed(world.spec), Likeness())
    batch = Collector(world, learner, horizon=30, seed=1).collect()
    batch.active[4, 3] = False
    assert (batch.terminated & batch.active).any()
    told = learner.update(batch)
    flat = np.concatenate([batch.observations["clock"], batch.last_observations["clock"][None]])[1:, :, 0]
    after = flat.astype(np.float32)
    after[batch.final_places] = batch.final_observations["clock"][:, 0]
    expected = np.where(batch.active, 0.5 * after, 0.0)
    np.testing.assert_allclose(learner.inner.reward, batch.reward + expected)
    assert told == {"gail_reward": pytest.approx(expected[batch.active].mean()), "gail_loss": 0.25}
    assert learner.model.learned == batch.num_active
    assert set(learner.figures) == {"gail_reward", "gail_loss"}


def test_with_nobody_active_nothing_is_paid_and_no_model_asked():
    world = Walk(3)
    learner = IntrinsicReward(Fixed(world.spec), Likeness())
    batch = Collector(world, learner, horizon=4, seed=1).collect()
    batch.active[:] = False
    assert learner.update(batch) == {"gail_reward": 0.0}
    assert learner.model.learned is None
    np.testing.assert_array_equal(learner.inner.reward, batch.reward)


def test_the_scale_is_the_deviation_of_all_discounted_sums_so_far():
    scale = ReturnScale(0.5)
    # one row: 1, then 0.5 + 2 = 2.5; then 1.25 + 0 = 1.25 with the next rollout
    assert scale.measured(np.array([[1.0], [2.0]])) == pytest.approx(0.75)
    assert scale.measured(np.array([[0.0]])) == pytest.approx(np.std([1.0, 2.5, 1.25]))
    # other rows begin with nothing: 4 and 0
    assert scale.measured(np.array([[4.0, 0.0]])) == pytest.approx(np.std([1.0, 2.5, 1.25, 4.0, 0.0]))
    assert 0.0 < ReturnScale(0.5).measured(np.zeros((2, 3))) < 1e-6


@pytest.mark.parametrize("size", [4, 256])
def test_what_is_foretold_of_whitened_numbers_is_the_bonus(size):
    """The mean square of what the second network is off by, of numbers in deviations."""
    model = model_of("rnd", batch_size=size)
    chance = np.random.default_rng(3)
    before, then = ({"x": chance.normal(2.0, 3.0, (10, 4)).astype(np.float32)} for _ in range(2))
    found = model.bonus(before, np.zeros(10), then)
    white = (then["x"] - then["x"].mean(axis=0)) / then["x"].std(axis=0)
    fed = {"x": torch.from_numpy(white)}
    with torch.no_grad():
        off = (model.predictor(fed) - model.target(fed)).numpy()
    np.testing.assert_allclose(found, (off**2).mean(axis=1), rtol=1e-3)
    assert (found.shape, found.dtype) == ((10,), np.float32)
    assert model.moments["x"].count == 10
    assert set(model.moments) == {"x"}  # nothing privileged
    learned = model.learn(before, np.zeros(10), then)
    assert set(learned) == {"rnd_loss"}
    if size == 256:  # one minibatch: before its step the loss is the mean bonus
        assert learned["rnd_loss"] == pytest.approx(found.mean(), rel=1e-3)


def test_what_lies_beyond_five_deviations_looks_alike():
    model = model_of("rnd")
    usual = {"x": np.random.default_rng(3).normal(size=(2000, 4)).astype(np.float32)}
    model.bonus(usual, np.zeros(2000), usual)
    rows = np.float32([[4.5] * 4, [5.6] * 4, [7.0] * 4, [-5.6] * 4, [-7.0] * 4])
    four, five, seven, below, lower = model.bonus({"x": rows}, np.zeros(5), {"x": rows})
    assert (five, below) == (seven, lower)
    assert len({four, five, below}) == 3


def test_only_the_foretelling_network_learns_each_transition_once():
    model = model_of("rnd", batch_size=3)
    numbers = {"x": np.random.default_rng(3).normal(size=(7, 4)).astype(np.float32)}
    whims = [part.clone() for part in model.target.parameters()]
    told = [part.clone() for part in model.predictor.parameters()]
    model.learn(numbers, np.zeros(7), numbers)
    assert all(torch.equal(old, new) for old, new in zip(whims, model.target.parameters(), strict=True))
    assert not any(torch.equal(old, new) for old, new in zip(told, model.predictor.parameters(), strict=True))
    steps = {part.item() for name, part in model.state_dict().items() if name.endswith("/step")}
    assert steps == {3.0}  # minibatches of 3, 3 and 1


def test_a_bonus_from_a_replay_is_refused_in_words():
    class Eater(Fixed):
        experience = REPLAY

    with pytest.raises(SettingError, match=r"clock\.strength is 0\.5; .*Leave it at 0, or use ppo"):
        IntrinsicReward(Eater(Walk(2).spec), ClockModel())
    with pytest.raises(SettingError, match="outputs"):
        RndConfig(outputs=0)
