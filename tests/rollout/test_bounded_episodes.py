"""Judgement comes to an end, also of a policy that never does."""

from types import SimpleNamespace

import numpy as np

from racecraft.contract.world import ArraySpec, DiscreteActions, EpisodeRecord, WorldSpec
from racecraft.rollout.episodes import CUT, play_episodes


class Walk:
    """Two worlds; action 1 goes on, and the third step on ends the episode; every tick costs 1."""

    spec = WorldSpec("walk", 2, 1, {"place": ArraySpec((1,), np.float32)}, DiscreteActions(2))

    def reset(self, buffers, seed):
        self.places, self.steps, self.told = np.zeros(2), np.zeros(2, int), []
        buffers.active[:] = True
        buffers.observations["place"][:, 0, 0] = self.places

    def step(self, actions, buffers):
        self.places += actions[:, 0]
        self.steps += 1
        buffers.reward[:] = -1
        buffers.terminated[:, 0] = ended = self.places >= 3
        for row in np.flatnonzero(ended):
            self.told.append(EpisodeRecord(int(row), 0, int(self.steps[row]), -float(self.steps[row]), "terminated"))
            self.places[row], self.steps[row] = 0, 0
        buffers.observations["place"][:, 0, 0] = self.places

    def take_episodes(self):
        told, self.told = self.told, []
        return told


def play(choices, **words):
    policy = SimpleNamespace(act=lambda seen, mask: np.array(choices), forget=lambda rows: None)
    ticks = []
    told = play_episodes(policy, Walk(), seed=0, observers=[lambda *_: ticks.append(1)], **words)
    return [(one.world, one.steps, one.reward, one.status) for one in told], len(ticks)


def test_episodes_that_end_are_told_as_they_are():
    told, ticks = play([1, 1], episodes_each=2, spare=0, max_ticks=100)
    assert told == [(0, 3, -3.0, "terminated")] * 2 + [(1, 3, -3.0, "terminated")] * 2
    assert ticks == 6


def test_a_policy_that_stands_still_is_cut_with_what_it_earned():
    told, ticks = play([0, 1], episodes_each=1, spare=0, max_ticks=50)
    assert told == [(0, 50, -50.0, CUT), (1, 3, -3.0, "terminated")]
    assert ticks == 50


def test_spare_episodes_do_not_count():
    told, ticks = play([1, 1], episodes_each=1, spare=1, max_ticks=100)
    assert told == [(0, 3, -3.0, "terminated"), (1, 3, -3.0, "terminated")]
    assert ticks == 6


def test_who_does_not_even_end_the_spare_episode_is_still_judged():
    told, _ = play([0, 1], episodes_each=1, spare=1, max_ticks=20)
    assert told[0] == (0, 20, -20.0, CUT)
