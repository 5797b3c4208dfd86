"""Advantages and value targets, with the two endings kept apart.

*Terminated*: nothing follows, so nothing is bootstrapped. *Truncated*: we stopped watching, so the value of the final
observation follows. Neither lets anything of the next episode through. A row that is not *active* was not steered: it
is passed through as if its tick belonged to the active tick before it.
"""

from __future__ import annotations

import numpy as np

from racecraft.contract.world import Array


def advantages(
    reward: Array,
    value: Array,
    next_value: Array,
    terminated: Array,
    truncated: Array,
    discount: float,
    gae_lambda: float,
    active: Array | None = None,
    ratio: Array | None = None,
) -> tuple[Array, Array]:
    """Return generalised advantages and value targets, both float32 (T, R).

    With a `ratio` they are V-trace's: those of the policy of today, from what an older one decided. What happens after
    a tick counts as far as today's policy would have come there, and an error of the critic as far as it would have
    made it. Where all ratios are 1 they are the same to the bit as without. The advantage of a tick does not weigh the
    tick's own decision; whoever takes the gradient does.

    Args:
        reward: float32 (T, R), of the tick taken from row t.
        value: float32 (T, R), the critic's value of the observation at t.
        next_value: float32 (T, R), the value of what followed within the same episode: `value[t + 1]`, or the value of
            the final observation where the episode was truncated. Not read where it terminated.
        terminated: bool (T, R).
        truncated: bool (T, R).
        discount: Weight of the next tick's value (gamma), 0 to 1.
        gae_lambda: Mix of one-step and long estimates (lambda), 0 to 1.
        active: bool (T, R), whether the action at t was obeyed; None where all were. The results of inactive rows
            carry no meaning.
        ratio: float32 (T, R), how much likelier today's policy makes what was decided at t than the policy that decided
            it, already cut at its cap (rho and c); None: it is the same policy.

    Sources: Schulman et al., "High-dimensional continuous control using generalized advantage estimation", 2016,
    equations 11 to 16; Espeholt et al., "IMPALA", 2018, equation 1 and remark 2 (c times lambda), with one cap for
    both. With lambda below 1 the advantage looks ahead by the same mix as the target, so that it is GAE's where nothing
    is old; with lambda 1 it is the paper's, r + gamma v' - V.
    """
    ticks = len(reward)
    found, apart = np.zeros_like(value), np.zeros_like(value)  # advantages; targets less values
    running = np.zeros_like(value[0])
    carries_on = ~(terminated | truncated)
    behind = value[-1]  # worth of the row after t, when it is inactive and the critic cannot be asked
    for t in reversed(range(ticks)):
        following = next_value[t]
        if active is not None and t + 1 < ticks:
            following = np.where(carries_on[t] & ~active[t + 1], behind, following)
        target = reward[t] + discount * following * ~terminated[t]
        after = discount * carries_on[t] * running
        advantage = target - value[t] + gae_lambda * after
        running = advantage if ratio is None else ratio[t] * advantage
        if active is not None:
            advantage, running = (np.where(active[t], part, after) for part in (advantage, running))
            behind = np.where(active[t], value[t], target)
        found[t] = advantage
        apart[t] = running
    return found, apart + value


def rewards_to_go(
    reward: Array, terminated: Array, truncated: Array, discount: float, following: Array | None = None
) -> Array:
    """Return what each tick and those after it in its episode brought, discounted: float32 (T, R).

    Args:
        reward: float32 (T, R).
        terminated: bool (T, R).
        truncated: bool (T, R).
        discount: Weight of the next tick (gamma), 0 to 1.
        following: float32 (T, R), read where an episode was truncated and not terminated: what would have come; None:
            nothing.

    >>> never = np.zeros((3, 1), bool)
    >>> rewards_to_go(np.ones((3, 1), np.float32), np.array([[False], [True], [False]]), never, 0.5).ravel()
    array([1.5, 1. , 1. ], dtype=float32)
    """
    found = np.zeros_like(reward)
    cut, ended = truncated & ~terminated, terminated | truncated
    running = np.zeros_like(reward[0])
    for t in reversed(range(len(reward))):
        behind = np.where(ended[t], 0.0, running)
        if following is not None:
            behind = np.where(cut[t], following[t], behind)
        running = found[t] = reward[t] + discount * behind
    return found


def episode_returns(reward: Array, ended: Array, active: Array) -> tuple[Array, Array]:
    """Return how many whole episodes each row played, int64 (R,), and the mean of their plain sums, float64 (R,).

    Args:
        reward: float32 (T, R).
        ended: bool (T, R), an episode's last tick.
        active: bool (T, R); an episode without a single active tick does not count (a quota that was full). The rewards
            of a counted one count all, whether its row was steered just then or not.

    The mean is nan where a row ended no episode.
    """
    rows = ended.shape[1]
    number = np.cumsum(ended, axis=0) - ended  # which of its row's episodes a tick belongs to
    cells = number * rows + np.arange(rows)
    size = (int(number.max(initial=0)) + 1) * rows

    def told(weights: Array) -> Array:
        return np.bincount(cells.ravel(), weights.ravel(), size).reshape(-1, rows)

    counted = (told(ended) > 0) & (told(active) > 0)
    count = counted.sum(axis=0)
    total = (told(reward) * counted).sum(axis=0)
    return count, np.divide(total, count, out=np.full(rows, np.nan), where=count > 0)


def explained_variance(predicted: Array, found: Array) -> float:
    """Return the share of the targets' variance that the critic foresaw: 1 all, 0 none, below 0 worse than none."""
    spread = float(np.var(found))
    return float("nan") if spread == 0.0 else 1.0 - float(np.var(found - predicted)) / spread
