"""PPO by shards against PPO in one place: the same minibatches, losses, gradients and weights, but for rounding."""

import math
import pickle
from dataclasses import replace

import numpy as np
import pytest
import torch
from tests.algorithms.test_ppo import FRAME, SECRET, STATE, a_learner, made_up, world_spec

from racecraft.algorithms import sharded_ppo as page
from racecraft.algorithms.learner import DivergedError
from racecraft.algorithms.networks import NetworkConfig
from racecraft.algorithms.ppo import FIGURES, PpoConfig, PpoLearner
from racecraft.algorithms.rollout_batch import side_by_side
from racecraft.algorithms.sharded_ppo import AveragingPpo, Drawn, PpoShard, added
from racecraft.contract.world import ContinuousActions, DiscreteActions, HybridActions, MultiDiscreteActions

ROWS = 7
ROUNDING = {"rtol": 1e-4, "atol": 1e-6}
NUMBERS = ContinuousActions((-1.0, 0.0), (1.0, 4.0))
SHARES = {1: (7,), 2: (4, 3), 3: (3, 2, 2)}
"""How many rows each of so many shards has."""
CASES = {
    "one choice, a vector": ({"state": STATE}, DiscreteActions(3), {}),
    "numbers, a vector": ({"state": STATE}, NUMBERS, {"value_loss": "huber"}),
    "one choice, a camera": ({"front": FRAME, "state": STATE}, DiscreteActions(3), {"standardise": "rollout"}),
    "numbers, a camera": ({"front": FRAME}, NUMBERS, {"standardise": "none", "max_grad_norm": None}),
    "a critic of its own": ({"state": STATE, "secret": SECRET}, DiscreteActions(4), {"drop_remainder": True}),
    "several choices": ({"state": STATE}, MultiDiscreteActions((2, 3)), {"batch_size": 1000}),
    "both": ({"state": STATE}, HybridActions(NUMBERS, MultiDiscreteActions((2,))), {"batch_size": 5}),
}


def two_of(case, **more):
    """Return twice the same learner, that of a case."""
    observations, actions, settings = CASES[case]
    network = NetworkConfig(hidden_units=(16,), conv_filters=(4,), conv_kernels=(4,), conv_strides=(4,))
    asked = {"batch_size": 8, "epochs": 3, "learning_rate": 3e-3, **settings, **more}
    return [a_learner(observations, actions, network=network, **asked) for _ in range(2)]


def rollout_for(learner, **more):
    """Return a rollout, some rows of it idle, decided by other weights than the learner's by now."""
    batch = made_up(learner.spec, rows=ROWS, learner=learner, **more)
    chance = np.random.default_rng(11)
    batch.columns["log_prob"] += chance.normal(0, 0.2, batch.columns["log_prob"].shape).astype(np.float32)
    batch.active = chance.random(batch.shape) < 0.8
    return batch


class Shards:
    """Shards with a learner each, asked as a cluster would: whatever they are told and answer is pickled."""

    def __init__(self, learner, shares):
        firsts = np.cumsum((0, *shares))
        self.rows = [np.arange(first, last) for first, last in zip(firsts, firsts[1:], strict=False)]
        self.learner, self.learners = learner, [self.like(learner) for _ in shares]
        self.shards = [PpoShard(one, int(rows[0]), ROWS) for one, rows in zip(self.learners, self.rows, strict=True)]
        self.asked, self.found = [], []

    def like(self, learner):
        """Return a learner of the same kind, whose weights and chance are of no account."""
        return PpoLearner(learner.spec, learner.architecture, learner.config, seed=99)

    def take(self, batch):
        for one in self.learners:  # as a worker does before it collects
            one.load_state_dict({"network": self.learner.state_dict()["network"]})
        parts = [shard.take(batch.of_rows(rows)) for shard, rows in zip(self.shards, self.rows, strict=True)]
        return side_by_side(pickle.loads(pickle.dumps(parts)))

    def __call__(self, drawn):
        self.asked.append(drawn.rows)
        told = pickle.dumps(drawn)
        found = [pickle.loads(pickle.dumps(shard.find(pickle.loads(told)))) for shard in self.shards]
        self.found.append(found)
        return found


def same_weights(one, other, **tolerance):
    mine, theirs = one.state_dict(), other.state_dict()
    for group in ("network", "optimiser"):
        assert mine[group].keys() == theirs[group].keys()
        for name, part in mine[group].items():
            np.testing.assert_allclose(part, theirs[group][name], err_msg=name, **tolerance)


@pytest.mark.parametrize("shards", SHARES)
@pytest.mark.parametrize("case", CASES)
def test_shards_learn_what_one_process_learns(case, shards):
    alone, inner = two_of(case)
    group = Shards(inner, SHARES[shards])
    averaging = AveragingPpo(inner, group)
    for number in range(2):
        batch = rollout_for(alone, seed=number)
        slim = group.take(batch)
        expected, told = alone.update(batch), averaging.update(slim)
        assert expected["minibatches"] == told["minibatches"] == len(group.asked)
        assert list(told) == list(FIGURES)
        for name, figure in expected.items():
            assert told[name] == pytest.approx(figure, rel=1e-3, abs=1e-5), name
        same_weights(averaging, alone, **ROUNDING)
        averaging.load_state_dict(alone.state_dict())  # so that roundings do not add up
        group.asked.clear()


@pytest.mark.parametrize("case", CASES)
def test_gradients_of_shards_add_up_to_those_of_the_whole_minibatch(case):
    alone, inner = two_of(case, epochs=1, batch_size=1000, max_grad_norm=None)
    batch, group = rollout_for(alone), Shards(inner, SHARES[3])
    averaging = AveragingPpo(inner, group)
    averaging.update(group.take(batch))
    alone.update(batch)
    assert [sum(part.count for part in parts) for parts in group.found] == [len(drawn) for drawn in group.asked]
    for (name, mine), (_, theirs) in zip(
        inner.network.named_parameters(), alone.network.named_parameters(), strict=True
    ):
        np.testing.assert_allclose(mine.grad, theirs.grad, rtol=1e-3, atol=1e-6, err_msg=name)


def test_which_rows_a_minibatch_holds_does_not_hang_on_the_shards():
    asked = []
    for shares in SHARES.values():
        _, inner = two_of("one choice, a vector")
        group = Shards(inner, shares)
        AveragingPpo(inner, group).update(group.take(rollout_for(inner)))
        asked.append(group.asked)
    for one, two, three in zip(*asked, strict=True):
        assert np.array_equal(one, two)
        assert np.array_equal(one, three)


def test_nothing_that_was_seen_leaves_a_shard():
    alone, inner = two_of("one choice, a camera")
    slim = Shards(inner, SHARES[2]).take(rollout_for(alone))
    assert not slim.observations
    assert not slim.last_observations
    assert not slim.final_observations
    assert set(slim.columns) == {"advantage", "target", "value"}
    assert (slim.action_mask, slim.last_action_mask) == (None, None)
    assert slim.final_index.shape == (0,)


def test_a_shard_without_rows_of_a_minibatch_sends_no_gradients():
    alone, inner = two_of("numbers, a vector", batch_size=1)
    batch = rollout_for(alone)
    batch.active[:, :4] = False  # all of the first shard's rows
    group = Shards(inner, SHARES[2])
    averaging = AveragingPpo(inner, group)
    averaging.update(group.take(batch))
    alone.update(batch)
    assert all(first.count == 0 and not first.gradients for first, _ in group.found)
    same_weights(averaging, alone, **ROUNDING)


def test_a_rollout_without_a_single_active_row_teaches_nothing():
    alone, inner = two_of("one choice, a vector")
    batch, group = rollout_for(alone), Shards(inner, SHARES[2])
    batch.active[:] = False
    told = AveragingPpo(inner, group).update(group.take(batch))
    assert told == alone.update(batch)
    assert not group.asked


def test_shards_with_fewer_ticks_stand_still_at_the_end():
    """Whole episodes: one shard's rows were done sooner than another's."""
    alone, inner = two_of("numbers, a vector")
    batch = rollout_for(alone)
    short = batch.of_rows(np.arange(4))
    batch.active[4:, :4] = False
    group = Shards(inner, SHARES[2])
    cut = {name: array[:4] for name, array in short.observations.items()}
    kept = short.final_index < 4 * 4
    short = replace(
        short,
        observations=cut,
        columns={name: array[:4] for name, array in short.columns.items()},
        last_observations={name: array[4] for name, array in short.observations.items()},
        final_index=short.final_index[kept],
        final_observations={name: array[kept] for name, array in short.final_observations.items()},
        **{name: getattr(short, name)[:4] for name in ("actions", "reward", "terminated", "truncated", "active")},
    )
    parts = [group.shards[0].take(short), group.shards[1].take(batch.of_rows(np.arange(4, 7)))]
    slim = side_by_side(parts)
    assert slim.shape == batch.shape
    AveragingPpo(inner, group).update(slim)
    assert {int(row) // ROWS for drawn in group.asked for row in drawn if row % ROWS < 4} == {0, 1, 2, 3}
    assert sum(len(drawn) for drawn in group.asked) == 3 * int(batch.active.sum())


def test_schedules_reach_the_shards():
    alone, inner = two_of("numbers, a vector", clip_schedule="linear", entropy_schedule="linear", clip=0.3)
    batch, group = rollout_for(alone), Shards(inner, SHARES[2])
    averaging = AveragingPpo(inner, group)
    for learner in (alone, averaging):
        learner.anneal(0.5)
    expected, told = alone.update(batch), averaging.update(group.take(batch))
    assert told["clip_fraction"] == pytest.approx(expected["clip_fraction"])
    assert told["policy_loss"] == pytest.approx(expected["policy_loss"], rel=1e-3, abs=1e-5)
    same_weights(averaging, alone, **ROUNDING)


def test_shards_multiply_in_half_the_precision_where_it_is_asked_for():
    alone, inner = two_of("one choice, a camera", precision="bfloat16", epochs=1)
    batch, group = rollout_for(alone), Shards(inner, SHARES[2])
    averaging = AveragingPpo(inner, group)
    expected, told = alone.update(batch), averaging.update(group.take(batch))
    assert told["value_loss"] == pytest.approx(expected["value_loss"], rel=0.05)
    same_weights(averaging, alone, rtol=0.2, atol=1e-2)


def test_losses_that_are_no_numbers_are_told():
    _, inner = two_of("one choice, a vector")
    batch, group = rollout_for(inner), Shards(inner, SHARES[2])
    batch.reward[0, 0] = math.nan
    batch.active[:] = True
    with pytest.raises(DivergedError, match="Lower ppo.learning_rate"):
        AveragingPpo(inner, group).update(group.take(batch))


def test_a_mask_goes_with_the_rows():
    spec = world_spec({"state": STATE}, DiscreteActions(3), has_action_mask=True)
    config = PpoConfig(batch_size=8, epochs=2)
    alone, inner = (PpoLearner(spec, NetworkConfig(hidden_units=(16,)), config, 3) for _ in range(2))
    batch = rollout_for(alone)
    batch.action_mask = np.ones((*batch.shape, 3), bool)
    other = np.random.default_rng(5).random(batch.shape) < 0.5
    batch.action_mask[..., 2] = ~other | (batch.columns["raw_action"] == 2)
    group = Shards(inner, SHARES[3])
    averaging = AveragingPpo(inner, group)
    expected, told = alone.update(batch), averaging.update(group.take(batch))
    assert told["entropy"] == pytest.approx(expected["entropy"], rel=1e-4)
    same_weights(averaging, alone, **ROUNDING)
    assert torch.isfinite(torch.tensor(list(told.values()))).all()


@pytest.mark.parametrize(("rows", "count"), [((0, 1), 0), ((3, 0, 10), 2)])
def test_a_shard_tells_what_it_found_of_its_own_rows_and_how_long_it_took(monkeypatch, rows, count):
    """It has rows 3 to 6 of seven: place 10 of all is row 3 of the second tick."""
    _, inner = two_of("numbers, a vector")
    shard = PpoShard(inner, 3, ROWS)
    shard.take(made_up(inner.spec, rows=ROWS, learner=inner).of_rows(np.arange(3, 7)))
    clock = iter([10.0, 12.5])
    monkeypatch.setattr(page.time, "perf_counter", lambda: next(clock))
    weights = {name: part.numpy() for name, part in inner.state_dict()["network"].items()}
    found = shard.find(Drawn(weights, np.array(rows), 0.0, 1.0, 0.2, 0.01))
    assert (found.count, found.seconds) == (count, 2.5)
    assert found.figures.shape == (5,)
    assert bool(found.gradients) == bool(found.figures.any()) == (count > 0)


def test_what_a_shard_tells_is_standardised_by_what_it_is_told():
    """Ratios are 1 with the weights that acted, so the policy's loss of a row is minus its advantage."""
    _, inner = two_of("numbers, a vector")
    batch = made_up(inner.spec, rows=ROWS, learner=inner)
    shard = PpoShard(inner, 0, ROWS)
    slim = shard.take(batch)
    weights = {name: part.numpy() for name, part in inner.state_dict()["network"].items()}
    rows = np.array([2, 9])
    found = shard.find(Drawn(weights, rows, 0.5, 2.0, 0.2, 0.0))
    expected = -((slim.columns["advantage"].reshape(-1)[rows] - 0.5) / 2.0).sum()
    assert found.figures[0] == pytest.approx(expected, rel=1e-3, abs=1e-4)


@pytest.mark.parametrize("over", ["minibatch", "rollout"])
def test_a_lone_advantage_stays_as_it_is(over):
    alone, inner = two_of("numbers, a vector", standardise=over, epochs=1)
    batch = made_up(alone.spec, rows=ROWS, learner=alone)
    batch.active[:] = False
    batch.active[1, 2] = True
    group = Shards(inner, SHARES[2])
    told = AveragingPpo(inner, group).update(group.take(batch))
    assert told["policy_loss"] == pytest.approx(-told["mean_advantage"], rel=1e-4)
    assert abs(told["mean_advantage"]) > 1e-3


def test_a_sum_is_nobodys_part():
    parts = [np.array([1.0, 2.0]), np.array([10.0, 20.0]), np.array([100.0, 200.0])]
    assert added(parts).tolist() == [111.0, 222.0]
    assert parts[0].tolist() == [1.0, 2.0]
    alone = added(parts[:1])
    alone += 1.0
    assert parts[0].tolist() == [1.0, 2.0]
