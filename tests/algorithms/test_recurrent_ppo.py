"""PPO with a memory: it recalls what a plain policy cannot know, and what it replays is what it did."""

import numpy as np
import pytest
import torch
from toy_world import Walk

from racecraft.algorithms.building import build_learner
from racecraft.algorithms.networks import Architecture, NetworkConfig
from racecraft.algorithms.policy_spec import PolicySpec
from racecraft.algorithms.ppo import VALUE, PpoConfig
from racecraft.algorithms.recurrent_network import memory_cell, state_width
from racecraft.algorithms.recurrent_policy import RecurrentPolicy
from racecraft.algorithms.recurrent_ppo import CARRIED, stretches
from racecraft.algorithms.registry import find_algorithm
from racecraft.contract.errors import SettingError
from racecraft.contract.world import ArraySpec, DiscreteActions, WorldSpec
from racecraft.players.trained import GreedyPolicy, policy_from
from racecraft.rollout.collector import Collector
from racecraft.rollout.episodes import play_episodes
from racecraft.rollout.statistics import summarise
from racecraft.settings.composition import Settings
from racecraft.training.settings import RuntimeConfig


class RecallTheCue:
    """Shows one of two cues, then nothing for `delay` ticks, then asks: saying the cue brings 1, the other -1."""

    def __init__(self, num_worlds, delay=4):
        seen = {"cue": ArraySpec((3,), np.float32, 0, 1, doc="either cue, or that it is asked for")}
        self.spec = WorldSpec("recall the cue", num_worlds, 1, seen, DiscreteActions(2))
        self.delay = delay

    def reset(self, buffers, seed):
        self.rng, self.clock = np.random.default_rng(seed), 0
        self._begin(buffers)

    def step(self, actions, buffers):
        asked = self.clock == self.delay + 1
        buffers.reward[:] = np.where(actions == self.cue, 1.0, -1.0) if asked else 0.0
        buffers.terminated[:], buffers.truncated[:] = asked, False
        buffers.final_observations["cue"][:] = 0.0
        self.clock += 1
        if asked:
            self.clock = 0
            self._begin(buffers)
            return
        buffers.observations["cue"][:] = 0.0
        buffers.observations["cue"][..., 2] = self.clock == self.delay + 1
        buffers.active[:] = True

    def close(self):
        pass

    def _begin(self, buffers):
        self.cue = self.rng.integers(0, 2, (self.spec.num_worlds, 1))
        buffers.observations["cue"][:] = np.eye(3, dtype=np.float32)[self.cue]
        buffers.active[:] = True


def settings(memory="lstm", ppo=None, **network):
    config = PpoConfig(**({"learning_rate": 1e-2, "batch_size": 128, "sequence_length": 8} | (ppo or {})))
    shape = NetworkConfig(hidden_units=(16,), activation="tanh", memory=memory, memory_units=8, **network)
    return Settings(network=shape, ppo=config, runtime=RuntimeConfig())


def made(world, *args, **more):
    return build_learner(find_algorithm("ppo"), world.spec, settings(*args, **more), seed=1)


def recalled(memory, updates):
    """Return the best reward that was judged on the way: a greedy policy may lose for an update what it has learned."""
    world = RecallTheCue(32)
    learner = made(world, memory)
    collector = Collector(world, learner, horizon=24, seed=1)
    judged = []
    for number in range(1, updates + 1):
        learner.update(collector.collect())
        if number % 5 == 0:
            played = play_episodes(GreedyPolicy(learner), RecallTheCue(16), episodes_each=8, seed=5)
            judged.append(summarise(played).mean_reward)
    return max(judged, key=abs)


def test_a_memory_recalls_the_cue():
    assert recalled("lstm", 25) == 1.0


def test_without_a_memory_the_cue_is_lost():
    assert abs(recalled("none", 25)) < 0.3


@pytest.mark.parametrize("memory", ["lstm", "gru"])
@pytest.mark.parametrize("network", [{}, {"separate_networks": True, "privileged_critic": False}])
def test_what_an_update_runs_through_is_what_was_decided(memory, network):
    world = Walk(6, num_agents=2, masked=True)
    learner = made(world, memory, ppo={"epochs": 1, "batch_size": 10_000, "sequence_length": 5}, **network)
    collector = Collector(world, learner, horizon=17, seed=3)
    for _ in range(3):
        batch = collector.collect()
        batch.active[3:9, 2] = False
        ended = batch.terminated | batch.truncated
        whole, rows, _ = learner._prepare(batch)
        (picked,) = learner._minibatches(rows)
        taken = learner._taken(whole, picked)
        with torch.no_grad():
            params, value = learner.network.run(taken.observations, taken.sequences)
            found, _ = learner.distribution.log_prob_and_entropy(params, None, taken.action_mask, taken.raw_actions)
        assert len(found) == batch.num_active == len(rows)
        np.testing.assert_allclose(found, taken.log_prob, atol=1e-5)
        order = picked.reshape(-1)[taken.sequences.learned].numpy()
        np.testing.assert_array_equal(np.sort(order), np.flatnonzero(batch.active))
        np.testing.assert_allclose(value, batch.columns[VALUE].reshape(-1)[order], atol=1e-5)
    assert ended.any()


def test_an_episodes_first_tick_carries_nothing_in():
    world = Walk(5)
    learner = made(world)
    batch = Collector(world, learner, horizon=30, seed=3).collect()
    ended = (batch.terminated | batch.truncated)[:-1]
    assert ended.any()
    assert (batch.columns[CARRIED][0] == 0).all()
    assert (batch.columns[CARRIED][1:][ended] == 0).all()
    assert (batch.columns[CARRIED][1:][~ended] != 0).any(axis=-1).all()


def test_gradients_reach_back_through_a_stretch_and_no_further():
    world = Walk(3)
    learner = made(world, ppo={"epochs": 1, "batch_size": 10_000, "sequence_length": 4})
    batch = Collector(world, learner, horizon=8, seed=3).collect()
    whole, rows, _ = learner._prepare(batch)
    (picked,) = learner._minibatches(rows)
    taken = learner._taken(whole, picked)
    taken.observations["square"].requires_grad_(True)
    _, value = learner.network.run(taken.observations, taken.sequences)
    stretch = 2
    value[3 * picked.shape[1] + stretch].backward()  # the last tick of one stretch
    pull = taken.observations["square"].grad.abs().sum(dim=1).view(picked.shape)
    assert (pull[:, stretch] > 0).all()
    assert pull.sum() == pull[:, stretch].sum()


def test_a_recurrent_run_goes_on_bit_by_bit():
    def turns(learner, collector, count):
        return [learner.update(collector.collect()) for _ in range(count)]

    learner = made(Walk(4))
    collector = Collector(Walk(4), learner, horizon=5, seed=1)
    turns(learner, collector, 2)
    kept, worlds = learner.state_dict(), collector.state()
    told = turns(learner, collector, 3)

    other = made(Walk(4))
    again = Collector(Walk(4), other, horizon=5, seed=9)
    other.load_state_dict(kept)
    again.restore(worlds)
    assert turns(other, again, 3) == told

    lost = made(Walk(4))
    again = Collector(Walk(4), lost, horizon=5, seed=9)
    lost.load_state_dict({**kept, "memory": {"carried": kept["memory"]["carried"] * 0}})
    again.restore(worlds)
    assert turns(lost, again, 3) != told


def test_the_policy_of_a_checkpoint_remembers_and_forgets():
    learner = made(Walk(4), "gru")
    spec = PolicySpec.from_dictionary(learner.policy_spec.as_dictionary())
    policy, greedy = policy_from(spec, learner.state_dict()["network"]), GreedyPolicy(learner)
    assert isinstance(policy, RecurrentPolicy)
    rng = np.random.default_rng(1)

    def seen():
        return {"square": rng.random((4, 9), np.float32), "clock": rng.integers(0, 9, (4, 1)).astype(np.uint8)}

    for _ in range(4):
        now = seen()
        np.testing.assert_array_equal(policy.act(now), greedy.act(now))
    last, fresh = seen(), policy_from(spec, learner.state_dict()["network"])
    anew = fresh.probabilities(last)
    before = policy.probabilities(last)
    assert not np.allclose(before, anew)
    np.testing.assert_array_equal(before, policy.probabilities(last))  # looking moves nothing on
    policy.reset_state(np.array([True, False, True, False]))
    after = policy.probabilities(last)
    np.testing.assert_allclose(after[[0, 2]], anew[[0, 2]], atol=1e-7)
    np.testing.assert_array_equal(after[[1, 3]], before[[1, 3]])


def test_parked_rows_keep_their_own_state():
    learner = made(Walk(4))
    seen = {"square": np.eye(9, dtype=np.float32)[:2], "clock": np.zeros((2, 1), np.uint8)}
    learner.reset_state(np.ones(4, bool))
    learner.act(seen, rows=np.array([1, 3]))
    carried = learner.states.table
    assert (carried[[0, 2]] == 0).all()
    assert (carried[[1, 3]] != 0).any()


def test_stretches_cover_every_active_tick_once():
    active = np.random.default_rng(0).random((13, 4)) < 0.6
    active[:, 2] = False
    places = stretches(active, 5)
    used = places[places >= 0]
    assert len(np.unique(used)) == len(used)
    assert set(np.flatnonzero(active)) <= set(used)
    assert not (used % 4 == 2).any()


def test_bfloat16_is_refused():
    with pytest.raises(SettingError, match="float32"):
        made(Walk(2), ppo={"precision": "bfloat16"})


def cell_of(kind, width=3, units=4):
    row = Architecture(memory=kind, memory_units=units)
    return memory_cell(width, row, torch.Generator().manual_seed(1))


@pytest.mark.parametrize(("kind", "gates"), [("lstm", 4), ("gru", 3)])
def test_a_memory_begins_orthogonal_gate_by_gate_and_keeps_what_it_holds(kind, gates):
    """Biases are 0, but 1 for what an LSTM keeps, its second gate (Jozefowicz et al., 2015)."""
    cell = cell_of(kind)
    assert state_width(cell) == (8 if kind == "lstm" else 4)
    for weights, width in ((cell.weight_ih, 3), (cell.weight_hh, 4)):
        assert weights.shape == (4 * gates, width)
        for gate in weights.detach().split(4):
            torch.testing.assert_close(gate.T @ gate, torch.eye(width), atol=1e-5, rtol=0.0)
    kept = [0.0] * 4 + [1.0] * 4 + [0.0] * 8 if kind == "lstm" else [0.0] * 12
    assert cell.bias_ih.tolist() == kept
    assert not cell.bias_hh.any()


def ticks_of(batch, at):
    return {name: torch.from_numpy(part[at]) for name, part in batch.observations.items()}


@pytest.mark.parametrize("network", [{}, {"separate_networks": True, "privileged_critic": False}])
def test_what_follows_a_cut_is_valued_with_what_was_carried_that_far(network):
    """With lambda 0 and discount 1 an advantage is reward + what follows - value, so what follows can be read of it."""
    world = Walk(5)
    learner = made(world, "lstm", ppo={"gae_lambda": 0.0, "discount": 1.0}, **network)
    batch = Collector(world, learner, horizon=30, seed=3).collect()
    assert len(batch.final_index)
    judged = learner.compute_advantages(batch)
    followed = judged.advantages - batch.reward + judged.values
    np.testing.assert_array_equal(judged.values, batch.columns[VALUE])
    ended = batch.terminated | batch.truncated
    np.testing.assert_allclose(followed[:-1][~ended[:-1]], batch.columns[VALUE][1:][~ended[:-1]], atol=1e-5)
    np.testing.assert_allclose(followed[batch.terminated], 0.0, atol=1e-5)
    with torch.no_grad():
        for place, (t, r) in enumerate(zip(*batch.final_places, strict=True)):
            seen = {name: part[r : r + 1] for name, part in ticks_of(batch, t).items()}
            state = torch.from_numpy(batch.columns[CARRIED][t, r : r + 1].copy())
            _, _, carried = learner.network.carry(seen, state)
            final = {name: torch.from_numpy(part[place : place + 1]) for name, part in batch.final_observations.items()}
            _, value, _ = learner.network.carry(final, carried)
            assert followed[t, r] == pytest.approx(value.item(), abs=1e-5)
        state = torch.from_numpy(batch.columns[CARRIED][-1].copy())
        _, _, carried = learner.network.carry(ticks_of(batch, -1), state)
        last = {name: torch.from_numpy(part) for name, part in batch.last_observations.items()}
        _, value, _ = learner.network.carry(last, carried)
    np.testing.assert_allclose(followed[-1][~ended[-1]], value.numpy()[~ended[-1]], atol=1e-5)


@pytest.mark.parametrize(
    ("settings", "sizes"),
    [
        ({"batch_size": 8, "sequence_length": 4}, [2, 2, 2, 2, 1]),
        ({"batch_size": 8, "sequence_length": 4, "drop_remainder": True}, [2, 2, 2, 2]),
        ({"batch_size": 3, "sequence_length": 4}, [1] * 9),
        ({"batch_size": 400, "sequence_length": 4, "drop_remainder": True}, [9]),
    ],
)
def test_minibatches_are_whole_stretches_of_about_as_many_ticks_as_asked(settings, sizes):
    world = Walk(3)
    learner = made(world, ppo=settings)
    batch = Collector(world, learner, horizon=12, seed=3).collect()  # three rows of three stretches
    whole, rows, _ = learner._prepare(batch)
    drawn = list(learner._minibatches(rows))
    assert [tuple(picked.shape) for picked in drawn] == [(4, size) for size in sizes]
    if sum(sizes) == 9:
        assert sorted(torch.cat([picked.reshape(-1) for picked in drawn]).tolist()) == list(range(36))
    assert len(whole.targets) == len(rows) == 36
