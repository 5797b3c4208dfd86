"""What ML-Agents' demonstrations show, as racecraft's own."""

import numpy as np
import pytest

from racecraft.algorithms.policy_spec import PolicySpec
from racecraft.contract.world import ContinuousActions, DiscreteActions, HybridActions, MultiDiscreteActions
from racecraft.worlds.unity.files.demonstrations import Demonstration, Transitions
from racecraft.worlds.unity.training import shown


class Played(Demonstration):
    """A file whose steps are known, whatever its records."""

    def transitions(self, action_lag=None):
        ticks = len(self.done)
        return Transitions(
            self.observations, self.continuous, self.discrete, self.reward, self.done, self.interrupted,
            None if self.allowed is None else self.allowed[:ticks],
        )  # fmt: skip


def played(ticks, numbers=0, branches=(), allowed=None):
    places = np.arange(ticks)
    return Played(
        name="play", behavior="Mover?team=0", num_continuous=numbers, branches=branches,
        observations={"obs_0": np.repeat(places[:, None], 2, axis=1).astype(np.float32)},
        continuous=np.linspace(-2.0, 2.0, ticks * numbers, dtype=np.float32).reshape(ticks, numbers),
        discrete=np.array([[place % count for count in branches] for place in places]).reshape(ticks, len(branches)),
        reward=places.astype(np.float32), done=np.zeros(ticks, bool), interrupted=np.zeros(ticks, bool),
        allowed=allowed, episode_id=np.zeros(ticks, np.int64), num_episodes=1, mean_reward=0.0, action_lag=0,
    )  # fmt: skip


def read(monkeypatch, folder, *files):
    asked = []
    monkeypatch.setattr(shown, "read_demonstrations", lambda where: asked.append(where) or list(files))
    found = shown.read_demonstration_batch(folder)
    assert asked == [folder]
    return found


@pytest.mark.parametrize(
    ("numbers", "branches", "actions", "last"),
    [
        (2, (), ContinuousActions((-1.0, -1.0), (1.0, 1.0)), [1.0, 1.0]),
        (0, (3,), DiscreteActions(3), 2),
        (0, (3, 2), MultiDiscreteActions((3, 2)), [2, 0]),
        (1, (3,), HybridActions(ContinuousActions((-1.0,), (1.0,)), MultiDiscreteActions((3,))), [1.0, 2.0]),
    ],
)
def test_what_a_file_decided_becomes_a_worlds_actions(numbers, branches, actions, last, monkeypatch, tmp_path):
    found = read(monkeypatch, tmp_path, played(3, numbers, branches))
    assert PolicySpec.from_dictionary(found.spec).actions == actions
    assert found.actions.shape == (3, *actions.shape)
    assert found.actions[-1].tolist() == last
    if numbers:
        assert found.actions.dtype == np.float32
        assert found.actions[0, 0] == -1.0, "cut to what a world obeys"
    assert (found.action_mask is None) is (branches == ())


def test_where_a_file_says_nothing_of_masks_everything_was_allowed(monkeypatch, tmp_path):
    some = np.array([[True, False, True]] * 2)
    for first, second in ((some, None), (None, some)):
        files = played(2, branches=(3,), allowed=first), played(2, branches=(3,), allowed=second)
        found = read(monkeypatch, tmp_path, *files)
        whole = np.ones((2, 3), bool)
        expected = np.concatenate([whole if one is None else one for one in (first, second)])
        assert (found.action_mask.dtype, found.action_mask.tolist()) == (bool, expected.tolist())
    assert not PolicySpec.from_dictionary(read(monkeypatch, tmp_path, played(2, branches=(3,))).spec).has_action_mask
    masked = read(monkeypatch, tmp_path, played(2, branches=(3,), allowed=some))
    assert PolicySpec.from_dictionary(masked.spec).has_action_mask
