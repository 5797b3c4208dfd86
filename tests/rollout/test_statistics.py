"""Episodes counted by hand: four agents, of whom some end and some go on."""

import math
from types import SimpleNamespace

import numpy as np

from racecraft.contract.world import ArraySpec, DiscreteActions, EpisodeRecord, WorldSpec, allocate
from racecraft.rollout.statistics import EpisodeCounter, EpisodeSummary, summarise

SPEC = WorldSpec("two by two", 2, 2, {"x": ArraySpec((), np.float32)}, DiscreteActions(2))


def counter():
    return EpisodeCounter(SimpleNamespace(spec=SPEC))


def count(counting, rewards, terminated=(), truncated=()):
    """Count one tick that pays rewards (N, M) and ends where it is told (world, agent)."""
    buffers = allocate(SPEC)
    buffers.reward[:] = rewards
    for name, places in (("terminated", terminated), ("truncated", truncated)):
        for place in places:
            getattr(buffers, name)[place] = True
    counting.count(buffers)


def test_each_agent_is_summed_up_by_itself_and_begins_anew_when_its_episode_ends():
    counting = counter()
    count(counting, [[1, 2], [3, 4]])
    count(counting, [[10, 20], [30, 40]], terminated=[(0, 1)], truncated=[(1, 0)])
    count(counting, [[100, 200], [300, 400]], terminated=[(0, 1), (0, 0)], truncated=[(0, 0)])
    assert counting.pop() == [
        EpisodeRecord(0, 1, 2, 22.0, "terminated"),
        EpisodeRecord(1, 0, 2, 33.0, "truncated"),
        EpisodeRecord(0, 0, 3, 111.0, "terminated"),  # both at once is an end
        EpisodeRecord(0, 1, 1, 200.0, "terminated"),
    ]
    assert counting.pop() == []
    assert counting.state()["reward"].tolist() == [[0, 0], [300, 444]]
    assert counting.state()["steps"].tolist() == [[0, 0], [1, 3]]


def test_a_count_goes_on_where_it_was_kept_and_begin_forgets_it():
    first, second = counter(), counter()
    count(first, [[1, 2], [3, 4]])
    second.restore(first.state())
    count(first, np.ones((2, 2)))
    count(second, np.ones((2, 2)), truncated=[(1, 1)])
    assert second.pop() == [EpisodeRecord(1, 1, 2, 5.0, "truncated")]
    first.begin()
    count(first, np.ones((2, 2)), truncated=[(1, 1)])
    assert first.pop() == [EpisodeRecord(1, 1, 1, 1.0, "truncated")]


def test_a_world_that_tells_its_own_episodes_is_asked_and_not_counted():
    told = [[EpisodeRecord(0, 0, 7, 1.5, "lap")], [EpisodeRecord(1, 1, 3, 0.5, "crash")]]
    counting = EpisodeCounter(SimpleNamespace(spec=SPEC, pop_episodes=lambda: told.pop(0)))
    counting.begin()  # what ended before is not told
    count(counting, np.ones((2, 2)), terminated=[(0, 0)])
    assert not counting.state()["steps"].any()
    assert counting.pop() == [EpisodeRecord(1, 1, 3, 0.5, "crash")]
    assert told == []


def test_many_episodes_come_to_a_few_figures():
    """Rewards 1, 3, 8: their mean 4, their deviations 9 + 1 + 16 = 26 by three."""
    records = [
        EpisodeRecord(0, 0, steps, reward, word) for steps, reward, word in ((2, 1, "b"), (3, 3, "a"), (7, 8, "b"))
    ]
    assert summarise(iter(records)) == EpisodeSummary(3, 4.0, math.sqrt(26 / 3), 4.0, {"b": 2 / 3, "a": 1 / 3})


def test_of_no_episode_no_figure_is_known():
    none = summarise([])
    assert (none.episodes, none.status_share) == (0, {})
    assert np.isnan([none.mean_reward, none.std_reward, none.mean_steps]).all()
