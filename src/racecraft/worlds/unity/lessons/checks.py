"""Checks of the lessons about Unity: they play a pupil's actions in the stand-in of Basic.

The scene is imported where it is needed: the first page of the course shall not wait for it.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from racecraft.lessons.checking import Answer, AnswerError, Verdict, passed, predicted, tried
from racecraft.lessons.models import fork

if TYPE_CHECKING:
    from racecraft.worlds.unity.lessons.basic import Episode

BEST = 0.93
"""Of an episode: seven steps at 0.01, and 1.0."""
CLOSE = 1e-6
GAMMA = 0.995
"""Of the article's training (source 002)."""
STROLLED = 10


def best_episode(answer: Answer) -> Verdict:
    """An episode that no other beats."""
    from racecraft.worlds.unity.env.basic_scene import LARGE_GOAL

    episode = _played(answer)
    told = {"total": episode.total, "steps": episode.steps}
    if not episode.ended:
        return tried("not_ended", **told)
    if episode.total >= BEST - CLOSE:
        return passed(**told)
    return tried("detour" if episode.place == LARGE_GOAL else "near_prize", **told)


def _played(answer: Answer) -> Episode:
    from racecraft.worlds.unity.lessons.basic import ACTIONS, MAX_STEPS, play

    actions = answer.taken("actions")
    if not isinstance(actions, list) or len(actions) > MAX_STEPS or not all(one in ACTIONS for one in actions):
        raise AnswerError("The steps of the figure cannot be read; begin a new episode in it.")
    return play([int(one) for one in actions])


def random_agent(answer: Answer) -> Verdict:
    """A prediction: what does an agent that knows nothing earn in an episode?"""
    from racecraft.worlds.unity.lessons.basic import random_episodes

    rows = random_episodes()
    (_, left, _, _), (_, right, _, _), (_, _, steps, total) = rows
    return predicted(answer, "reason", "near_and_long", rows, near=left, far=right, steps=steps, total=total)


def dearest_step(answer: Answer) -> Verdict:
    """The step penalty above which the near prize is the better one, at the article's discount factor."""
    cost, right = answer.number("cost"), fork.dearest(GAMMA)
    if abs(cost - right) <= 0.003:
        return passed(cost=right)
    left, far = (fork.worth(GAMMA, *side, cost) for side in (fork.LEFT, fork.RIGHT))
    case = "still_right" if cost < right else "already_left"
    return tried("all_steps" if abs(cost - 0.9 / 7) <= 0.001 else case, cost=cost, left=left, right=far)


def without_penalty(answer: Answer) -> Verdict:
    """A prediction: is going right after ten idle steps as good as going right at once, where steps cost nothing?"""
    steps, prize = fork.RIGHT
    rows = [
        (gamma, cost, *(fork.worth(gamma, count, prize, cost) for count in (steps, steps + STROLLED)))
        for gamma, cost in ((GAMMA, fork.COST), (GAMMA, 0.0), (1.0, 0.0))
    ]
    (_, _, soon, late), (_, _, same, _) = rows[1:]
    return predicted(answer, "reason", "discount", rows, soon=soon, late=late, same=same)
