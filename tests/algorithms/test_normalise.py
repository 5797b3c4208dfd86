"""Running mean and deviation of what is seen: right by twin, learned from alone, carried with the weights."""

import numpy as np
import pytest
import torch

from racecraft.algorithms.learner import Decision
from racecraft.algorithms.networks import NetworkConfig
from racecraft.algorithms.ppo import LOG_PROB, RAW_ACTION, VALUE, PpoConfig, PpoLearner
from racecraft.algorithms.rollout_batch import RolloutBatch
from racecraft.algorithms.running_statistics import RunningStatistics
from racecraft.contract.world import ArraySpec, DiscreteActions, WorldSpec
from racecraft.players.trained import policy_from

FAR = 5000.0
SEEN = {
    "bit": ArraySpec((1,), np.float32),
    "frame": ArraySpec((12, 12), np.uint8, 0, 255),
    "entities": ArraySpec((2, 3), np.float32),
}
SMALL = {"conv_filters": (4,), "conv_kernels": (4,), "conv_strides": (4,), "hidden_units": (16,)}


def a_learner(observations=None, normalise=True, precision="float32", **network):
    spec = WorldSpec("toy", 64, 1, observations or {"bit": SEEN["bit"]}, DiscreteActions(2))
    config = PpoConfig(learning_rate=3e-3, discount=0.0, batch_size=256, precision=precision, entropy_weight=0.0)
    return PpoLearner(spec, NetworkConfig(**SMALL, normalise=normalise, **network), config, seed=1)


def rollout(learner, seed, rows=512, active=None):
    """One tick of many rows that see a bit far from zero, and are paid for telling it."""
    rng = np.random.default_rng(seed)
    bits = rng.integers(0, 2, rows)
    made = {
        "bit": (FAR + 10.0 * bits[:, None]).astype(np.float32),
        "frame": rng.integers(0, 256, (rows, 12, 12)).astype(np.uint8),
        "entities": rng.normal(size=(rows, 2, 3)).astype(np.float32),
    }
    seen = {name: made[name] for name in learner.spec.observations}
    decided: Decision = learner.act(seen)
    right = decided.actions == bits
    return RolloutBatch(
        observations={name: part[None] for name, part in seen.items()},
        actions=decided.actions[None],
        reward=right[None].astype(np.float32),
        terminated=np.ones((1, rows), bool),
        truncated=np.zeros((1, rows), bool),
        active=np.ones((1, rows), bool) if active is None else active[None],
        last_observations=seen,
        last_active=np.ones(rows, bool),
        columns={name: decided.columns[name][None] for name in (RAW_ACTION, LOG_PROB, VALUE)},
    ), right.mean()


def statistics_of(network):
    return {name: part for name, part in network.state_dict().items() if "statistics" in name}


def test_in_any_portions_they_are_the_mean_and_deviation_of_all():
    """A distance of 1 counts beside them, so that a number which never changes divides by no 0."""
    rng = np.random.default_rng(0)
    rows = rng.normal([3.0, -200.0, 7.0], [2.0, 50.0, 0.0], (900, 3)).astype(np.float32)
    statistics = RunningStatistics(3)
    for part in np.split(rows, [0, 1, 40, 600]):
        statistics.update(torch.from_numpy(part))
    everything = rows.astype(np.float64)
    mean, deviation = (part.numpy() for part in statistics.mean_and_deviation())
    np.testing.assert_allclose(mean, everything.mean(axis=0), rtol=1e-6)
    squares = ((everything - everything.mean(axis=0)) ** 2).sum(axis=0) + 1.0
    np.testing.assert_allclose(deviation, np.sqrt(squares / 901), rtol=1e-6)
    assert (deviation > 0).all()


def test_what_is_far_from_zero_is_learned_only_where_it_is_normalised():
    shares = {}
    for normalise in (True, False):
        learner = a_learner(normalise=normalise)
        for turn in range(20):
            batch, shares[normalise] = rollout(learner, turn)
            learner.update(batch)
    assert shares[True] > 0.95
    assert shares[False] < 0.7


def test_acting_and_judging_teach_nothing_and_inactive_rows_do_not_count():
    learner = a_learner()
    active = np.arange(512) < 100
    batch, _ = rollout(learner, 0, active=active)
    learner.choose({"bit": batch.observations["bit"][0]})
    counts = [part.item() for name, part in statistics_of(learner.network).items() if name.endswith("count")]
    assert counts == [0.0]
    learner.update(batch)
    told = statistics_of(learner.network)
    ((mean, count),) = [(told[name.replace("count", "mean")], told[name]) for name in told if name.endswith("count")]
    assert count.item() == 100.0
    seen = batch.observations["bit"][0, active, 0].astype(np.float64)
    assert mean.item() == pytest.approx(seen.mean())


def test_only_vectors_are_normalised_and_a_critic_of_its_own_keeps_its_own():
    """Pictures are scaled as ever; rows of entities hold zeros for those that are absent."""
    learner = a_learner(SEEN, separate_networks=True)
    names = [name for name in statistics_of(learner.network) if name.endswith("mean")]
    assert [tuple(learner.network.state_dict()[name].shape) for name in names] == [(1,), (1,)]
    assert {name.split(".")[0] for name in names} == {"policy_body", "critic_body"}
    learner.network.observe({"bit": torch.full((4, 1), 10.0)})
    assert [learner.network.state_dict()[name].item() for name in names] == [10.0, 10.0]


@pytest.mark.parametrize("precision", ["float32", "bfloat16"])
def test_weights_carry_them_and_a_stranger_reads_as_the_learner_does(precision):
    learner = a_learner(precision=precision)
    for turn in range(3):
        learner.update(rollout(learner, turn)[0])
    kept = learner.state_dict()
    stranger = policy_from(learner.policy_spec, kept["network"])
    seen = {"bit": np.linspace(FAR - 20, FAR + 20, 50, dtype=np.float32)[:, None]}
    np.testing.assert_array_equal(stranger.act(seen), learner.choose(seen))
    again = a_learner(precision=precision)
    again.load_state_dict(kept)
    first, second = (one.update(rollout(one, 9)[0]) for one in (learner, again))
    assert first == second
    for name, part in learner.network.state_dict().items():
        assert torch.equal(part, again.network.state_dict()[name])
    if precision == "bfloat16":
        mine = learner.working.policy_body.embedders[0][0].statistics
        assert mine is learner.network.policy_body.embedders[0][0].statistics
        assert mine.mean.dtype == torch.float64
