"""A Unity agent's actions as one action of our contract.

The contract knows one choice among `count`, or one vector; Unity knows several branches of choices, numbers, and both
at once. Begin at `ActionTable`:

* numbers alone are a vector in [-1, 1];
* branches alone are one choice among all their combinations, the mask with them; `combinations[i]` spells choice i out;
* both at once, or more combinations than `MAX_COMBINATIONS`, are a vector: the numbers, then one score in [-1, 1] for
  every choice of every branch, of which the highest allowed one is obeyed.
"""

from __future__ import annotations

import itertools
import math

import numpy as np

from racecraft.contract.world import ActionSpec, Array, ContinuousActions, DiscreteActions
from racecraft.envs.unity.behaviors import UnityActions
from racecraft.envs.unity.session import Choice

MAX_COMBINATIONS = 1024
"""Branches with more combinations than this are told by scores."""


class ActionTable:
    """Translates between a behavior's actions and an action of the contract.

    >>> table = ActionTable(UnityActions(branches=(2, 3)))
    >>> table.spec.count, table.combinations[4].tolist()
    (6, [1, 1])
    >>> table.mask(np.array([[True, False, True, True, False]])).tolist()
    [[True, True, False, False, False, False]]
    """

    def __init__(self, actions: UnityActions) -> None:
        self.actions = actions
        branches = actions.branches
        self._starts = np.cumsum((0, *branches[:-1])) if branches else np.zeros(0, int)
        self.by_scores = bool(branches) and (actions.continuous > 0 or math.prod(branches) > MAX_COMBINATIONS)
        """Whether choices are told by scores."""
        self.combinations = np.zeros((0, len(branches)), np.int32)
        """int32 (count, branches): what each choice of the contract means; empty where choices are not counted."""
        self.spec: ActionSpec
        if branches and not self.by_scores:
            self.combinations = np.array(list(itertools.product(*map(range, branches))), np.int32)
            self.spec = DiscreteActions(len(self.combinations))
        else:
            width = actions.continuous + sum(branches)
            self.spec = ContinuousActions((-1.0,) * width, (1.0,) * width)

    @property
    def has_mask(self) -> bool:
        """Whether the contract's action mask is written."""
        return isinstance(self.spec, DiscreteActions)

    def mask(self, allowed: Array) -> Array:
        """Turn what Unity allows, bool (R, sum of branches), into a mask bool (R, count)."""
        return np.asarray(allowed[:, self._starts + self.combinations].all(axis=2))

    def choice(self, actions: Array, allowed: Array | None) -> Choice:
        """Turn actions of the contract, (R, *shape), into Unity's.

        Args:
            actions: The actions.
            allowed: bool (R, sum of branches), for scores; None where the behavior has no branches.
        """
        if self.has_mask:
            return Choice(discrete=self.combinations[actions])
        numbers = np.clip(actions[:, : self.actions.continuous], -1.0, 1.0)
        if not self.actions.branches:
            return Choice(continuous=numbers)
        scores = actions[:, self.actions.continuous :]
        if allowed is not None:
            scores = np.where(allowed, scores, -np.inf)
        parts = np.split(scores, self._starts[1:], axis=1)
        discrete = np.stack([part.argmax(axis=1) for part in parts], axis=1)
        return Choice(continuous=numbers if self.actions.continuous else None, discrete=discrete)
