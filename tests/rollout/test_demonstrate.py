"""Whole episodes of somebody who shows how: which ticks are whose, who is asked, and by what chance."""

import numpy as np
import pytest
import torch
from toy_world import Walk

from racecraft.algorithms.rollout_batch import RolloutBatch
from racecraft.contract.errors import SettingError
from racecraft.rollout.demonstrate import demonstrate, in_episodes


class Shows:
    """Walks up, or by dice where it is asked to draw."""

    def __init__(self):
        self.forgotten = []

    def act(self, observations, action_mask=None):
        return np.full(len(observations["clock"]), 2)

    def reset_state(self, rows):
        self.forgotten.append(rows.tolist())


class Draws(Shows):
    def sample(self, observations, action_mask, generator):
        return torch.randint(0, 3, (len(observations["clock"]),), generator=generator).numpy()


def batch_of(terminated, truncated, active):
    ended = np.array(terminated, bool).T
    nothing = np.zeros(ended.shape, np.float32)
    cut, heeded = np.array(truncated, bool).T, np.array(active, bool).T
    return RolloutBatch({}, nothing, nothing, ended, cut, heeded, {}, np.ones(ended.shape[1], bool))


LONG = batch_of(
    terminated=[[0, 1, 0, 0, 1], [0, 0, 0, 0, 0]],
    truncated=[[0] * 5, [0, 0, 1, 0, 1]],
    active=[[1] * 5, [0, 1, 1, 1, 1]],
)
"""Two rows of two episodes, of 2 and 3 ticks, and of 3 and 2; the second row's first tick is not to be learned from."""


@pytest.mark.parametrize(
    ("episodes", "ticks", "whose"),
    [
        (1, [0, 2], [0, 0]),
        (3, [0, 2, 3, 5, 4, 6, 8], [0, 0, 1, 1, 2, 2, 2]),
        (4, [0, 2, 3, 5, 4, 6, 8, 7, 9], [0, 0, 1, 1, 2, 2, 2, 3, 3]),
    ],
)
def test_the_first_episode_of_every_row_comes_before_the_second_of_any(episodes, ticks, whose):
    """Tick t of row r has number 2 t + r."""
    found, names = in_episodes(LONG, episodes)
    assert (found.tolist(), names.tolist()) == (ticks, whose)
    assert names.dtype == np.int32


def test_episodes_of_which_nothing_is_learned_are_not_counted():
    batch = batch_of(terminated=[[1, 1], [1, 1]], truncated=np.zeros((2, 2)), active=[[0, 1], [1, 1]])
    found, names = in_episodes(batch, 2)
    assert (found.tolist(), names.tolist()) == ([1, 2], [0, 1])


@pytest.mark.parametrize(("wanted", "rounds"), [(1, 1), (4, 1), (5, 2)])
def test_each_row_plays_its_share_and_what_is_too_much_is_left_out(wanted, rounds):
    policy = Shows()
    shown = demonstrate(policy, Walk(2, num_agents=2), wanted)
    assert shown.num_episodes == wanted
    assert shown.actions.tolist() == [2] * len(shown)
    assert len(shown) == 12 * wanted, "up there is no end but the clock's, after twelve ticks"
    assert policy.forgotten == [[True] * 4] * (2 + rounds), "once for the reset, once for the round, and at every end"
    assert (shown.action_mask, shown.source) == (None, {})
    np.testing.assert_array_equal(shown.observations["clock"][:, 0], list(range(12)) * wanted)


def test_chance_is_drawn_by_the_seed_and_only_where_it_is_asked_for():
    world = Walk(2, num_agents=2)
    one, same, other = (demonstrate(Draws(), world, 4, seed=seed, sampled=True) for seed in (0, 0, 1))
    assert one.actions.tolist() == same.actions.tolist()
    assert one.actions.tolist() != other.actions.tolist()
    assert set(one.actions) == {0, 1, 2}
    assert demonstrate(Draws(), world, 4, sampled=True).actions.tolist() == one.actions.tolist(), (
        "seed 0 where none is said"
    )
    assert set(demonstrate(Draws(), world, 4).actions) == {2}, "the likeliest where nothing is said"
    with pytest.raises(SettingError, match="without --sampled"):
        demonstrate(Shows(), world, 4, sampled=True)
