"""Several agents in several worlds: each plays its own episodes, and they come world by world, agent by agent."""

import numpy as np
from toy_world import Walk

from racecraft.rollout.episodes import play_episodes


class DownFrom:
    """Always goes down; notes the squares that the first tick was begun on."""

    def __init__(self):
        self.squares = None

    def act(self, observations, action_mask=None):
        if self.squares is None:
            self.squares = observations["square"].argmax(-1).tolist()
        return np.zeros(len(observations["square"]), np.int64)

    def reset_state(self, rows): ...


def test_every_agent_plays_as_many_as_were_asked_and_they_come_in_order():
    """By hand: going down from square s takes s ticks and earns (s - 1) + … + 1 + 0."""
    policy = DownFrom()
    told = play_episodes(policy, Walk(3, num_agents=2), episodes_each=2, seed=4, max_ticks=60)
    assert [(one.world, one.agent) for one in told] == [(n, m) for n in range(3) for m in range(2) for _ in range(2)]
    firsts = told[::2]
    assert [one.steps for one in firsts] == policy.squares
    assert [one.reward for one in firsts] == [square * (square - 1) / 2 for square in policy.squares]
    assert len(set(policy.squares)) > 1
