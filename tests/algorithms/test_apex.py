"""Ape-X: unlike actors, priorities of their own, a learner beside them."""

import numpy as np
import pytest
import torch
from toy_world import CopyTheNumber

from racecraft.algorithms.apex import ApexConfig, ApexLearner, ladder
from racecraft.algorithms.learner import DivergedError
from racecraft.algorithms.networks import NetworkConfig
from racecraft.algorithms.replay_sampler import VALUE_BEST, VALUE_TAKEN
from racecraft.algorithms.rollout_batch import RolloutBatch
from racecraft.contract.world import ArraySpec, DiscreteActions, WorldSpec
from racecraft.players.trained import GreedyPolicy
from racecraft.rollout.collector import Collector
from racecraft.rollout.episodes import play_episodes
from racecraft.rollout.replay import Replay
from racecraft.rollout.replay_settings import ReplayConfig
from racecraft.rollout.statistics import summarise

CONFIG = {"learning_rate": 5e-3, "batch_size": 64, "train_every": 4, "target_every": 50, "optimiser": "adam"}


def built(world, **settings):
    config = ApexConfig(**(CONFIG | {"discount": 0.5} | settings))
    learner = ApexLearner(world.spec, NetworkConfig(hidden_units=(32,)), config, seed=1)
    memory = ReplayConfig(capacity=5000, learning_starts=200, prioritised=True)
    return learner, Replay(world.spec, memory, config.discount, config.n_step, learner.columns)


def test_the_ladder_is_the_paper_s():
    found = ladder(0.4, 7.0, 8)
    np.testing.assert_allclose(found, [0.4 ** (1 + i / 7 * 7) for i in range(8)], rtol=1e-5)
    assert ladder(0.4, 7.0, 1).tolist() == pytest.approx([0.4])
    assert ladder(0.4, 7.0, 2).tolist() == pytest.approx([0.4, 0.4**8]), "the first and the last rung"


def test_each_row_wanders_as_often_as_its_rung_says():
    learner, _ = built(CopyTheNumber(4), epsilon=0.8, ladder=3.0)
    seen = {name: np.zeros((4, *part.shape), part.dtype) for name, part in learner.spec.observations.items()}
    best = learner.choose(seen)
    drawn = np.stack([learner.act(seen).actions for _ in range(4000)])
    count = learner.spec.actions.count
    found = (drawn != best).mean(axis=0) * count / (count - 1)
    np.testing.assert_allclose(found, learner.ladder, atol=0.04)
    alone = np.stack([learner.act({n: a[:1] for n, a in seen.items()}, rows=np.array([3])).actions for _ in range(500)])
    assert (alone != best[3]).mean() < 0.4, "the last rung (0.31), though it decides alone"


def test_what_is_new_has_the_error_that_the_actors_saw_themselves():
    """By hand: reward 1 each tick, gamma a half, two steps; the actor's words are 10 t and 10 t + 3."""
    spec = WorldSpec("hand", 1, 1, {"x": ArraySpec((1,), np.float32)}, DiscreteActions(2))
    noted = {VALUE_TAKEN: ArraySpec((), np.float32), VALUE_BEST: ArraySpec((), np.float32)}
    memory = ReplayConfig(capacity=20, learning_starts=1, prioritised=True, priority_exponent=1.0)
    replay = Replay(spec, memory, 0.5, 2, noted)
    ticks = np.arange(6, dtype=np.float32)[:, None]
    ended = ticks == 4
    replay.add(
        RolloutBatch(
            {"x": ticks[..., None]}, np.zeros((6, 1), np.int64), np.ones((6, 1), np.float32), ended, ended & False,
            np.ones((6, 1), bool), {"x": np.full((1, 1), 6, np.float32)}, np.ones(1, bool),
            {VALUE_TAKEN: 10 * ticks, VALUE_BEST: 10 * ticks + 3},
        )
    )  # fmt: skip
    # Tick 0: 1 + 1/2 + 23/4 - 0; tick 3 ends with tick 4: 1 + 1/2 - 30. Nobody has spoken of tick 6 yet.
    expected = [1.5 + 23 / 4, abs(1.5 + 33 / 4 - 10), abs(1.5 + 43 / 4 - 20), 28.5, 0.0, 0.0]
    np.testing.assert_allclose(replay.priorities.leaves[:6], expected, rtol=1e-5)
    assert len(replay) == 4


def test_it_learns_beside_its_actors_and_they_follow_at_each_meeting():
    world = CopyTheNumber(16)
    learner, replay = built(world)
    collector = Collector(world, learner, horizon=16, seed=1)
    taken = 0
    for _ in range(16):
        fed = replay.add(collector.collect())
        if fed is None:
            continue
        before = learner.state_dict()["network"]["choices.0.weight"]
        taken += learner.update(fed)["gradient_steps"]
        assert torch.equal(
            learner.actor.state_dict()["choices.0.weight"], learner.state_dict()["network"]["choices.0.weight"]
        )
        assert taken == 0 or not torch.equal(before, learner.state_dict()["network"]["choices.0.weight"])
    assert taken > 500
    reward = summarise(play_episodes(GreedyPolicy(learner), CopyTheNumber(4), episodes_each=4, seed=2)).mean_reward
    assert reward == 8.0


def test_a_state_between_two_meetings_owes_the_steps_that_are_still_being_taken():
    world = CopyTheNumber(16)
    learner, replay = built(world)
    collector = Collector(world, learner, horizon=16, seed=1)
    learner.update(replay.add(collector.collect()))
    state = learner.state_dict()
    again, _ = built(world)
    again.load_state_dict(state)
    assert (again.owed, again.steps_taken) == (256, 0)


def test_what_fails_beside_is_told_at_the_next_meeting():
    world = CopyTheNumber(16)
    learner, replay = built(world)
    collector = Collector(world, learner, horizon=16, seed=1)
    fed = replay.add(collector.collect())
    replay.ring.arrays["reward"][:] = np.nan
    learner.update(fed)
    with pytest.raises(DivergedError, match=r"Lower apex.learning_rate"):
        learner.update(fed)


def test_an_actor_notes_what_it_expected_of_what_it_took_and_of_the_best_that_was_allowed():
    learner, _ = built(CopyTheNumber(6), epsilon=1.0, ladder=0.0)
    seen, mask = {"number": np.eye(4, dtype=np.float32)[[0, 1, 2, 3, 0, 1]]}, np.ones((6, 4), bool)
    worth = learner.policy.values(seen)
    mask[np.arange(6), worth.argmax(axis=1)] = False
    decided = learner.act(seen, mask)
    assert mask[np.arange(6), decided.actions].all()
    np.testing.assert_allclose(decided.columns[VALUE_TAKEN], worth[np.arange(6), decided.actions], rtol=1e-6)
    np.testing.assert_allclose(decided.columns[VALUE_BEST], np.where(mask, worth, -np.inf).max(axis=1), rtol=1e-6)
    assert learner.act(seen).columns[VALUE_BEST] == pytest.approx(worth.max(axis=1))
    assert learner.explored == 12
    assert {name: (part.shape, part.dtype) for name, part in learner.columns.items()} == dict.fromkeys(
        (VALUE_TAKEN, VALUE_BEST), ((), np.float32)
    )


def test_whoever_goes_on_from_a_state_decides_by_its_weights_at_once():
    (one, _), (two, _) = built(CopyTheNumber(2)), built(CopyTheNumber(2))
    with torch.no_grad():
        one.network.choices[-1].bias.copy_(torch.tensor([0.0, 0.0, 9.0, 0.0]))
    seen = {"number": np.eye(4, dtype=np.float32)}
    assert not (one.choose(seen) == 2).all(), "the actor has not met it"
    two.load_state_dict({"network": one.network.state_dict()})
    assert (two.choose(seen) == 2).all()
    assert two.state_dict()["network"]["choices.2.bias"][2] == 9.0
