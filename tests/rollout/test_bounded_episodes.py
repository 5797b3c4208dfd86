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

    def pop_episodes(self):
        told, self.told = self.told, []
        return told


def play(choices, world=None, **words):
    policy = SimpleNamespace(act=lambda seen, mask: np.array(choices), reset_state=lambda rows: None)
    ticks = []
    told = play_episodes(policy, world or Walk(), seed=0, observers=[lambda *_: ticks.append(1)], **words)
    return [(one.world, one.steps, one.reward, one.status) for one in told], len(ticks)


def test_episodes_that_end_are_told_as_they_are():
    told, ticks = play([1, 1], episodes_each=2, spare=0, max_ticks=100)
    assert told == [(0, 3, -3.0, "terminated")] * 2 + [(1, 3, -3.0, "terminated")] * 2
    assert ticks == 6


def test_a_policy_that_stands_still_is_cut_with_what_it_earned():
    told, ticks = play([0, 1], episodes_each=1, spare=0, max_ticks=50)
    assert told == [(0, 50, -50.0, CUT), (1, 3, -3.0, "terminated")]
    assert ticks == 50


def test_who_does_not_even_end_the_spare_episode_is_still_judged():
    told, _ = play([0, 1], episodes_each=1, spare=1, max_ticks=20)
    assert told[0] == (0, 20, -20.0, CUT)


class Absent(Walk):
    """The second walker comes late, or never."""

    def __init__(self, comes_at):
        self.comes_at = comes_at

    def reset(self, buffers, seed):
        super().reset(buffers, seed)
        self.tick = 0
        buffers.active[1] = False

    def step(self, actions, buffers):
        super().step(actions * (self.tick >= np.array([[0], [self.comes_at]])), buffers)
        self.tick += 1
        buffers.active[1] = self.tick >= self.comes_at


def play_absent(comes_at, max_ticks):
    told, ticks = play([1, 1], Absent(comes_at), episodes_each=2, spare=0, max_ticks=max_ticks)
    return [world for world, *_ in told], ticks


def test_who_never_comes_is_not_waited_for_where_ticks_are_counted():
    assert play_absent(comes_at=1000, max_ticks=50) == ([0, 0], 6)


def test_who_comes_late_is_waited_for():
    assert play_absent(comes_at=4, max_ticks=50) == ([0, 0, 1, 1], 10)
    assert play_absent(comes_at=8, max_ticks=None) == ([0, 0, 1, 1], 14)
