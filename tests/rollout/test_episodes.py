"""The one runner of episodes beside the collector: who is asked with what, who hears of ends, who may rest."""

import numpy as np
from toy_world import LIMIT, Walk

from racecraft.contract.world import ArraySpec, DiscreteActions, EpisodeRecord, WorldSpec
from racecraft.rollout.episodes import CUT, play_episodes


class Notes:
    """Takes one choice always, and notes what it was shown and told."""

    def __init__(self, choice=2):
        self.choice, self.seen, self.masks, self.forgotten = choice, [], [], []

    def act(self, observations, action_mask=None):
        self.seen.append({name: part.copy() for name, part in observations.items()})
        self.masks.append(None if action_mask is None else action_mask.copy())
        return np.full(len(observations["clock"]), self.choice)

    def reset_state(self, rows):
        self.forgotten.append(rows.tolist())


class Seeded(Walk):
    def reset(self, buffers, seed):
        self.begun_with = seed
        super().reset(buffers, seed)


def test_one_episode_of_every_agent_is_played_with_seed_0_where_nothing_is_said():
    world, policy = Seeded(2, 2), Notes()
    told = play_episodes(policy, world)
    assert world.begun_with == 0
    assert [(one.world, one.agent, one.steps, one.status) for one in told] == [
        (n, m, LIMIT, "truncated") for n in range(2) for m in range(2)
    ]
    assert len(policy.seen) == LIMIT
    assert policy.forgotten == [[True] * 4, [True] * 4], "all begin, and all ended at once"
    assert policy.seen[0]["square"].shape == (4, 9)
    assert policy.seen[3]["clock"].tolist() == [[3]] * 4
    assert policy.masks == [None] * LIMIT
    play_episodes(policy, world, seed=5)
    assert world.begun_with == 5


def test_who_ended_alone_is_forgotten_alone():
    """Going down from square s takes s ticks."""
    world, policy = Walk(3, masked=False), Notes(0)
    told = play_episodes(policy, world, seed=2)
    lengths = [one.steps for one in told]
    assert len(set(lengths)) > 1
    ends = policy.forgotten[1:]
    first = min(lengths)
    assert ends[0] == [length == first for length in lengths]


def test_masks_are_shown_row_by_row():
    policy = Notes()
    play_episodes(policy, Walk(2, 2, masked=True), seed=1)
    for mask, seen in zip(policy.masks, policy.seen, strict=True):
        assert mask.shape == (4, 3)
        assert (mask[:, 0] == (seen["square"].argmax(axis=1) > 1)).all()


class Waits:
    """Two worlds of two agents; agent m of world n ends an episode every n + m + 1 ticks and is paid 1 a tick."""

    spec = WorldSpec("waits", 2, 2, {"clock": ArraySpec((1,), np.float32)}, DiscreteActions(3))

    def reset(self, buffers, seed):
        self.tick, self.rested = 0, []
        buffers.active[:] = True

    def step(self, actions, buffers):
        self.tick += 1
        buffers.reward[:] = 1.0
        buffers.truncated[:] = False
        buffers.terminated[:] = self.tick % np.array([[1, 2], [2, 3]]) == 0


class Rests(Waits):
    def rest(self, rows):
        self.rested.append((self.tick, rows.astype(int).tolist()))


def test_who_has_played_all_its_episodes_may_rest_unless_somebody_looks_on():
    world = Rests()
    told = play_episodes(Notes(), world, episodes_each=2)
    assert [one.steps for one in told] == [1, 1, 2, 2, 2, 2, 3, 3]
    assert world.rested == [
        (1, [[0, 0], [0, 0]]), (2, [[1, 0], [0, 0]]), (3, [[1, 0], [0, 0]]),
        (4, [[1, 1], [1, 0]]), (5, [[1, 1], [1, 0]]), (6, [[1, 1], [1, 1]]),
    ]  # fmt: skip
    seen = []
    play_episodes(Notes(), world, episodes_each=2, observers=iter([lambda *told: seen.append(told)]))
    assert world.rested == []
    assert len(seen) == 6
    assert seen[0][0] is world
    assert seen[0][2].shape == (2, 2)


def test_spare_episodes_are_played_before_those_that_count():
    told = play_episodes(Notes(), Waits(), episodes_each=1, spare=2)
    assert [one.steps for one in told] == [1, 2, 2, 3]
    cut = play_episodes(Notes(), Waits(), episodes_each=2, spare=1, max_ticks=5)
    assert [(one.world, one.agent, one.steps, one.reward, one.status) for one in cut] == [
        (0, 0, 1, 1.0, "terminated"), (0, 0, 1, 1.0, "terminated"),
        (0, 1, 2, 2.0, "terminated"), (0, 1, 1, 1.0, CUT),
        (1, 0, 2, 2.0, "terminated"), (1, 0, 1, 1.0, CUT),
        (1, 1, 2, 2.0, CUT),
    ]  # fmt: skip


def test_an_agent_cut_just_as_an_episode_ended_has_nothing_left_to_count():
    cut = play_episodes(Notes(), Waits(), episodes_each=3, max_ticks=4)
    assert [(one.world, one.agent, one.status) for one in cut if one.status == CUT] == [(1, 1, CUT)]
    assert [one.steps for one in cut] == [1, 1, 1, 2, 2, 2, 2, 3, 1]


def test_without_ticks_to_play_in_everybody_is_cut_at_once():
    told = play_episodes(Notes(), Waits(), max_ticks=0)
    assert [(one.world, one.agent, one.steps, one.reward, one.status) for one in told] == [
        (n, m, 0, 0.0, CUT) for n in range(2) for m in range(2)
    ]


def test_what_ended_before_counts_for_nobody():
    class Tells(Waits):
        """Still has an episode to tell of that ended before it was begun anew."""

        def reset(self, buffers, seed):
            super().reset(buffers, seed)
            self.left = [EpisodeRecord(0, 0, 99, 99.0, "before")]

        def pop_episodes(self):
            ended = [(n, m) for n in range(2) for m in range(2) if self.tick and self.tick % (n + m + 1) == 0]
            left, self.left = self.left, []
            return left + [EpisodeRecord(n, m, n + m + 1, 1.0, "now") for n, m in ended]

    told = play_episodes(Notes(), Tells())
    assert [(one.steps, one.status) for one in told] == [(1, "now"), (2, "now"), (2, "now"), (3, "now")]
