"""A Unity agent's actions as an action of our contract.

Unity knows numbers, branches of choices, and both at once; so does the contract. Begin at `ActionTable`:

    numbers alone         ContinuousActions, a vector in [-1, 1]
    one branch            DiscreteActions
    several branches      MultiDiscreteActions, one choice in each
    numbers and branches  HybridActions, the numbers first

A mask has one column for each choice of each branch, branch after branch, as on the wire.
"""

from __future__ import annotations

import numpy as np

from racecraft.contract.world import (
    Array,
    ContinuousActions,
    DiscreteActions,
    HybridActions,
    MultiDiscreteActions,
    SingleActions,
)
from racecraft.worlds.unity.env.behaviors import UnityActions
from racecraft.worlds.unity.env.session import Choice


class ActionTable:
    """Translates between a behavior's actions and an action of the contract.

    >>> table = ActionTable(UnityActions(branches=(2, 3)))
    >>> table.spec
    MultiDiscreteActions(counts=(2, 3))
    >>> table.choice(np.array([[1, 2]])).discrete.tolist()
    [[1, 2]]
    """

    def __init__(self, actions: UnityActions) -> None:
        self.actions = actions
        self.spec = _spec_of(actions)

    @property
    def has_mask(self) -> bool:
        """Whether the contract's action mask is written: there is something to choose."""
        return bool(self.actions.branches)

    def choice(self, actions: Array) -> Choice:
        """Turn actions of the contract, (R, *shape), into Unity's."""
        numbers, branches = self.actions.continuous, self.actions.branches
        if not branches:
            return Choice(continuous=np.clip(actions, -1.0, 1.0))
        rows = actions.reshape(len(actions), -1)  # one branch alone is a scalar in the contract, a column in Unity
        discrete = np.rint(rows[:, numbers:]).astype(np.int32)
        return Choice(np.clip(rows[:, :numbers], -1.0, 1.0) if numbers else None, discrete)


def _spec_of(actions: UnityActions) -> SingleActions:
    numbers = ContinuousActions((-1.0,) * actions.continuous, (1.0,) * actions.continuous)
    choices = MultiDiscreteActions(tuple(actions.branches))
    if not actions.branches:
        return numbers
    if actions.continuous:
        return HybridActions(numbers, choices)
    return DiscreteActions(actions.branches[0]) if len(actions.branches) == 1 else choices
